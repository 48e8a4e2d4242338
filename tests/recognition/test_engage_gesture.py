"""The gesture that engages: on hands with known shapes, and by the virtual hand with the real models."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.plugins.virtual_hand.poses import FIST, HandPose, View, sign_pose
from handsteer.recognition.engage_gesture import EngageGesture, openness
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognition, Recognizer
from handsteer.types import GO, NONE, STOP
from tests.recognition.hands import moved, show_pose

DT_S = 1 / 30
PALM = sign_pose(STOP, "Right")


def closed_by(share: float) -> Hand:
    """Return an open hand at 0, a fist at 1."""
    return show_pose(HandPose((1 - share) * PALM.angles + share * FIST, View()))


OPEN, CLOSED = closed_by(0.0), closed_by(1.0)
HELD_OPEN, HELD_CLOSED = [OPEN] * 6, [CLOSED] * 6
CLOSING = [closed_by(share) for share in (0.2, 0.4, 0.5, 0.6, 0.8)]
OPENING = CLOSING[::-1]
GESTURE = [*HELD_OPEN, *CLOSING, *HELD_CLOSED, *OPENING, *HELD_OPEN]
GLIMPSE = closed_by(0.5)


def shown(hand: Hand | None) -> Recognition:
    """Return what a good classifier makes of it."""
    sign = NONE if hand is None else STOP if openness(hand) > 1.6 else GO if openness(hand) < 1.0 else NONE
    return Recognition(sign, sign, 1.0, 1.0, hand)


def is_made(hands: Iterable[Hand | None], gesture: EngageGesture | None = None, dt_s: float = DT_S) -> bool:
    gesture = gesture or EngageGesture()
    return any([gesture.step(shown(hand), dt_s) for hand in hands])


def test_openness_tells_a_palm_from_a_fist() -> None:
    assert openness(OPEN) > 1.6
    assert openness(CLOSED) < 1.0
    assert 1.05 < openness(GLIMPSE) < 1.5


@pytest.mark.parametrize("begin", [[], HELD_CLOSED, [None] * 5])
def test_a_hand_that_opens_closes_and_opens_makes_it(begin: list[Hand | None]) -> None:
    assert is_made([*begin, *GESTURE])


def test_its_progress_is_told() -> None:
    gesture = EngageGesture()
    steps = []
    for hands in (HELD_OPEN, [*CLOSING, *HELD_CLOSED], [*OPENING, *HELD_OPEN[:3]]):
        is_made(hands, gesture)
        steps.append(gesture.progress)
    assert steps == pytest.approx([1 / 3, 2 / 3, 1.0])
    is_made(HELD_OPEN * 2, gesture)
    assert gesture.progress == pytest.approx(1 / 3), "it is told for a moment only"


def test_it_ends_when_the_hand_closes_again() -> None:
    gesture = EngageGesture()
    is_made(GESTURE[:-2], gesture)
    assert gesture.progress == 1.0
    assert not is_made(CLOSING[2:], gesture)


@pytest.mark.parametrize(
    "hands",
    [
        HELD_OPEN * 20,
        HELD_CLOSED * 20,
        [*HELD_OPEN, *CLOSING, *HELD_CLOSED],
        [*HELD_CLOSED, *OPENING, *HELD_OPEN],
        [*HELD_OPEN, *HELD_CLOSED] * 10,
        [*HELD_OPEN, *CLOSING[:3], *OPENING[2:], *HELD_OPEN],
        [*HELD_OPEN, GLIMPSE, *HELD_CLOSED, *HELD_OPEN] * 5,
        [*HELD_OPEN, *HELD_CLOSED, *OPENING, *HELD_OPEN],
        [*HELD_OPEN, *CLOSING, *HELD_CLOSED, *HELD_OPEN],
        [*HELD_OPEN, GLIMPSE, *HELD_CLOSED, GLIMPSE, *HELD_OPEN],
        [*HELD_OPEN, *CLOSING, *HELD_CLOSED * 12, *OPENING, *HELD_OPEN],
    ],
    ids=[
        "a palm",
        "a fist",
        "it closes",
        "it opens",
        "pictures in turn",
        "half closed",
        "pictures with one wrong reading",
        "it jumps to the fist",
        "it jumps to the palm",
        "pictures with two wrong readings",
        "slowly",
    ],
)
def test_less_does_not_make_it(hands: Sequence[Hand]) -> None:
    assert not is_made(hands)


@pytest.mark.parametrize("part", [1, 2, 3])
def test_another_hand_does_not_complete_it(part: int) -> None:
    parts = [HELD_OPEN, CLOSING, HELD_CLOSED, [*OPENING, *HELD_OPEN]]
    elsewhere = [moved(hand, 60.0) if n >= part else hand for n, each in enumerate(parts) for hand in each]
    larger = [moved(hand, 0.0, 1.5) if n >= part else hand for n, each in enumerate(parts) for hand in each]
    assert not is_made(elsewhere)
    assert not is_made(larger)


@pytest.mark.parametrize(("missing", "makes_it"), [(2, True), (4, False)])
def test_a_hand_that_is_missed_for_long_may_be_another(missing: int, makes_it: bool) -> None:
    hands = [*HELD_OPEN, *CLOSING, *HELD_CLOSED, *[None] * missing, *OPENING, *HELD_OPEN]
    assert is_made(hands) == makes_it


def test_a_hand_that_is_gone_has_made_nothing() -> None:
    gesture = EngageGesture()
    is_made([*HELD_OPEN, *CLOSING, *HELD_CLOSED, *[None] * 4], gesture)
    assert gesture.progress == 0.0


def test_a_hand_that_moves_makes_it() -> None:
    assert is_made(moved(hand, 4.0 * n) for n, hand in enumerate(GESTURE))


def test_a_pause_of_the_camera_ends_it() -> None:
    gesture = EngageGesture()
    is_made([*HELD_OPEN, *CLOSING, *HELD_CLOSED], gesture)
    assert not is_made(HELD_CLOSED[:1], gesture, dt_s=0.5)
    assert not is_made([*OPENING, *HELD_OPEN], gesture)


def test_a_hand_without_any_size_does_no_harm() -> None:
    flat = replace(OPEN, points=np.zeros((21, 3), np.float32), world=np.zeros((21, 3), np.float32))
    assert not is_made([flat] * 5)


@pytest.mark.parametrize("fps", [30, 20])
@pytest.mark.parametrize("handedness", ["Right", "Left"])
def test_the_virtual_hand_makes_it_within_a_second_and_a_half(fps: int, handedness: str) -> None:
    clock, recognizer, gesture = SteppedClock(), Recognizer(), EngageGesture()
    script = VirtualHandConfig.model_validate({"script": "Stop:0.7 Go:0.5 Stop:0.7", "handedness": handedness})
    camera = VirtualHandCamera(script, width=640, height=480, fps=fps, clock=clock)
    made = []
    for _ in range(round(1.9 * fps)):
        clock.advance(1 / fps)
        made.append(gesture.step(recognizer.step(camera.read().image, 1 / fps), 1 / fps))
    assert made.index(True) / fps <= 1.7, "it is open from 0.3 s on"
