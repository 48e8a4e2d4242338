import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import Config, ControlConfig
from handsteer.control.effects import effect_of, rule_from_diagnostics, rule_to_diagnostics
from handsteer.dashboard.drive_page import legend
from handsteer.dashboard.state import known_signs
from handsteer.types import ACTIONS, SIGNS, action_of


def effects(signs: tuple[str, ...], rule: ControlConfig | None) -> dict[str, tuple[str, str]]:
    return {entry.sign: (entry.effect, entry.figures) for entry in legend(signs, rule)}


def test_shipped_signs_come_first_and_say_their_steps_and_limits() -> None:
    entries = legend(("Peace", *SIGNS), ControlConfig(max_linear=0.5))
    assert [entry.sign for entry in entries] == [
        "Forward",
        "Backward",
        "Stop",
        "Turn Left",
        "Turn Right",
        "Go",
        "Peace",
    ]
    assert (entries[0].effect, entries[0].figures) == ("faster forward", "0.01 m/s a frame, up to 0.5 m/s")
    assert (entries[3].effect, entries[3].figures) == ("turns faster to the left", "0.1 rad/s a frame, up to 2 rad/s")
    assert (entries[-1].pose, entries[-1].effect) == ("taught", "goes on as it does")
    assert all(entry.drawing.startswith("<svg") and entry.pose for entry in entries)


def test_remapped_signs_say_what_they_really_do() -> None:
    rule = ControlConfig(actions={"forward": "stop", "Peace": "turbo"}, ramp="per_second")
    said = effects((*SIGNS, "Peace"), rule)
    assert said["Forward"] == ("stops", "")
    assert said["Peace"] == ("twice as fast while shown, within the limits", "up to 1 m/s")
    assert said["Backward"] == ("slower, then backward", "0.3 m/s a second, up to 1 m/s")


def test_says_what_is_built_in_while_nothing_is_known() -> None:
    assert effects(SIGNS, None)["Turn Right"] == ("turns faster to the right", "")


@given(
    st.builds(
        ControlConfig,
        ramp=st.sampled_from(["per_message", "per_second"]),
        max_linear=st.floats(0.1, 10),
        actions=st.dictionaries(st.sampled_from(["Peace", "Hi", "Go"]), st.sampled_from(ACTIONS)),
    )
)
def test_what_a_report_tells_is_what_decides(rule: ControlConfig) -> None:
    heard = rule_from_diagnostics(rule_to_diagnostics(rule))
    assert heard is not None
    for sign in (*SIGNS, "Peace", "Hi"):
        assert action_of(sign, heard.actions) == action_of(sign, rule.actions)
    assert all(effect_of(action, heard) == effect_of(action, rule) for action in ACTIONS)


@pytest.mark.parametrize("wrong", [{}, {"actions": "{"}, {"max_linear": "-1"}, {"actions": '{"Stop": "go"}'}])
def test_a_report_that_does_not_hold_tells_nothing(wrong: dict[str, str]) -> None:
    assert rule_from_diagnostics({**rule_to_diagnostics(Config().control), **wrong} if wrong else {}) is None


@pytest.mark.parametrize(
    ("said", "signs"),
    [
        (json.dumps(["Stop", "Peace"]), ("Stop", "Peace")),
        ("[]", SIGNS),
        ("Stop", SIGNS),
        ("7", SIGNS),
        (None, SIGNS),
    ],
)
def test_the_recogniser_says_which_signs_it_can_tell(said: str | None, signs: tuple[str, ...]) -> None:
    assert known_signs({} if said is None else {"signs": said}) == signs
