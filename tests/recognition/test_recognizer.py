import numpy as np
import pytest

from handsteer.config import Config, SignsConfig
from handsteer.errors import CameraUnreadable, FrameError
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognizer
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP
from tests.recognition.hands import RecordedLandmarker, moved, show_fingers, show_sign

GREY = np.zeros((480, 640, 3), np.uint8)
IMAGE = np.full((480, 640, 3), (0, 40, 90), np.uint8)
HAND = show_sign(FORWARD)
PEACE = show_fingers("index", "middle")
CLASSIFIER = ShippedClassifier(load_model())


def reading(frames: list[list[Hand]], **signs: float) -> Recognizer:
    """Return a recogniser that finds ``frames``, whatever the images show."""
    config = Config(signs=SignsConfig(**signs))
    return Recognizer(config, landmarker=RecordedLandmarker(frames), classifier=CLASSIFIER)


def recognizer(*frames: bool) -> Recognizer:
    return reading([[HAND] if there else [] for there in frames])


def test_reasons_on_the_way_to_a_sign() -> None:
    stream = recognizer(False, True, True, True, True)
    steps = [stream.step(IMAGE, 0.04) for _ in range(5)]
    assert [step.sign for step in steps] == [NONE, NONE, NONE, NONE, FORWARD]
    assert [step.reason for step in steps] == [
        "no hand is in view",
        "hold Forward a moment longer",
        "hold Forward a moment longer",
        "hold Forward a moment longer",
        "Forward is shown",
    ]
    assert steps[0].hand is None
    assert steps[1].seen == FORWARD


def test_a_hand_without_a_sign() -> None:
    stream = reading([[show_fingers("index", "middle")]])
    assert stream.step(IMAGE, 0.04).reason == "the hand shows none of the signs"


def test_a_confidence_below_the_least_is_none() -> None:
    stream = reading([[HAND]], min_confidence=1.0)
    assert stream.step(IMAGE, 0.04).seen == NONE


@pytest.mark.parametrize("image", [np.zeros((0, 0, 3), np.uint8), np.zeros((480, 640, 3), np.float32)])
def test_a_broken_frame_raises(image: np.ndarray) -> None:
    stream = Recognizer(classifier=CLASSIFIER)
    with pytest.raises(FrameError):
        stream.step(image, 0.0)


def test_a_name_that_no_photo_can_have_is_refused() -> None:
    with pytest.raises(CameraUnreadable, match=r"cannot read the photo a.*: its name contains a null character"):
        reading([[]]).recognize("a\0b")


def test_a_sign_that_passes_by_does_not_count_until_the_hand_is_held_still() -> None:
    passing = [moved(HAND, x_px=-150.0 + 25.0 * frame) for frame in range(12)]
    stream = reading([[hand] for hand in [*passing, *[passing[-1]] * 8]])
    steps = [stream.step(IMAGE, 1 / 30) for _ in range(20)]
    assert all(step.seen == FORWARD for step in steps)
    assert [step.sign for step in steps[:12]] == [NONE] * 12
    assert steps[-1].sign == FORWARD


def test_stop_counts_at_its_first_frame_however_the_hand_moves() -> None:
    hands = [moved(show_sign(STOP), x_px=-150.0 + 40.0 * frame) for frame in range(3)]
    stream = reading([[hand] for hand in hands])
    assert stream.step(IMAGE, 1 / 30).sign == STOP


@pytest.mark.parametrize("x_px", [0.0, 30.0, 200.0])
def test_another_sign_counts_as_soon_wherever_the_hand_is_by_then(x_px: float) -> None:
    hands = [show_sign(GO)] * 10 + [moved(HAND, x_px=x_px)] * 10
    stream = reading([[hand] for hand in hands], dropout_hold=0.0)
    signs = [stream.step(IMAGE, 1 / 30).sign for _ in range(20)]
    # A hand that jumps by more than its size is another hand, which is seen from the next frame on.
    assert signs.index(FORWARD) <= (14 if x_px > 100 else 13)


def test_stop_counts_at_its_first_frame_where_the_hand_has_jumped_to() -> None:
    hands = [HAND] * 6 + [moved(show_sign(STOP), x_px=250.0)]
    stream = reading([[hand] for hand in hands])
    assert [stream.step(IMAGE, 1 / 30).sign for _ in range(7)][-2:] == [FORWARD, STOP]


class Searching(RecordedLandmarker):
    """Notes in which frames further hands were asked for."""

    searched: tuple[bool, ...] = ()

    def detect(self, image: np.ndarray, *, search: bool = True, dt_s: float = 0.0) -> list[Hand]:
        self.searched = (*self.searched, search)
        return super().detect(image, search=search, dt_s=dt_s)


def test_further_hands_are_looked_for_only_while_no_sign_counts_or_is_about_to() -> None:
    peace = show_fingers("index", "middle")
    landmarker = Searching([[peace], [peace], *[[HAND]] * 6])
    stream = Recognizer(landmarker=landmarker, classifier=CLASSIFIER)
    assert [stream.step(IMAGE, 0.04).sign for _ in range(8)] == [NONE] * 5 + [FORWARD] * 3
    assert landmarker.searched == (True, True, True, *[False] * 5)


class Unsure(RecordedLandmarker):
    """Sees ``better`` when it looks again, and notes at which hands."""

    def __init__(self, frames: list[list[Hand]], better: Hand) -> None:
        super().__init__(frames)
        self.better = better
        self.asked: list[Hand] = []

    def look_again(self, image: np.ndarray, hand: Hand) -> Hand:
        self.asked.append(hand)
        return self.better


class Doubted(Unsure):
    """Has these second opinions, the other one mirrored, and notes of which hands, and which it goes on to follow."""

    def __init__(self, frames: list[list[Hand]], *opinions: Hand | None) -> None:
        super().__init__(frames, frames[0][0])
        self.opinions: tuple[Hand | None, ...] = opinions or (HAND, HAND)
        self.doubted: list[Hand] = []
        self.followed: list[Hand] = []

    def second_opinion(self, image: np.ndarray, hand: Hand, *, mirrored: bool = False) -> Hand | None:
        if not mirrored:
            self.doubted.append(hand)
        return self.opinions[mirrored]

    def follow_only(self, hand: Hand) -> None:
        self.followed.append(hand)


def test_a_hand_without_a_sign_is_seen_again() -> None:
    peace = show_fingers("index", "middle")
    landmarker = Unsure([[peace]], HAND)
    recognition = Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(IMAGE)
    assert (recognition.sign, recognition.hand) == (FORWARD, HAND)
    assert len(landmarker.asked) == 1


def test_a_second_opinion_is_asked_for_after_that() -> None:
    peace, better = PEACE, moved(PEACE, x_px=5.0)
    landmarker = Doubted([[peace]])
    landmarker.better = better
    recognition = Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(IMAGE)
    assert (recognition.sign, recognition.hand) == (FORWARD, HAND)
    assert landmarker.doubted == [better]


@pytest.mark.parametrize("shown", [PEACE, show_sign(GO)])
@pytest.mark.parametrize(
    "opinions",
    [
        *((each, each) for each in (moved(PEACE, x_px=5.0), moved(show_sign(STOP), x_px=5.0))),
        *((HAND, other) for other in (PEACE, show_sign(GO), show_sign(BACKWARD))),
        (show_sign(GO), HAND),
        (HAND, None),
        (None, None),
    ],
)
def test_a_hand_stays_as_it_was_seen_unless_second_opinions_agree_on_a_sign(
    shown: Hand, opinions: tuple[Hand | None, ...]
) -> None:
    landmarker = Doubted([[shown]], *opinions)
    recognition = Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(IMAGE)
    assert (recognition.sign, recognition.hand) == (CLASSIFIER.classify(shown).sign, shown)


@pytest.mark.parametrize("mirrored", [None, PEACE, show_sign(GO)])
def test_without_colours_the_first_opinion_is_enough_unless_a_fist_is_seen(mirrored: Hand | None) -> None:
    for shown, sign in ((PEACE, FORWARD), (show_sign(GO), GO)):
        landmarker = Doubted([[shown]], HAND, mirrored)
        assert Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(GREY).sign == sign


def test_a_fist_is_another_sign_by_a_second_opinion() -> None:
    landmarker = Doubted([[show_sign(GO)]])
    assert Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(IMAGE).sign == FORWARD


def test_a_hand_with_a_second_opinion_is_followed_as_it_was_found() -> None:
    landmarker = Doubted([[PEACE]] * 10)
    stream = Recognizer(landmarker=landmarker, classifier=CLASSIFIER)
    assert [stream.step(IMAGE, 0.04).sign for _ in range(10)][-1] == FORWARD
    assert landmarker.followed
    assert all(hand is PEACE for hand in landmarker.followed)


def test_second_opinions_that_change_nothing_are_asked_for_now_and_then() -> None:
    landmarker = Doubted([[PEACE]] * 40, PEACE, PEACE)
    stream = Recognizer(landmarker=landmarker, classifier=CLASSIFIER)
    for _ in range(30):
        stream.step(IMAGE, 0.04)
    assert len(landmarker.doubted) == 3
    stream.recognize(IMAGE)
    stream.step(IMAGE, 0.04)
    assert len(landmarker.doubted) == 5


def test_second_opinions_that_change_something_are_asked_for_in_each_frame_and_may_fail_once() -> None:
    landmarker = Doubted([[PEACE]] * 40)
    stream = Recognizer(landmarker=landmarker, classifier=CLASSIFIER)
    signs = []
    for number in range(30):
        landmarker.opinions = (PEACE, PEACE) if number % 5 == 4 else (HAND, HAND)
        signs.append(stream.step(IMAGE, 0.04).sign)
    assert len(landmarker.doubted) == 30
    assert signs[10:] == [FORWARD] * 20


def test_a_frame_without_time_for_a_second_opinion_leaves_it_to_the_next() -> None:
    landmarker = Doubted([[PEACE]] * 10)
    stream = Recognizer(landmarker=landmarker, classifier=CLASSIFIER)
    landmarker.opinions = (None, None)
    for _ in range(5):
        stream.step(IMAGE, 0.04)
    assert len(landmarker.doubted) == 5


def test_no_hand_is_seen_again_while_any_shows_a_sign() -> None:
    peace = moved(PEACE, x_px=200)
    for hands, sign in (([show_sign(STOP)], STOP), ([peace, show_sign(STOP)], STOP), ([HAND], FORWARD)):
        landmarker = Doubted([hands])
        assert Recognizer(landmarker=landmarker, classifier=CLASSIFIER).recognize(IMAGE).sign == sign
        assert not landmarker.asked
        assert not landmarker.doubted


def test_a_sign_that_counts_goes_on_while_the_hand_moves() -> None:
    hands = [HAND] * 6 + [moved(HAND, x_px=25.0 * frame) for frame in range(8)]
    stream = reading([[hand] for hand in hands])
    assert [stream.step(IMAGE, 1 / 30).sign for _ in range(14)][4:] == [FORWARD] * 10


def test_the_likelihoods_are_there_whether_they_suffice_or_not() -> None:
    step = reading([[HAND]], min_confidence=1.0).step(IMAGE, 0.04)
    assert step.seen == NONE
    assert set(step.likelihoods) == set(SIGNS)
    assert max(step.likelihoods, key=step.likelihoods.__getitem__) == FORWARD
    assert recognizer(False).step(IMAGE, 0.04).likelihoods == {}
