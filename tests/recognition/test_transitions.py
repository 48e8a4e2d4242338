"""From each sign to each other, with the in-between poses of a moving hand: nothing else may come to count."""

import itertools

import pytest

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import MOTION_SIGNS, NONE, SIGNS

FPS = 30
SHOWN_S = 0.7


def every_change(signs: tuple[str, ...]) -> list[str]:
    """Return a walk that goes from each sign to each other once (Hierholzer's circuit)."""
    ways = {sign: [other for other in signs if other != sign] for sign in signs}
    walk: list[str] = []
    stack = [signs[0]]
    while stack:
        if ways[stack[-1]]:
            stack.append(ways[stack[-1]].pop())
        else:
            walk.append(stack.pop())
    return walk[::-1]


@pytest.mark.slow
@pytest.mark.parametrize("handedness", ["Right", pytest.param("Left", marks=pytest.mark.exhaustive)])
def test_no_motion_sign_counts_that_is_not_shown(handedness: str) -> None:
    walk = every_change((*SIGNS, NONE))
    assert len(set(itertools.pairwise(walk))) == 7 * 6
    script = " ".join(f"{sign}:{SHOWN_S}" for sign in walk)
    clock = SteppedClock()
    config = VirtualHandConfig.model_validate({"script": script, "handedness": handedness})
    camera = VirtualHandCamera(config, width=320, height=240, fps=FPS, clock=clock)
    recognizer = Recognizer()
    shown = [walk[-1]]
    wrong, right, settled = [], 0, 0
    for _ in range(int(len(walk) * SHOWN_S * FPS)):
        truth = camera.truth(clock.now())
        if truth.sign != shown[-1]:
            shown.append(truth.sign)
        recognition = recognizer.step(camera.read().image, 1 / FPS)
        if recognition.sign in MOTION_SIGNS and recognition.sign not in shown[-2:]:
            wrong.append((round(clock.now(), 2), shown[-2:], recognition.sign))
        if truth.settled:
            settled += 1
            right += recognition.seen == truth.sign
        clock.advance(1 / FPS)
    assert wrong == []
    assert right >= 0.95 * settled
