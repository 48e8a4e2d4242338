import numpy as np

from handsteer.recognition.hand import Hand, RecordedLandmarker

FRAME = np.zeros((48, 64, 3), np.uint8)
HAND = Hand(
    points=np.full((21, 3), 0.5, np.float32),
    world=np.zeros((21, 3), np.float32),
    handedness="Left",
    handedness_score=0.9,
    presence=0.8,
    image_size=(64, 48),
)


def test_gives_the_hands_of_each_frame_in_turn_and_then_none() -> None:
    landmarker = RecordedLandmarker([[HAND], [], [HAND, HAND]])
    assert [len(landmarker.detect(FRAME)) for _ in range(5)] == [1, 0, 2, 0, 0]


def test_points_in_pixels_follow_the_size_of_the_frame() -> None:
    (hand,) = RecordedLandmarker([[HAND]]).detect(FRAME)
    np.testing.assert_array_equal(hand.pixels[0], (32, 24, 32))
