"""Hands at rest: by their place on made-up people, and on photos of real ones."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.config import Config, LandmarksConfig, SignsConfig
from handsteer.errors import ModelMissing
from handsteer.recognition.hand import Hand
from handsteer.recognition.landmark_models import find_model
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.recognizer import Recognizer
from handsteer.recognition.resting import MODEL, Person, PersonDetector, RestingHands
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import BACKWARD, FORWARD, GO, NONE, STOP
from tests.recognition.hands import SIZE, RecordedLandmarker, hand_of, show_sign

SHOULDERS, HIPS = np.array([320.0, 150.0]), np.array([320.0, 350.0])
PERSON = Person(SHOULDERS, HIPS)
TORSO_PX = 200.0


def hand_at(down: float, beside: float, size: float, sign: str = GO) -> Hand:
    """Return a hand at that place of :data:`PERSON`, all in lengths from the shoulders to the hips."""
    hand = show_sign(sign)
    palm = hand.pixels[[0, 5, 9, 13, 17], :2].mean(axis=0)
    scale = size * TORSO_PX / hand.longer_side_px
    place = SHOULDERS + TORSO_PX * np.array([beside, down])
    return hand_of((hand.pixels[:, :2] - palm) * scale + place, hand.world)


@pytest.mark.parametrize(
    ("down", "beside", "size", "rests"),
    [
        (1.1, 0.4, 0.3, True),  # beside the body
        (0.9, -0.1, 0.3, True),  # in the lap
        (0.7, 0.0, 0.25, True),  # clasped in front of the body
        (0.4, 0.5, 0.3, False),  # raised
        (-0.5, 0.4, 0.3, False),  # above the shoulders
        (1.0, 0.4, 0.7, False),  # stretched out to the camera
        (1.0, 1.4, 0.3, False),  # of another person
    ],
)
def test_a_hand_rests_that_is_low_beside_the_body_and_not_in_front_of_it(
    down: float, beside: float, size: float, rests: bool
) -> None:
    assert PERSON.has_at_rest(hand_at(down, beside, size)) is rests


def test_a_hand_that_drives_may_be_moved_lower() -> None:
    assert [PERSON.has_at_rest(hand_at(down, 0.3, 0.3), drives=True) for down in (0.75, 1.0)] == [False, True]


def test_a_person_who_leans_is_measured_along_the_body() -> None:
    leaning = Person(np.array([220.0, 150.0]), np.array([320.0, 323.0]))  # by 30 degrees
    down, beside = leaning.place(hand_at(0.87, 0.0, 0.3))
    assert down == pytest.approx(1.0, abs=0.01)
    assert beside == pytest.approx(0.0, abs=0.01)


def test_without_the_model_it_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    with pytest.raises(ModelMissing, match="handsteer models"):
        RestingHands(threads=1)


@pytest.fixture(scope="module")
def detector() -> PersonDetector:
    return PersonDetector(find_model(MODEL), threads=1)


def photos(data_dir: Path, folder: str) -> list[np.ndarray]:
    paths = sorted((data_dir / "photos" / folder).glob("emre*"))
    assert paths
    return [np.asarray(cv2.imread(str(path)), np.uint8) for path in paths]


@pytest.mark.slow
@pytest.mark.parametrize("flip", [False, True])
def test_real_hands_that_show_a_sign_do_not_rest_and_those_that_hang_do(
    data_dir: Path, detector: PersonDetector, flip: bool
) -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    hanging = 0
    for folder in ("go", "forward", "turn_left", "negatives/thumb_down"):
        for image in photos(data_dir, folder)[:12]:
            seen = np.ascontiguousarray(image[:, ::-1]) if flip else image
            landmarker.reset()
            hands = landmarker.detect(seen)
            raised = min(hands, key=lambda hand: hand.points[:, 1].mean())
            for person in detector.detect(seen):
                assert not person.has_at_rest(raised)
                low = [hand for hand in hands if person.place(hand)[0] > 0.8]
                assert all(person.has_at_rest(hand) for hand in low)
                hanging += len(low)
    assert hanging >= 5


def hands_of(image: np.ndarray, detector: PersonDetector, sign: str) -> tuple[Hand, Hand]:
    """Return a hand that shows ``sign`` raised, and one that shows it beside the body of the person in ``image``."""
    (person, *_) = detector.detect(image)
    made = []
    for down in (0.1, 1.1):
        hand = show_sign(sign)
        scale = 0.3 * person.length / hand.longer_side_px
        palm = hand.pixels[[0, 5, 9, 13, 17], :2].mean(axis=0)
        place = person.shoulders + down * (person.hips - person.shoulders) + (0.4 * person.length, 0.0)
        made.append(hand_of((hand.pixels[:, :2] - palm) * scale + place, hand.world))
    return made[0], made[1]


class TestRecognizer:
    """Hands at rest in a stream of frames that show a real person, with landmarks of hands at chosen places."""

    @pytest.fixture
    def image(self, data_dir: Path, detector: PersonDetector) -> np.ndarray:
        whole = [
            each
            for each in photos(data_dir, "go")
            if each.shape[:2] == SIZE[::-1] and (found := detector.detect(each)) and found[0].hips[1] < 0.7 * SIZE[1]
        ]
        return whole[0]

    def recognizer(self, *frames: list[Hand], reject: bool = True) -> Recognizer:
        config = Config(signs=SignsConfig(confirm_time=0.1), landmarks=LandmarksConfig(reject_resting=reject))
        return Recognizer(
            config, landmarker=RecordedLandmarker(list(frames)), classifier=ShippedClassifier(load_model())
        )

    @pytest.mark.parametrize("sign", [FORWARD, BACKWARD, GO])
    def test_a_sign_counts_from_a_raised_hand_only(
        self, image: np.ndarray, detector: PersonDetector, sign: str
    ) -> None:
        raised, resting = hands_of(image, detector, sign)
        for hand, counted in ((raised, {NONE, sign}), (resting, {NONE})):
            stream = self.recognizer(*[[hand]] * 60)
            assert {stream.step(image, 1 / 30).sign for _ in range(60)} == counted

    def test_stop_counts_from_a_hand_at_rest(self, image: np.ndarray, detector: PersonDetector) -> None:
        _, resting = hands_of(image, detector, STOP)
        assert self.recognizer([resting]).step(image, 0.0).sign == STOP

    def test_stop_of_a_hand_at_rest_leaves_the_raised_hand_alone(
        self, image: np.ndarray, detector: PersonDetector
    ) -> None:
        raised, _ = hands_of(image, detector, BACKWARD)
        _, resting = hands_of(image, detector, STOP)
        stream = self.recognizer(*[[resting, raised]] * 8)
        assert [stream.step(image, 0.05).sign for _ in range(8)][-1] == BACKWARD

    def test_a_hand_that_drives_and_is_lowered_stops_driving(self, image: np.ndarray, detector: PersonDetector) -> None:
        raised, resting = hands_of(image, detector, FORWARD)
        way = [raised.points + (resting.points - raised.points) * step / 12 for step in range(13)]
        lowered = [
            hand_of(points[:, :2] * np.array(SIZE), raised.world) for points in [way[0]] * 6 + way + [way[-1]] * 6
        ]
        stream = self.recognizer(*[[hand] for hand in lowered])
        signs = [stream.step(image, 1 / 30).sign for _ in lowered]
        assert signs[6] == FORWARD
        assert signs[-1] == NONE

    def test_it_can_be_switched_off(self, image: np.ndarray, detector: PersonDetector) -> None:
        _, resting = hands_of(image, detector, FORWARD)
        stream = self.recognizer(*[[resting]] * 8, reject=False)
        assert [stream.step(image, 0.05).sign for _ in range(8)][-1] == FORWARD
