import numpy as np

from tests.recognition.hands import show_sign


def test_points_in_pixels_follow_the_size_of_the_frame() -> None:
    hand = show_sign("Stop")
    np.testing.assert_allclose(hand.pixels, hand.points * (640, 480, 640), rtol=1e-6)
