import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control import TwistMux
from handsteer.control.sign_control import SignControl
from handsteer.types import (
    ACTIONS,
    FORWARD,
    GO,
    MOTION_SIGNS,
    NONE,
    SIGNS,
    STOP,
    TURN_LEFT,
    ZERO,
    Velocity,
    action_of,
    find_sign,
    motion_signs,
)
from tests.about import about

DT = 1 / 30


def config(**values: object) -> ControlConfig:
    return ControlConfig.model_validate(values)


def test_without_a_table_the_motion_signs_are_the_built_in_ones() -> None:
    assert motion_signs({}) == MOTION_SIGNS
    assert motion_signs({"Peace": "turbo", "Hi": "stop", FORWARD: "go"}) == MOTION_SIGNS - {FORWARD} | {"Peace"}


@pytest.mark.parametrize(
    ("name", "sign"),
    [
        ("turn_right", "Turn Right"),
        ("TurnRight", "Turn Right"),
        ("\uff33\uff54\uff4f\uff50", STOP),
        ("turn\u3000right", "Turn Right"),
        ("Caf\u00e9", "Cafe\u0301"),
        ("CAFE", None),
    ],
)
def test_a_name_means_a_sign_whatever_its_case_spaces_and_unicode_form(name: str, sign: str | None) -> None:
    assert find_sign(name, (*SIGNS, "Cafe\u0301")) == sign


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        ("forward", (0.06, 0.0)),
        ("backward", (0.04, 0.0)),
        ("turn_left", (0.05, 0.2)),
        ("turn_right", (0.05, 0.0)),
        ("stop", (0.0, 0.0)),
        ("go", (0.05, 0.1)),
        ("turbo", (0.1, 0.1)),
    ],
)
def test_a_taught_sign_does_what_the_table_says(action: str, expected: tuple[float, float]) -> None:
    control = SignControl(config(actions={"Hi": action}))
    for sign in [FORWARD] * 5 + [TURN_LEFT]:
        control.step(sign, DT)
    velocity = control.step("Hi", DT)
    assert velocity is not None
    assert (velocity.linear_mps, velocity.angular_radps) == pytest.approx(expected)


def test_a_built_in_sign_can_be_given_another_action() -> None:
    control = SignControl(config(actions={FORWARD: "backward"}))
    assert control.step(FORWARD, DT) == Velocity(-0.01, 0.0)


def test_turbo_lasts_as_long_as_it_is_shown() -> None:
    control = SignControl(config(actions={"Peace": "turbo"}))
    for _ in range(10):
        control.step(FORWARD, DT)
    boosted = [control.step("Peace", DT) for _ in range(50)]
    assert boosted == [Velocity(about(0.2), 0.0)] * 50
    assert control.step(GO, DT) == Velocity(about(0.1), 0.0)
    assert control.step(NONE, DT) == ZERO


def test_turbo_moves_no_robot_that_stands() -> None:
    control = SignControl(config(actions={"Peace": "turbo"}))
    assert [control.step("Peace", DT) for _ in range(5)] == [ZERO] * 5


@given(
    shown=st.lists(st.sampled_from([*SIGNS, NONE, "Peace", "Hi"]), max_size=150),
    actions=st.dictionaries(st.sampled_from(["Peace", "Hi", FORWARD, GO]), st.sampled_from(ACTIONS)),
)
def test_whatever_the_table_limits_hold_and_stop_stops(shown: list[str], actions: dict[str, str]) -> None:
    control = SignControl(config(actions=actions, max_linear=0.2, max_angular=0.5))
    for sign in shown:
        velocity = control.step(sign, DT)
        assert velocity is not None
        assert abs(velocity.linear_mps) <= 0.2
        assert abs(velocity.angular_radps) <= 0.5
        if sign in (STOP, NONE):
            assert velocity == ZERO
    assert action_of(STOP, config(actions=actions).actions) == "stop"


def test_the_reason_names_a_taught_sign_that_stops() -> None:
    driver = TwistMux(config(actions={"Hi": "stop"}))
    driver.step(DT, sign=FORWARD)
    driver.step(DT, sign="Hi")
    assert str(driver.reason) == "standing: the Hi sign is shown"


def test_names_of_signs_may_be_written_in_other_ways() -> None:
    assert action_of("Thumbs Up", {"thumbs_up": "turbo"}) == "turbo"
    assert "Thumbs Up" in motion_signs({"thumbs_up": "turbo"}, ["Thumbs Up", "Peace"])
    assert "Peace" not in motion_signs({"thumbs_up": "turbo"}, ["Thumbs Up", "Peace"])


def test_what_is_not_a_number_is_limited_to_zero() -> None:
    assert Velocity(math.nan, 0.5).clamped(1.0, 2.0) == Velocity(0.0, 0.5)
    assert Velocity(0.5, math.nan).clamped(1.0, 2.0) == Velocity(0.5, 0.0)
    assert Velocity(0.5, 0.5).clamped(math.nan, 2.0) == Velocity(0.0, 0.5)
    assert Velocity(math.inf, -math.inf).clamped(1.0, 2.0) == Velocity(1.0, -2.0)
