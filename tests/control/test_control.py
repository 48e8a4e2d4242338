import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control import Control, TwistMux
from handsteer.control.engagement import SteeredBy
from handsteer.control.explain import Reason
from handsteer.types import FORWARD, GO, NONE, STOP, ZERO, Stick, Velocity

DT = 1 / 30


def test_steering_takes_over_at_once_and_signs_are_kept_out() -> None:
    driver = TwistMux(ControlConfig())
    driver.step(DT, sign=FORWARD)
    assert driver.step(DT, steering=Velocity(0.4, 1.0)) == Velocity(0.4, 1.0)
    assert driver.source == "steering"
    assert driver.step(DT, sign=FORWARD) is None
    assert driver.velocity == Velocity(0.4, 1.0)


def test_when_steering_ends_one_zero_goes_out_and_signs_start_from_standing() -> None:
    driver = TwistMux(ControlConfig(steering_timeout=0.3))
    for _ in range(20):
        driver.step(DT, sign=FORWARD)
    driver.step(DT, steering=Velocity(0.4, 0.0))
    said = [driver.step(0.1) for _ in range(10)]
    assert [velocity for velocity in said if velocity is not None] == [ZERO]
    assert driver.source == "none"
    assert driver.step(DT, sign=FORWARD) == Velocity(0.01, 0.0)


@pytest.mark.parametrize("wanted", [Velocity(math.nan, 0.0), Velocity(0.0, math.inf), Velocity(-math.inf, math.nan)])
def test_steering_that_is_no_number_means_zero(wanted: Velocity) -> None:
    assert TwistMux(ControlConfig()).step(DT, steering=wanted) == ZERO


def test_steering_is_clamped() -> None:
    driver = TwistMux(ControlConfig(max_linear=0.5, max_angular=1.0))
    assert driver.step(DT, steering=Velocity(-9.0, 9.0)) == Velocity(-0.5, 1.0)


@pytest.mark.parametrize("dt_s", [math.nan, math.inf, -1.0])
def test_broken_time_stops_whoever_drives(dt_s: float) -> None:
    driver = TwistMux(ControlConfig())
    driver.step(DT, steering=Velocity(0.4, 0.0))
    assert driver.step(dt_s) == ZERO
    assert driver.step(dt_s) is None


def test_reasons_say_why_the_robot_stands() -> None:
    driver = TwistMux(ControlConfig())
    assert str(driver.reason) == "standing: no sign has come for 0.35 s"
    reasons = []
    for sign in (NONE, STOP, FORWARD):
        driver.step(DT, sign=sign)
        reasons.append(str(driver.reason))
    driver.step(DT, steering=Velocity(0.1, 0.0))
    reasons.append(str(driver.reason))
    assert reasons == [
        "standing: no sign is seen",
        "standing: the Stop sign is shown",
        "driving: Forward",
        "driving: steered directly",
    ]


RENEW = ControlConfig(renew_time=3.0)
JOYSTICK = RENEW.model_copy(update={"mode": "joystick"})


def drives_s(control: Control, limit_s: float = 10.0, dt_s: float = 0.1, **shown: Any) -> float:
    """Show the same until the robot stands; return for how long, in seconds, or 0 if it stood all the time."""
    control.step(0.0, **shown)
    for count in range(round(limit_s / dt_s)):
        control.step(dt_s, **shown)
        if control.mux.velocity.is_zero:
            return (count + 1) * dt_s if count else 0.0
    return math.inf


def show_for(control: Control, seconds: float, dt_s: float = 0.1, **shown: Any) -> None:
    for _ in range(round(seconds / dt_s)):
        control.step(dt_s, **shown)


@pytest.mark.parametrize("arming", [False, True])
def test_a_sign_that_does_not_change_has_to_be_shown_anew_after_neutral(arming: bool) -> None:
    control = Control(RENEW, arming=arming, renew=True)
    show_for(control, 1.5, sign=STOP)
    assert drives_s(control, sign=FORWARD) == pytest.approx(3.0)
    assert str(control.reason) == "ready: the same sign for 3 s: show Stop or lower your hand, then show it again"
    assert drives_s(control, sign=FORWARD) == 0.0, "it does not begin by itself"
    assert drives_s(control, sign="Turn Left") == 0.0, "another sign is not a release"
    show_for(control, 0.3, sign=NONE)
    assert drives_s(control, sign=FORWARD) == 0.0, "nor is a short loss"
    show_for(control, 0.6, sign=NONE)
    assert control.reason.code == "no_sign"
    assert drives_s(control, sign=FORWARD) == pytest.approx(3.0)


def test_a_sign_that_changes_now_and_then_drives_on() -> None:
    control = Control(RENEW, arming=False, renew=True)
    for _ in range(10):
        assert drives_s(control, 2.9, sign=FORWARD) == math.inf
        assert drives_s(control, 0.2, sign=GO) == math.inf


def test_a_sign_that_moves_nothing_needs_not_be_shown_anew() -> None:
    control = Control(RENEW, arming=False, renew=True)
    show_for(control, 10.0, sign=GO)
    assert drives_s(control, 2.0, sign=FORWARD) == math.inf


@pytest.mark.parametrize("config", [RENEW, JOYSTICK])
def test_without_renewing_what_is_shown_drives_on(config: ControlConfig) -> None:
    control = Control(config, arming=False)
    control.step(0.1, stick=Stick())
    assert drives_s(control, sign=FORWARD, stick=Stick(True, 0.5)) == math.inf


def test_a_stick_that_does_not_move_has_to_be_released() -> None:
    control = Control(JOYSTICK, arming=False, renew=True)
    control.step(0.1, stick=Stick())
    assert drives_s(control, stick=Stick(True, 0.5, 0.1)) == pytest.approx(3.0)
    assert str(control.reason) == "standing: the stick has not moved for 3 s: release it first"
    assert drives_s(control, stick=Stick(True, -1.0)) == 0.0, "a movement is not a release"
    control.step(0.1, stick=Stick())
    assert control.reason.code == "not_held"
    assert drives_s(control, stick=Stick(True, 0.5, 0.1)) == pytest.approx(3.0)


def test_a_fist_that_keeps_the_speed_of_pointing_has_to_be_released() -> None:
    control = Control(RENEW.model_copy(update={"rule": "point"}), arming=False, renew=True)
    show_for(control, 1.0, sign=NONE, stick=Stick())
    show_for(control, 2.0, sign=FORWARD, stick=Stick(True, 1.0))
    assert drives_s(control, sign=GO, stick=Stick(True)) == pytest.approx(3.0)
    assert drives_s(control, sign=FORWARD, stick=Stick(True, 1.0)) == 0.0, "a movement is not a release"
    show_for(control, 1.0, sign=NONE, stick=Stick())
    show_for(control, 1.0, sign=FORWARD, stick=Stick(True, 1.0))
    assert control.mux.velocity.linear_mps > 0


@pytest.mark.parametrize(("tremor", "expected_s"), [(0.02, 3.0), (0.06, math.inf)])
def test_a_stick_that_trembles_has_not_moved(tremor: float, expected_s: float) -> None:
    control = Control(JOYSTICK, arming=False, renew=True)
    control.step(0.1, stick=Stick())
    driven_s = 0.0
    for count in range(100):
        control.step(0.1, stick=Stick(True, 0.5 + tremor * (count % 2), 0.0))
        driven_s += 0.0 if control.mux.velocity.is_zero else 0.1
    assert driven_s == pytest.approx(10.0 if expected_s == math.inf else expected_s)


@pytest.mark.parametrize("by", ["steering", "gamepad"])
def test_steering_that_does_not_change_has_to_be_released(by: SteeredBy) -> None:
    control = Control(RENEW, arming=False, renew=True)
    control.step(0.1, steering=ZERO, by=by)
    assert drives_s(control, steering=Velocity(0.3, 0.1), by=by) == pytest.approx(3.0)
    assert control.reason == Reason("renew_stick", "3")
    assert drives_s(control, steering=Velocity(-0.3, 0.1), by=by) == 0.0
    control.step(0.1, steering=ZERO, by=by)
    assert control.reason == Reason("steered_at_zero")
    assert drives_s(control, steering=Velocity(0.3, 0.1), by=by) == pytest.approx(3.0)


def test_a_gamepad_at_rest_is_released() -> None:
    control = Control(RENEW, arming=False, renew=True)
    control.step(0.1, steering=ZERO, by="gamepad")
    drives_s(control, steering=Velocity(0.3, 0.1), by="gamepad")
    control.safety.note_rest("gamepad")
    assert drives_s(control, steering=Velocity(0.3, 0.1), by="gamepad") > 0.0


def test_what_is_left_until_it_has_to_be_shown_anew_is_known() -> None:
    control = Control(RENEW, arming=False, renew=True)
    assert control.renew_left_s == math.inf, "nothing moves"
    show_for(control, 1.0, sign=FORWARD)
    assert control.renew_left_s == pytest.approx(2.1), "it counts from its first frame"
    control.reconfigure(RENEW.model_copy(update={"renew_time": 1.5}))
    assert control.renew_left_s == pytest.approx(0.6)
    control.step(0.0, sign=GO)
    assert control.renew_left_s == pytest.approx(1.5)


@given(
    st.lists(
        st.tuples(
            st.floats(0, 0.3),
            st.one_of(st.none(), st.sampled_from([FORWARD, STOP, NONE])),
            st.one_of(st.none(), st.builds(Velocity, st.floats(), st.floats())),
        ),
        max_size=100,
    )
)
def test_whatever_comes_the_command_is_finite_and_within_limits(
    inputs: list[tuple[float, str | None, Velocity | None]],
) -> None:
    config = ControlConfig()
    driver = TwistMux(config)
    for dt_s, sign, steering in inputs:
        velocity = driver.step(dt_s, sign=sign, steering=steering)
        if velocity is not None:
            assert velocity.is_finite
            assert abs(velocity.linear_mps) <= config.max_linear
            assert abs(velocity.angular_radps) <= config.max_angular


def test_a_lower_limit_is_commanded_at_once() -> None:
    driver = TwistMux(ControlConfig(linear_step=0.5))
    driver.step(DT, sign=FORWARD)
    assert driver.reconfigure(ControlConfig(max_linear=0.2)) == Velocity(0.2, 0.0)
    assert driver.step(DT, sign=GO) == Velocity(0.2, 0.0)


def test_a_higher_limit_says_nothing_and_speeds_up_nothing() -> None:
    driver = TwistMux(ControlConfig(linear_step=0.5, max_linear=0.2))
    driver.step(DT, sign=FORWARD)
    assert driver.reconfigure(ControlConfig(max_linear=10.0)) is None
    assert driver.step(DT, sign=GO) == Velocity(0.2, 0.0)


def test_a_limit_that_is_lowered_and_raised_again_makes_nothing_faster() -> None:
    """The guard: ``clamped`` in ``SignControl.reconfigure``."""
    driver = TwistMux(ControlConfig(linear_step=0.5))
    driver.step(DT, sign=FORWARD)
    driver.reconfigure(ControlConfig(max_linear=0.2))
    assert driver.reconfigure(ControlConfig(max_linear=10.0)) is None
    assert driver.step(DT, sign=GO) == Velocity(0.2, 0.0)


def test_steering_is_clamped_by_a_lower_limit_at_once() -> None:
    driver = TwistMux(ControlConfig())
    driver.step(DT, steering=Velocity(-0.8, 1.0))
    assert driver.reconfigure(ControlConfig(max_linear=0.1, max_angular=0.5)) == Velocity(-0.1, 0.5)
    assert driver.source == "steering"


SIGNS = st.sampled_from([FORWARD, "Backward", "Turn Left", "Turn Right", GO, "Peace", STOP, NONE, None])
SPEEDS = st.floats(0.01, 3.0)


@given(
    before=st.lists(SIGNS, max_size=20),
    steering=st.none() | st.builds(Velocity, st.floats(-5, 5), st.floats(-5, 5)),
    limits=st.tuples(SPEEDS, SPEEDS),
    ramp=st.sampled_from(["per_message", "per_second"]),
    action=st.sampled_from(["turbo", "stop", "forward"]),
)
def test_no_configuration_sets_a_robot_in_motion_or_makes_it_faster(
    before: list[str | None], steering: Velocity | None, limits: tuple[float, float], ramp: str, action: str
) -> None:
    driver = TwistMux(ControlConfig(linear_step=0.4, angular_step=0.4, actions={"Peace": "turbo"}))
    for sign in before:
        driver.step(DT, sign=sign)
    if steering is not None:
        driver.step(DT, steering=steering)
    was, source = driver.velocity, driver.source
    config = ControlConfig.model_validate(
        {"max_linear": limits[0], "max_angular": limits[1], "ramp": ramp, "actions": {"Peace": action}}
    )
    said = driver.reconfigure(config)
    now = driver.velocity
    assert abs(now.linear_mps) <= min(abs(was.linear_mps), limits[0])
    assert abs(now.angular_radps) <= min(abs(was.angular_radps), limits[1])
    assert now.linear_mps * was.linear_mps >= 0
    assert now.angular_radps * was.angular_radps >= 0
    assert said == (now if now != was else None)
    assert driver.source == source
    assert driver.step(0.0) is None


def drives(control: Control) -> Velocity:
    for _ in range(40):
        control.step(DT, sign="Stop")
    velocity = control.step(DT, sign="Forward")
    assert velocity is not None
    return velocity


SLOW = ControlConfig(
    max_linear=0.2,
    max_angular=0.4,
    max_linear_acceleration=0.1,
    max_angular_acceleration=0.4,
    max_linear_jerk=0.5,
    max_angular_jerk=0.5,
)


@pytest.mark.parametrize(
    "change",
    [
        {"max_linear": 1.0},
        {"max_angular": 1.0},
        {"linear_step": 0.5},
        {"angular_step": 0.5},
        {"max_sign_rate": 90.0},
        {"ramp": "per_second"},
        {"max_linear_acceleration": 0.0},
        {"max_angular_acceleration": 0.5},
        {"max_linear_jerk": 0.0},
        {"max_angular_jerk": 0.6},
    ],
    ids=str,
)
def test_what_a_sign_drives_is_made_faster_by_no_change(change: dict[str, Any]) -> None:
    control = Control(SLOW, arming=False)
    for sign in [FORWARD] * 10 + ["Turn Left"] * 10:
        control.step(DT, sign=sign)
    assert control.reconfigure(SLOW.model_copy(update=change)) == ZERO
    assert [control.step(DT, sign=FORWARD) for _ in range(60)] == [ZERO] * 60
    assert control.safety.signs_wait == "its limits have changed"
    assert drives(control).linear_mps > 0


@pytest.mark.parametrize(
    "change",
    [{"max_linear": 0.1}, {"max_linear_acceleration": 0.05}, {"linear_step": 0.005}, {"point_turn": 9.0}, {}],
    ids=str,
)
def test_what_makes_nothing_faster_leaves_a_sign_driving(change: dict[str, Any]) -> None:
    control = Control(SLOW, arming=False)
    for _ in range(20):
        control.step(DT, sign=FORWARD)
    control.reconfigure(SLOW.model_copy(update=change))
    velocity = control.step(DT, sign=FORWARD)
    assert velocity is not None
    assert velocity.linear_mps > 0


@pytest.mark.parametrize("change", [{"linear_acceleration": 5.0}, {"angular_acceleration": 5.0}], ids=str)
def test_what_a_sign_drives_by_time_is_made_faster_by_no_change(change: dict[str, Any]) -> None:
    by_time = SLOW.model_copy(update={"ramp": "per_second"})
    control = Control(by_time, arming=False)
    for _ in range(20):
        control.step(DT, sign=FORWARD)
    assert control.reconfigure(by_time.model_copy(update=change)) == ZERO


def test_what_does_not_concern_what_drives_leaves_it_driving() -> None:
    by_time = SLOW.model_copy(update={"ramp": "per_second"})
    control = Control(by_time, arming=False)
    for _ in range(20):
        control.step(DT, sign=FORWARD)
    assert control.reconfigure(by_time.model_copy(update={"linear_step": 0.5, "point_turn": 9.0})) is None
    points = ControlConfig(rule="point")
    control = Control(points, arming=False)
    for forward in (0.0, 0.2, 0.2):
        control.step(DT, steering=Velocity(forward, 0.0))
    assert control.reconfigure(points.model_copy(update={"point_turn": 9.0, "linear_step": 0.5})) is None


@pytest.mark.parametrize("change", [{"max_linear_acceleration": 0.0}, {"max_angular_jerk": 0.0}], ids=str)
def test_what_is_held_is_made_faster_by_no_limit_of_the_ramp(change: dict[str, Any]) -> None:
    control = Control(SLOW, arming=False)
    control.step(DT, steering=ZERO)
    for _ in range(10):
        control.step(DT, steering=Velocity(0.2, 0.4))
    assert control.reconfigure(SLOW.model_copy(update=change)) == ZERO
    assert control.step(DT, steering=Velocity(0.2, 0.4)) == ZERO


@pytest.mark.parametrize("sign", [GO, "Turn Left"])
def test_a_speed_that_is_kept_is_the_one_that_was_reached(sign: str) -> None:
    """With a limit of the acceleration, the steps of signs do not wind up: a guard of ``Control._ramped``."""
    control = Control(ControlConfig(max_linear_acceleration=0.05), arming=False)
    reached = [control.step(DT, sign=FORWARD) for _ in range(90)][-1]
    kept = [control.step(DT, sign=sign) for _ in range(90)][-1]
    assert reached is not None
    assert kept is not None
    assert reached.linear_mps == pytest.approx(0.05 * 90 * DT, rel=0.1)
    assert kept.linear_mps == pytest.approx(reached.linear_mps)


@pytest.mark.parametrize("dt_s", [-0.1, math.nan, math.inf])
def test_a_time_that_cannot_be_stops_it_until_neutral_was_seen(dt_s: float) -> None:
    control = Control(ControlConfig(), arming=True)
    assert drives(control).linear_mps > 0
    assert control.step(dt_s, sign="Forward") == ZERO
    assert control.step(DT, sign="Forward") == ZERO
    assert drives(control).linear_mps > 0


def test_a_hand_that_is_disengaged_between_two_frames_stops_at_once() -> None:
    """The guard: ``engaged`` in ``Control.step``."""
    control = Control(ControlConfig(), arming=False, engage=True)
    control.safety.engagement.engaged = True
    velocity = control.step(DT, sign=FORWARD)
    assert velocity is not None
    assert velocity.linear_mps > 0
    control.safety.fault("a fault")
    assert control.step(DT) == ZERO


def test_when_steering_is_ended_signs_start_from_standing() -> None:
    """The guard: the signs are halted in ``TwistMux.halt``."""
    driver = TwistMux(ControlConfig())
    for _ in range(20):
        driver.step(DT, sign=FORWARD)
    driver.halt()
    assert driver.step(DT, sign=FORWARD) == Velocity(0.01, 0.0)


def test_go_on_a_robot_that_stands_says_that_it_keeps_a_speed_of_zero() -> None:
    driver = TwistMux(ControlConfig())
    driver.step(0.03, sign="Go")
    assert str(driver.reason) == "standing: Go keeps its speed, which is zero"
    driver.step(0.03, sign="Forward")
    driver.step(0.03, sign="Backward")
    assert str(driver.reason) == "standing: no sign has set it in motion yet"
