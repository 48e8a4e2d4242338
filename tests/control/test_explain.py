import math
from typing import get_args

import pytest

from handsteer.control.explain import Reason, ReasonCode, seconds_to_renew, warned


@pytest.mark.parametrize(
    ("reason", "sentence"),
    [
        (Reason("sign", "Go"), "driving: Go"),
        (Reason("sign", "Go", slowed="obstacle 0.42 m ahead"), "driving: Go, slowed: obstacle 0.42 m ahead"),
        (Reason("obstacle", "obstacle 0.14 m ahead"), "standing: stopped before an obstacle 0.14 m ahead"),
        (Reason("disarmed"), "ready: show Stop or lower your hand to begin"),
        (Reason("disarmed", "no sign came"), "ready: show Stop or lower your hand to begin (no sign came)"),
        (
            Reason("disarmed", "it was selected", "r2"),
            "ready: show Stop or lower your hand to begin with r2 (it was selected)",
        ),
        (Reason("renew_stick", "20"), "standing: the stick has not moved for 20 s: release it first"),
        (Reason("stop_sign", "{0}"), "standing: the {0} sign is shown"),
    ],
)
def test_a_reason_is_a_sentence(reason: Reason, sentence: str) -> None:
    assert str(reason) == sentence
    assert sentence.endswith(reason.explanation)


@pytest.mark.parametrize("code", get_args(ReasonCode))
def test_every_reason_has_words(code: ReasonCode) -> None:
    assert Reason(code, "a detail").explanation


@pytest.mark.parametrize(
    ("left_s", "warning"), [(math.inf, ""), (5.1, ""), (4.2, "; stops in 5 s unless it changes"), (0.0, "")]
)
def test_the_driver_is_warned_before_a_sign_has_to_be_shown_anew(left_s: float, warning: str) -> None:
    assert warned("Forward", seconds_to_renew(left_s)) == f"Forward{warning}"
