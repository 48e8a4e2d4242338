"""Driving where the hand points: velocities, and the guards of the control around them."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control import Control, TwistMux
from handsteer.control.pointing import IN_A_CURVE, pointed
from handsteer.types import FORWARD, GO, NONE, RELEASED, STOP, ZERO, Stick, Velocity

DT_S = 1 / 30
CONFIG = ControlConfig(rule="point")
AHEAD = Stick(held=True, forward=1.0)


class PointControl:
    """Keeps the last velocity, as the twist mux does."""

    def __init__(self, config: ControlConfig) -> None:
        self._config, self.velocity = config, ZERO

    def step(self, stick: Stick, dt_s: float) -> Velocity:
        self.velocity = pointed(stick, self.velocity, self._config, dt_s)
        return self.velocity


def driven(control: PointControl, stick: Stick, seconds: float = 2.0) -> Velocity:
    for _ in range(round(seconds / DT_S)):
        control.step(stick, DT_S)
    return control.velocity


def test_the_speed_grows_in_the_configured_time_at_any_frame_rate() -> None:
    for fps in (10, 15, 30, 60):
        control = PointControl(CONFIG)
        speeds = [control.step(AHEAD, 1 / fps).linear_mps for _ in range(round(2 * CONFIG.point_time * fps))]
        half, full = round(CONFIG.point_time * fps / 2), math.ceil(CONFIG.point_time * fps)
        assert speeds[half - 1] == pytest.approx(0.5 * CONFIG.max_linear, abs=0.1)
        assert speeds[full - 1] == pytest.approx(CONFIG.max_linear)


def test_it_slows_down_at_once() -> None:
    control = PointControl(CONFIG)
    driven(control, AHEAD)
    assert control.step(Stick(held=True, forward=0.3), DT_S).linear_mps == pytest.approx(0.3)
    assert control.step(RELEASED, DT_S) == ZERO


def test_a_tilt_drives_the_same_arc_while_the_speed_grows() -> None:
    control, radii = PointControl(CONFIG), []
    for _ in range(40):
        velocity = control.step(Stick(held=True, forward=1.0, left=0.5), DT_S)
        radii.append(velocity.linear_mps / velocity.angular_radps)
    assert radii == pytest.approx([radii[0]] * len(radii))
    assert velocity.angular_radps == pytest.approx(0.5 * CONFIG.point_turn)
    assert velocity.linear_mps == pytest.approx(CONFIG.max_linear * (1 - IN_A_CURVE * 0.5))


def test_backward_and_tilted() -> None:
    velocity = driven(PointControl(CONFIG), Stick(held=True, forward=-1.0, left=-0.5))
    assert velocity.linear_mps < 0
    assert velocity.angular_radps < 0


def test_the_middle_keeps_the_speed_and_goes_straight() -> None:
    control = PointControl(CONFIG)
    before = driven(control, Stick(held=True, forward=1.0, left=0.5))
    assert control.step(Stick(held=True), DT_S) == Velocity(before.linear_mps, 0.0)
    assert PointControl(CONFIG).step(Stick(held=True), DT_S) == ZERO


def test_thumbs_turn_in_place() -> None:
    control = PointControl(CONFIG)
    driven(control, AHEAD)
    assert driven(control, Stick(held=True, left=1.0)) == Velocity(0.0, CONFIG.point_turn)


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_stick_that_is_not_finite_is_zero_and_leaves_no_trace(wrong: float) -> None:
    control = PointControl(CONFIG)
    driven(control, AHEAD)
    assert control.step(Stick(held=True, forward=wrong), DT_S) == ZERO
    assert control.step(Stick(held=True, forward=1.0, left=wrong), DT_S) == ZERO
    assert control.step(Stick(held=True), DT_S) == ZERO


@given(st.lists(st.tuples(st.booleans(), st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 0.5)), max_size=40))
def test_whatever_comes_it_stays_within_the_limits_and_stands_when_released(
    states: list[tuple[bool, float, float, float]],
) -> None:
    config = CONFIG.model_copy(update={"max_linear": 0.4, "max_angular": 0.7})
    control = PointControl(config)
    for held, forward, left, dt_s in states:
        velocity = control.step(Stick(held, forward, left) if held else RELEASED, dt_s)
        assert velocity.is_finite
        assert velocity == velocity.clamped(0.4, 0.7)
        assert held or velocity == ZERO


def shown(control: Control, sign: str, stick: Stick, seconds: float = 0.5) -> Velocity:
    """Show both for a while, as recognition publishes them, and return the velocity."""
    for _ in range(round(seconds / DT_S)):
        control.step(DT_S, sign=sign)
        control.step(0.0, stick=stick)
    return control.mux.velocity


@pytest.fixture
def control() -> Control:
    control = Control(CONFIG, arming=False)
    shown(control, NONE, RELEASED)
    return control


def test_a_finger_drives_and_a_palm_stops_at_once(control: Control) -> None:
    assert shown(control, FORWARD, AHEAD, 1.0) == Velocity(CONFIG.max_linear, 0.0)
    assert str(control.reason) == "driving: driven where the hand points"
    control.step(DT_S, sign=STOP)
    assert control.mux.velocity == ZERO, "before the stick of that frame has come"
    assert str(control.reason) == "standing: the Stop sign is shown"
    shown(control, NONE, RELEASED)
    assert str(control.reason) == "standing: no sign is seen"


def test_a_stick_beside_a_sign_that_stops_moves_nothing(control: Control) -> None:
    assert shown(control, STOP, AHEAD, 1.0) == ZERO
    assert shown(control, NONE, AHEAD, 1.0) == ZERO


def test_a_sign_whose_action_is_stop_does_not_drive() -> None:
    control = Control(CONFIG.model_copy(update={"actions": {"Forward": "stop"}}), arming=False)
    shown(control, NONE, RELEASED)
    assert shown(control, FORWARD, AHEAD) == ZERO


def test_a_hand_that_points_at_the_start_moves_nothing() -> None:
    control = Control(CONFIG, arming=False)
    assert shown(control, FORWARD, AHEAD) == ZERO, "it was not released yet"
    shown(control, STOP, RELEASED)
    assert shown(control, FORWARD, AHEAD).linear_mps > 0


def alone(control: Control, stick: Stick, seconds: float) -> Velocity:
    """Show ``stick`` for a while without signs, as where their connection stalls, and return the velocity."""
    for _ in range(round(seconds / DT_S)):
        control.step(DT_S, stick=stick)
    return control.mux.velocity


@pytest.mark.parametrize("arming", [False, True])
@pytest.mark.parametrize("engage", [False, True])
@pytest.mark.parametrize("silent_s", [0.4, 5.0])
def test_where_signs_fall_silent_it_stops_and_has_to_be_released(arming: bool, engage: bool, silent_s: float) -> None:
    control = Control(CONFIG.model_copy(update={"engage_by": "hold"}), arming=arming, engage=engage)
    shown(control, STOP, RELEASED, 2.0)
    assert shown(control, FORWARD, AHEAD).linear_mps > 0
    assert alone(control, AHEAD, silent_s) == ZERO
    assert control.reason.code == "no_input"
    assert control.safety.engagement.engaged is not engage
    assert shown(control, FORWARD, AHEAD, 2.0) == ZERO
    shown(control, STOP, RELEASED, 2.0)
    assert shown(control, FORWARD, AHEAD).linear_mps > 0


@pytest.mark.parametrize("arming", [False, True])
def test_before_the_first_sign_nothing_counts_as_a_release(arming: bool) -> None:
    control = Control(CONFIG, arming=arming)
    for stick in (AHEAD, RELEASED, AHEAD):
        assert alone(control, stick, 2.0) == ZERO
    assert shown(control, FORWARD, AHEAD, 2.0) == ZERO


def test_a_stop_that_was_reset_without_signs_needs_a_release(control: Control) -> None:
    shown(control, FORWARD, AHEAD)
    control.stop()
    alone(control, AHEAD, 1.0)
    control.reset()
    alone(control, AHEAD, 1.0)
    assert shown(control, FORWARD, AHEAD, 2.0) == ZERO


def test_a_silence_of_both_is_no_release_whichever_comes_first(control: Control) -> None:
    for first in ({"stick": AHEAD}, {"sign": FORWARD}):
        shown(control, STOP, RELEASED)
        assert shown(control, FORWARD, AHEAD).linear_mps > 0
        for _ in range(30):
            control.step(DT_S)
        control.step(DT_S, **first)
        assert shown(control, FORWARD, AHEAD, 2.0) == ZERO


def test_signs_alone_do_not_drive(control: Control) -> None:
    for _ in range(30):
        control.step(DT_S, sign=FORWARD)
    assert control.mux.velocity == ZERO


def test_without_messages_it_stops_after_the_timeout_and_begins_at_zero(control: Control) -> None:
    shown(control, FORWARD, AHEAD, 1.0)
    control.step(CONFIG.sign_timeout + 0.01)
    assert control.mux.velocity == ZERO
    control.step(0.0, sign=GO)
    control.step(0.0, stick=Stick(held=True))
    assert control.mux.velocity == ZERO, "the speed is not kept over a gap"


def test_the_time_before_it_points_does_not_count() -> None:
    mux = TwistMux(CONFIG)
    for dt_s in (0.0, 0.1, 0.1):
        mux.step(dt_s, stick=AHEAD)
    assert mux.velocity.linear_mps > 0
    mux.step(CONFIG.sign_timeout)
    mux.step(0.0, stick=AHEAD)
    assert mux.velocity == ZERO
    mux.step(0.1, stick=AHEAD)
    assert mux.velocity.linear_mps == pytest.approx(0.1 * CONFIG.max_linear / CONFIG.point_time)


def test_steering_takes_over_and_its_speed_is_not_kept(control: Control) -> None:
    shown(control, FORWARD, AHEAD, 1.0)
    for velocity in (ZERO, Velocity(0.2, 0.0)):
        control.step(DT_S, steering=velocity)
    assert control.mux.velocity == Velocity(0.2, 0.0)
    control.step(CONFIG.steering_timeout)
    assert shown(control, GO, Stick(held=True)) == ZERO


def test_a_slower_command_is_continued_from(control: Control) -> None:
    """The collision monitor commands less; the speed grows from there, not from what was wanted."""
    shown(control, FORWARD, AHEAD, 1.0)
    control.mux.hold_back(Velocity(0.1, 0.0))
    control.step(DT_S, sign=FORWARD)
    control.step(0.0, stick=AHEAD)
    assert control.mux.velocity.linear_mps < 0.2


def test_after_20_s_without_any_change_it_has_to_be_shown_anew() -> None:
    control = Control(CONFIG.model_copy(update={"renew_time": 2.0}), arming=False, renew=True)
    shown(control, NONE, RELEASED)
    assert shown(control, FORWARD, AHEAD, 1.9).linear_mps > 0
    assert shown(control, FORWARD, AHEAD, 0.3) == ZERO
    assert shown(control, FORWARD, AHEAD, 1.0) == ZERO
    alone(control, AHEAD, 0.5)
    assert shown(control, FORWARD, AHEAD, 1.0) == ZERO, "a pause of the signs is no release"
    shown(control, STOP, RELEASED)
    assert shown(control, FORWARD, AHEAD).linear_mps > 0


@pytest.mark.parametrize("change", [{"max_linear": 0.2}, {"max_linear": 9.0}, {"point_turn": 9.0}, {"point_time": 0.1}])
def test_a_change_that_would_make_it_turn_or_drive_faster_stops(control: Control, change: dict[str, Any]) -> None:
    """A lower limit of speed, too: the turn is in proportion to the share of it that has been reached."""
    shown(control, FORWARD, AHEAD, 0.3)
    assert control.reconfigure(CONFIG.model_copy(update=change)) == ZERO
    assert shown(control, FORWARD, AHEAD) == ZERO


@pytest.mark.parametrize("change", [{"rule": "course"}, {"mode": "joystick"}])
def test_another_rule_stops_and_wants_neutral(control: Control, change: dict[str, Any]) -> None:
    shown(control, FORWARD, AHEAD, 1.0)
    control.reconfigure(CONFIG.model_copy(update=change))
    assert control.mux.velocity == ZERO
    assert shown(control, FORWARD, AHEAD) == ZERO
