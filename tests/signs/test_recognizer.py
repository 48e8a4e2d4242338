import numpy as np
import pytest

from handsteer.config import LandmarksConfig, SignsConfig
from handsteer.errors import FrameError
from handsteer.landmarks.mediapipe import MediaPipeLandmarker
from handsteer.landmarks.recorded import RecordedLandmarker
from handsteer.signs.model import load_model
from handsteer.signs.recognizer import Recognizer
from handsteer.signs.trained import TrainedClassifier
from handsteer.signs.vocabulary import FORWARD, NONE, SIGNS
from tests.signs.hands import show_fingers, show_sign

IMAGE = np.zeros((480, 640, 3), np.uint8)
HAND = show_sign(FORWARD)
CLASSIFIER = TrainedClassifier(load_model())


def recognizer(*frames: bool) -> Recognizer:
    return Recognizer(RecordedLandmarker([[HAND] if there else [] for there in frames]), CLASSIFIER, SignsConfig())


def test_reasons_on_the_way_to_a_sign() -> None:
    stream = recognizer(False, True, True, True, True)
    steps = [stream.step(IMAGE, 0.04) for _ in range(5)]
    assert [step.sign for step in steps] == [NONE, NONE, NONE, NONE, FORWARD]
    assert [step.reason for step in steps] == [
        "no hand is in view",
        "Forward is not confirmed yet",
        "Forward is not confirmed yet",
        "Forward is not confirmed yet",
        "Forward is shown",
    ]
    assert steps[0].hand is None
    assert steps[1].seen == FORWARD


def test_a_hand_without_a_sign() -> None:
    stream = Recognizer(RecordedLandmarker([[show_fingers("index", "middle")]]), CLASSIFIER, SignsConfig())
    assert stream.step(IMAGE, 0.04).reason == "the hand shows none of the signs"


def test_a_confidence_below_the_least_is_none() -> None:
    stream = Recognizer(RecordedLandmarker([[HAND]]), CLASSIFIER, SignsConfig(min_confidence=1.0))
    assert stream.step(IMAGE, 0.04).seen == NONE


@pytest.mark.parametrize("image", [np.zeros((0, 0, 3), np.uint8), np.zeros((480, 640, 3), np.float32)])
def test_a_broken_frame_raises(image: np.ndarray) -> None:
    stream = Recognizer(MediaPipeLandmarker(LandmarksConfig()), CLASSIFIER, SignsConfig())
    with pytest.raises(FrameError):
        stream.step(image, 0.0)


def test_the_likelihoods_are_there_whether_they_suffice_or_not() -> None:
    step = Recognizer(RecordedLandmarker([[HAND]]), CLASSIFIER, SignsConfig(min_confidence=1.0)).step(IMAGE, 0.04)
    assert step.seen == NONE
    assert set(step.likelihoods) == set(SIGNS)
    assert max(step.likelihoods, key=step.likelihoods.__getitem__) == FORWARD
    assert recognizer(False).step(IMAGE, 0.04).likelihoods == {}
