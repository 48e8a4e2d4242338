from dataclasses import replace

import pytest

from handsteer.config import ControlConfig
from handsteer.nodes.status import ControlStatus, RecognitionStatus
from handsteer.plugins.page.first_visit import NOT_BEGUN, OFFERED_S, driven_s, refusal, steps_done
from handsteer.plugins.page.observed import Observed
from handsteer.plugins.page.state import compose
from handsteer.types import Velocity

IDLE = compose(Observed(), 0.0)
BY_SIGNS = ControlStatus(source="signs")
STOP = RecognitionStatus("Stop")


def test_a_step_is_ticked_by_what_happens_and_only_in_order() -> None:
    seen = replace(IDLE, seen="Forward")
    drives = replace(seen, control=BY_SIGNS, mood="driving", measured=Velocity(0.1, 0.0))
    stopping = replace(IDLE, recognition=STOP, measured=Velocity(0.1, 0.0))
    stands = replace(IDLE, recognition=STOP)
    assert [steps_done(0, state) for state in (IDLE, stands, seen)] == [0, 0, 1]
    assert [steps_done(1, state) for state in (seen, stands, drives)] == [1, 1, 2]
    assert [steps_done(2, state) for state in (drives, stopping, stands)] == [2, 2, 3]
    assert steps_done(3, stands) == 3


def test_what_the_demo_hand_has_just_shown_is_no_step() -> None:
    shown = replace(IDLE, seen="Forward")
    drives = replace(IDLE, seen="Go", control=BY_SIGNS, mood="driving")
    assert [steps_done(NOT_BEGUN, state) for state in (shown, drives, IDLE)] == [NOT_BEGUN, NOT_BEGUN, 0]


def test_what_was_steered_by_hand_is_not_a_step_by_signs() -> None:
    assert (
        steps_done(
            1, replace(IDLE, control=ControlStatus(source="steering"), mood="driving", measured=Velocity(0.1, 0.0))
        )
        == 1
    )


def test_a_minute_of_driving_by_the_tutorial_s_rule_counts_and_nothing_else() -> None:
    drives = replace(IDLE, control=BY_SIGNS, mood="driving", rule=ControlConfig())
    assert driven_s(0.0, drives, 0.5) == 0.5
    assert driven_s(0.0, drives, 500.0) == 1.0, "the page was asleep"
    assert driven_s(OFFERED_S, IDLE, 0.5) == OFFERED_S
    others = (
        replace(drives, mood="standing"),
        replace(drives, control=ControlStatus(source="steering")),
        replace(drives, rule=ControlConfig(rule="point")),
        replace(drives, rule=None),
    )
    assert [driven_s(3.0, state, 0.5) for state in others] == [3.0] * len(others)


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        ({"why": "NotAllowedError"}, "Allow it by the camera or lock symbol"),
        ({"why": "NotFoundError"}, "Plug one in"),
        ({"why": "insecure"}, "set up https"),
        ({"why": "OddError"}, "The browser gives no camera (OddError)"),
        ({"why": "x" * 1000}, "x" * 200 + ")"),
        ({"words": "only the driver can share a camera"}, "only the driver can share a camera"),
        ({"state": "on"}, ""),
        ({"why": 3, "words": ["a"]}, ""),
        (None, ""),
    ],
)
def test_a_refusal_says_what_to_do(sent: object, words: str) -> None:
    said = refusal(sent)
    assert words in said
    assert bool(words) == bool(said)
