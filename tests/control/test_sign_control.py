import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control.sign_control import SignControl
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT, ZERO, Velocity

DT = 1 / 30
signs = st.sampled_from([*SIGNS, NONE, "a word nobody knows", ""])
steps = st.lists(st.tuples(st.one_of(st.none(), signs), st.floats(0, 0.2)), max_size=200)


def drive(control: SignControl, *shown: str) -> list[Velocity | None]:
    return [control.step(sign, DT) for sign in shown]


def test_tutorial_rule_to_the_letter() -> None:
    control = SignControl(ControlConfig())
    velocities = drive(control, *[FORWARD] * 5, TURN_LEFT, TURN_LEFT, GO, "Dance", TURN_RIGHT, BACKWARD, STOP, NONE)
    expected = [
        *[(0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.04, 0.0), (0.05, 0.0)],
        *[(0.05, 0.1), (0.05, 0.2), (0.05, 0.2), (0.05, 0.2), (0.05, 0.1)],
        *[(0.04, 0.0), (0.0, 0.0), (0.0, 0.0)],
    ]
    assert [(v.linear_mps, v.angular_radps) for v in velocities if v] == [pytest.approx(e) for e in expected]


def test_growth_per_second_does_not_depend_on_the_frame_rate() -> None:
    speeds = []
    for fps in (10, 30, 100):
        control = SignControl(ControlConfig(ramp="per_second"))
        velocity = None
        for _ in range(2 * fps + 1):
            velocity = control.step(FORWARD, 1 / fps)
        assert velocity is not None
        speeds.append(velocity.linear_mps)
    assert speeds == [pytest.approx(0.6)] * 3


def test_first_sign_after_a_silence_makes_no_leap() -> None:
    control = SignControl(ControlConfig(ramp="per_second"))
    control.step(None, 100.0)
    assert control.step(FORWARD, 0.4) == ZERO


def test_limit_clamps_without_wind_up() -> None:
    control = SignControl(ControlConfig(max_linear=0.1))
    drive(control, *[FORWARD] * 100)
    assert control.velocity.linear_mps == 0.1
    control.step(BACKWARD, DT)
    assert control.velocity.linear_mps == pytest.approx(0.09)


def test_one_zero_after_the_timeout_then_silence_until_a_sign_comes() -> None:
    control = SignControl(ControlConfig(sign_timeout=0.5))
    drive(control, FORWARD, FORWARD)
    said = [control.step(None, 0.05) for _ in range(40)]
    assert [velocity for velocity in said if velocity is not None] == [ZERO]
    assert said[:9] == [None] * 9
    assert control.step(FORWARD, DT) == Velocity(0.01, 0.0)


@pytest.mark.parametrize("dt_s", [math.nan, math.inf, -math.inf, -1.0])
def test_broken_time_stops_once(dt_s: float) -> None:
    control = SignControl(ControlConfig())
    drive(control, *[FORWARD] * 10)
    assert control.step(FORWARD, dt_s) == ZERO
    assert control.step(None, dt_s) is None
    assert control.step(FORWARD, DT) == Velocity(0.01, 0.0)


@given(steps=steps, ramp=st.sampled_from(["per_message", "per_second"]))
def test_never_beyond_the_limits_and_one_velocity_a_sign(steps: list[tuple[str | None, float]], ramp: str) -> None:
    config = ControlConfig.model_validate({"ramp": ramp, "max_linear": 0.2, "max_angular": 0.5})
    control = SignControl(config)
    for sign, dt_s in steps:
        velocity = control.step(sign, dt_s)
        assert sign is None or velocity is not None
        if velocity is not None:
            assert abs(velocity.linear_mps) <= 0.2
            assert abs(velocity.angular_radps) <= 0.5


@given(steps=steps)
def test_left_and_right_mirror_each_other(steps: list[tuple[str | None, float]]) -> None:
    swap = {TURN_LEFT: TURN_RIGHT, TURN_RIGHT: TURN_LEFT}
    one, other = SignControl(ControlConfig()), SignControl(ControlConfig())
    for sign, dt_s in steps:
        a, b = one.step(sign, dt_s), other.step(swap.get(sign or "", sign), dt_s)
        assert (a is None) == (b is None)
        if a and b:
            assert (a.linear_mps, a.angular_radps) == (b.linear_mps, -b.angular_radps)


def test_steps_add_up_to_round_numbers() -> None:
    control = SignControl(ControlConfig())
    speeds = [velocity.linear_mps for _ in range(40) if (velocity := control.step(FORWARD, 0.03))]
    assert speeds == [round(0.01 * step, 2) for step in range(1, 41)]


def test_extra_messages_do_not_make_it_faster() -> None:
    """The guard: ``Allowance.take``."""
    control = SignControl(ControlConfig(max_linear=10.0))
    for _ in range(1000):
        control.step(FORWARD, 1 / 1000)
    assert control.velocity.linear_mps <= 0.01 * (60 + 15 + 1)


def test_turbo_keeps_to_the_limit() -> None:
    """The guard: ``clamped`` in ``_boosted``."""
    control = SignControl(ControlConfig(max_linear=0.3, linear_step=0.2, actions={"Peace": "turbo"}))
    assert drive(control, FORWARD, "Peace") == [Velocity(0.2, 0.0), Velocity(0.3, 0.0)]
