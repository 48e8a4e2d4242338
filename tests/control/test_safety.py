import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control.engagement import Engagement
from handsteer.control.safety import Allowance, Ramp, Safety
from handsteer.timeouts import ARMING_S, DISENGAGE_S, FAULT_GAP_S, NEUTRAL_S
from handsteer.types import ZERO, Velocity

FRAME_S = 1 / 30
CONFIG = ControlConfig()


def show(safety: Safety, sign: str, seconds: float = FRAME_S, period_s: float = FRAME_S) -> bool:
    """Show a sign; return whether it may be followed in the end."""
    admitted = False
    for _ in range(max(1, round(seconds / period_s))):
        safety.step(period_s)
        admitted = safety.admits_sign(sign, stops=sign in {"Stop", "NONE"})
    return admitted


def armed() -> Safety:
    safety = Safety(CONFIG, arming=True)
    show(safety, "NONE", 2.0)
    assert show(safety, "Forward")
    return safety


def test_without_arming_the_first_sign_counts() -> None:
    assert show(Safety(CONFIG, arming=False), "Forward")


def test_a_hand_that_is_up_at_the_start_moves_nothing_however_long() -> None:
    safety = Safety(CONFIG, arming=True)
    assert not show(safety, "Forward", 60.0)
    assert safety.signs_wait == "has just started"


@pytest.mark.parametrize(("sign", "seconds"), [("Stop", FRAME_S), ("NONE", NEUTRAL_S + 2 * FRAME_S)])
def test_neutral_is_a_stop_or_an_empty_picture_for_a_while(sign: str, seconds: float) -> None:
    safety = Safety(CONFIG, arming=True)
    show(safety, "Forward", ARMING_S)
    show(safety, sign, seconds)
    assert show(safety, "Forward")


def test_a_hand_that_is_missed_for_some_frames_was_not_let_go() -> None:
    safety = Safety(CONFIG, arming=True)
    show(safety, "Forward", ARMING_S)
    for _ in range(10):
        show(safety, "NONE", NEUTRAL_S / 2)
        assert not show(safety, "Forward", 0.2)


def test_it_arms_no_earlier_than_others_can_have_said_that_the_robot_was_stopped() -> None:
    safety = Safety(CONFIG, arming=True)
    assert not show(safety, "Stop", ARMING_S - 2 * FRAME_S)
    show(safety, "Stop", 4 * FRAME_S)
    assert show(safety, "Forward")


@pytest.mark.parametrize("gap_s", [FAULT_GAP_S, CONFIG.sign_timeout, 3.0])
def test_a_none_after_a_gap_is_a_fault_and_none_that_were_seen_let_it_arm(gap_s: float) -> None:
    safety = armed()
    safety.step(gap_s)
    assert not safety.admits_sign("NONE", stops=True)
    assert not show(safety, "Forward", 5.0)
    assert not show(safety, "NONE", 20.0, period_s=0.5), "as recognition says while no frame comes"
    assert not show(safety, "Forward")
    show(safety, "NONE", NEUTRAL_S + FRAME_S)
    assert show(safety, "Forward")


def test_a_pause_of_the_signs_is_a_fault() -> None:
    safety = armed()
    safety.step(CONFIG.sign_timeout)
    assert not show(safety, "Forward", 5.0)
    assert safety.signs_wait == "no sign came"


def test_without_arming_a_fault_alone_changes_nothing() -> None:
    safety = Safety(CONFIG, arming=False)
    show(safety, "Forward")
    safety.step(5.0)
    assert show(safety, "Forward")


@pytest.mark.parametrize("arming", [False, True])
def test_a_stop_holds_until_it_is_reset_and_neutral_was_seen(arming: bool) -> None:
    safety = Safety(CONFIG, arming=arming)
    show(safety, "Stop", 2.0)
    safety.stop()
    show(safety, "Stop", 2.0)
    assert not show(safety, "Forward")
    assert not safety.admits_steering(is_zero=False)
    safety.reset()
    assert not show(safety, "Forward", 5.0)
    show(safety, "Stop")
    assert show(safety, "Forward")


def test_what_passed_between_a_fault_and_the_next_frame_was_no_empty_picture() -> None:
    safety = armed()
    safety.step(0.36)  # no sign, as the picture is frozen: recognition says so by a NONE of its own
    safety.admits_sign("NONE", stops=True)
    safety.step(0.27)  # then a live picture, of a hand whose sign is not confirmed yet
    safety.admits_sign("NONE", stops=True)
    assert not show(safety, "NONE", 0.4)
    assert not show(safety, "Forward")


def test_a_robot_that_was_away_is_driven_after_neutral_only() -> None:
    safety = armed()
    safety.robot_is_away("no robot listens")
    assert not show(safety, "Forward", 5.0)
    show(safety, "Stop")
    assert show(safety, "Forward")


def test_steering_that_was_held_since_before_the_start_has_to_let_go() -> None:
    safety = Safety(CONFIG, arming=True)
    for _ in range(100):
        safety.step(0.1)
        assert not safety.admits_steering(is_zero=False)
    safety.step(CONFIG.steering_timeout)
    assert not safety.admits_steering(is_zero=False), "its link may have been cut"
    safety.step(0.1)
    assert safety.admits_steering(is_zero=True)
    safety.step(5.0)
    assert safety.admits_steering(is_zero=False)


@pytest.mark.parametrize("arming", [False, True])
@pytest.mark.parametrize("silent_s", [0.0, 2.1, 600.0])
def test_no_clock_stands_for_a_release(arming: bool, silent_s: float) -> None:
    safety = Safety(CONFIG, arming=arming)
    safety.step(silent_s)
    assert not safety.admits_steering(is_zero=False), "its first command is already deflected"
    safety.disarm()
    safety.step(silent_s)
    assert not safety.admits_steering(is_zero=False)
    safety.step(CONFIG.steering_timeout)
    assert not safety.admits_steering(is_zero=False)
    assert safety.admits_steering(is_zero=True)
    safety.step(silent_s)
    assert safety.admits_steering(is_zero=False), "it was released before it fell silent"


@pytest.mark.parametrize(
    "happens",
    [
        lambda safety: safety.disarm("the camera was changed"),
        lambda safety: safety.robot_is_away("no robot listens"),
        lambda safety: safety.stall("the control was stalled"),
        lambda safety: (safety.stop(), safety.reset()),
        lambda safety: safety.admits_steering(is_zero=False, is_valid=False),
    ],
    ids=["disarm", "robot is away", "stall", "reset", "no number"],
)
@pytest.mark.parametrize("arming", [False, True])
def test_a_pad_that_is_held_while_something_happens_has_to_be_released(
    happens: Callable[[Safety], None], arming: bool
) -> None:
    safety = Safety(CONFIG, arming=arming)
    safety.admits_steering(is_zero=True)
    assert safety.admits_steering(is_zero=False)
    happens(safety)
    assert not safety.admits_steering(is_zero=False)
    assert safety.steering_waits
    safety.admits_steering(is_zero=True)
    assert safety.admits_steering(is_zero=False)


def test_a_pad_that_falls_silent_while_it_is_deflected_has_to_be_released() -> None:
    """The guard: ``is_lost`` in ``Release.admits``."""
    safety = Safety(CONFIG, arming=True)
    safety.admits_steering(is_zero=True)
    assert safety.admits_steering(is_zero=False)
    safety.step(CONFIG.steering_timeout)
    assert not any(safety.admits_steering(is_zero=False) for _ in range(5))


def test_the_camera_alone_does_not_stop_the_pad() -> None:
    safety = Safety(CONFIG, arming=True)
    safety.admits_steering(is_zero=True)
    safety.fault("no sign came")
    assert safety.admits_steering(is_zero=False)


def test_a_gamepad_at_rest_does_not_release_the_pad() -> None:
    safety = Safety(CONFIG, arming=True)
    safety.note_rest("gamepad")
    assert not safety.admits_steering(is_zero=False)
    assert safety.admits_steering(is_zero=False, by="gamepad")


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["Forward", "Turn Left", "NONE", "Stop", "stop", "reset", "away", "steer", "zero"]),
        st.floats(0.0, 1.0),
    ),
    max_size=60,
)


@given(EVENTS, st.booleans())
def test_whatever_happens_a_stopped_robot_follows_nobody(events: list[tuple[str, float]], arming: bool) -> None:
    safety, stopped = Safety(CONFIG, arming=arming), False
    for event, seconds in events:
        safety.step(seconds)
        if event in {"stop", "reset"}:
            stopped = event == "stop"
            (safety.stop if stopped else safety.reset)()
        elif event == "away":
            safety.robot_is_away("away")
        elif event in {"steer", "zero"}:
            assert not (safety.admits_steering(is_zero=event == "zero") and stopped)
        else:
            assert not (safety.admits_sign(event, stops=event in {"NONE", "Stop"}) and stopped)


@given(st.floats(30.0, 2000.0), st.floats(1.0, 3.0))
def test_no_more_signs_count_than_allowed_however_many_come(rate: float, seconds: float) -> None:
    allowance, taken = Allowance(60.0), 0
    allowance.step(100.0)
    for _ in range(int(rate * seconds)):
        allowance.step(1 / rate)
        taken += allowance.take()
    assert taken <= 60.0 * (seconds + Allowance.BURST_S) + 1
    if rate <= 60.0:
        assert taken == int(rate * seconds)


SPEEDS = st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=60)


@given(SPEEDS, st.floats(0.1, 5.0), st.floats(0.5, 20.0))
def test_what_is_commanded_grows_no_faster_than_the_limits_and_falls_at_once(
    wanted: list[float], acceleration: float, jerk: float
) -> None:
    ramp = Ramp(ControlConfig(max_linear_acceleration=acceleration, max_linear_jerk=jerk))
    speed, growth = 0.0, 0.0
    for linear in wanted:
        after = ramp.step(Velocity(linear, linear), 0.1)
        assert after.angular_radps == linear, "turning has no limit here"
        assert abs(after.linear_mps) <= abs(linear)
        if abs(linear) <= abs(speed) and linear * speed >= 0:
            assert after.linear_mps == linear
        grown = abs(after.linear_mps) - (abs(speed) if after.linear_mps * speed > 0 else 0.0)
        assert grown <= acceleration * 0.1 + 1e-9
        assert grown <= max(0.0, growth) + jerk * 0.1 * 0.1 + 1e-9
        speed, growth = after.linear_mps, grown


def test_without_limits_what_is_wanted_is_commanded() -> None:
    ramp = Ramp(ControlConfig())
    for wanted in (Velocity(1.0, 2.0), Velocity(-1.0, 0.5), ZERO):
        assert ramp.step(wanted, 0.0) == wanted


def test_a_limit_of_jerk_alone_lets_it_get_there() -> None:
    ramp = Ramp(ControlConfig(max_linear_jerk=2.0))
    for _ in range(30):
        now = ramp.step(Velocity(1.0, 0.0), 0.1)
    assert math.isclose(now.linear_mps, 1.0)


def palm(engagement: Engagement, seconds: float, sign: str = "Stop", dt_s: float = 0.05) -> bool:
    """Show ``sign``; return whether the hand is engaged in the end."""
    for _ in range(round(seconds / dt_s)):
        engagement.step(dt_s)
        engagement.note_sign(sign)
    return engagement.engaged


def test_an_open_palm_held_for_a_second_engages() -> None:
    engagement = Engagement(enabled=True)
    assert not palm(engagement, 0.55)
    assert engagement.progress == pytest.approx(0.5)
    assert palm(engagement, 0.5)
    assert engagement.progress == 1.0


@pytest.mark.parametrize("sign", ["Go", "Forward", "NONE"])
def test_a_palm_with_an_interruption_does_not_engage(sign: str) -> None:
    engagement = Engagement(enabled=True)
    for _ in range(5):
        palm(engagement, 0.9)
        palm(engagement, 0.05, sign)
    assert not engagement.engaged


def test_a_palm_without_frames_in_between_does_not_engage() -> None:
    engagement = Engagement(enabled=True)
    for _ in range(20):
        palm(engagement, 0.35, dt_s=0.35)
    assert not engagement.engaged


def gesture(engagement: Engagement, *frames: bool, sign: str = "Stop") -> bool:
    """Show ``sign``, and whether the gesture has just been made; return whether the hand is engaged in the end."""
    for is_done in frames:
        engagement.step(0.03)
        engagement.note_sign(sign)
        engagement.note_gesture(is_done=is_done)
    return engagement.engaged


def test_the_gesture_engages_and_a_palm_that_is_held_does_not() -> None:
    engagement = Engagement(enabled=True, by="gesture")
    assert not palm(engagement, 3.0)
    assert engagement.progress == 0.0
    assert gesture(engagement, False, True)
    assert engagement.progress == 1.0


def test_the_gesture_counts_only_where_it_begins_and_while_the_palm_is_seen() -> None:
    engagement = Engagement(enabled=True, by="gesture")
    assert not gesture(engagement, True, True), "when it was made is not known"
    assert not gesture(engagement, False, True, sign="NONE")
    assert gesture(engagement, False, True)
    engagement.disengage()
    assert not gesture(engagement, True, True), "it was made before"
    assert gesture(engagement, False, True)


def test_where_a_palm_that_is_held_engages_the_gesture_does_not() -> None:
    assert not gesture(Engagement(enabled=True, by="hold"), False, True)


def test_five_seconds_without_a_sign_disengage() -> None:
    engagement = Engagement(enabled=True)
    palm(engagement, 1.05)
    palm(engagement, 4.9, "NONE")
    palm(engagement, 0.05, "Go")
    assert palm(engagement, 4.9, "NONE")
    assert not palm(engagement, 0.1, "NONE")


def test_without_a_clutch_the_hand_is_always_engaged() -> None:
    engagement = Engagement(enabled=False)
    palm(engagement, 10.0, "NONE")
    engagement.disengage()
    assert engagement.engaged


@pytest.mark.parametrize(
    "end", [Safety.stop, lambda safety: safety.fault("x"), lambda safety: safety.robot_is_away("x")]
)
@pytest.mark.parametrize("arming", [False, True])
def test_a_stop_and_every_fault_disengage(end: Callable[[Safety], None], arming: bool) -> None:
    safety = Safety(ControlConfig(engage_by="hold"), arming=arming, engage=True)
    palm(safety.engagement, 1.05)
    end(safety)
    assert not safety.engagement.engaged


def test_a_stop_holds_against_a_released_joystick_and_its_reset_requires_another_release() -> None:
    """The guards: ``is_stopped`` in ``admits_stick``, and the disarming in ``reset``."""
    safety = Safety(ControlConfig(), arming=False)
    safety.admits_stick(held=False)
    safety.stop()
    safety.admits_stick(held=False)
    assert not safety.admits_stick(held=True)
    show(safety, "Stop")
    safety.reset()
    assert safety.signs_wait == ""
    assert not safety.admits_stick(held=True)
    show(safety, "Stop")
    assert not safety.admits_stick(held=True), "it was not released since the reset"
    safety.admits_stick(held=False)
    assert safety.admits_stick(held=True)


def test_the_time_between_two_palms_with_a_gap_does_not_engage() -> None:
    """The guard: ``FAULT_GAP_S`` in ``note_sign``."""
    engagement = Engagement(enabled=True)
    palm(engagement, 0.7)
    engagement.step(FAULT_GAP_S)
    engagement.note_sign("Stop")
    assert not palm(engagement, 0.5)
    assert palm(engagement, 0.6)


def test_an_idle_hand_disengages_while_frames_come() -> None:
    """The guard: ``DISENGAGE_S`` in ``Engagement.step``."""
    safety = Safety(ControlConfig(engage_by="hold"), arming=False, engage=True)
    show_and_note(safety, "Stop", 1.1)
    assert show_and_note(safety, "Forward", 0.1)
    show_and_note(safety, "NONE", DISENGAGE_S - 0.2)
    assert show_and_note(safety, "Forward", 0.1)
    show_and_note(safety, "NONE", DISENGAGE_S + 0.1)
    assert not show_and_note(safety, "Forward", 0.1)


def show_and_note(safety: Safety, sign: str, seconds: float) -> bool:
    """Show a sign, which may also engage; return whether it may be followed in the end."""
    admitted = False
    for _ in range(round(seconds / FRAME_S)):
        safety.step(FRAME_S)
        safety.engagement.note_sign(sign)
        admitted = safety.admits_sign(sign, stops=sign in {"Stop", "NONE"})
    return admitted


def test_a_held_joystick_is_followed_only_after_it_was_released() -> None:
    safety = Safety(ControlConfig(), arming=False)
    assert not any(safety.admits_stick(held=True) for _ in range(10))
    safety.admits_stick(held=False)
    assert safety.admits_stick(held=True)
    safety.step(1.0)
    assert not safety.admits_stick(held=True), "no frame came for a while"
    safety.admits_stick(held=False)
    safety.admits_steering(is_zero=False)
    assert not safety.admits_stick(held=True), "it was steered meanwhile"


def test_a_stop_holds_against_steering_that_was_seen_released() -> None:
    """The guard: ``is_stopped`` in ``admits_steering``."""
    safety = Safety(CONFIG, arming=False)
    safety.stop()
    assert not safety.admits_steering(is_zero=True)
    assert not safety.admits_steering(is_zero=False)
    assert not safety.steering_waits


def test_a_joystick_that_was_released_drives_nothing_while_the_hand_is_not_engaged() -> None:
    """The guard: ``engaged`` in ``admits_stick``."""
    safety = Safety(CONFIG, arming=False, engage=True)
    safety.admits_stick(held=False)
    assert not safety.admits_stick(held=True)
    free = Safety(CONFIG, arming=False)
    free.admits_stick(held=False)
    assert free.admits_stick(held=True)


def test_empty_pictures_that_come_seldom_count_as_one_frame_each() -> None:
    """The guard: ``MOST_OF_ONE_NONE_S`` in ``_note_none``."""
    safety = Safety(CONFIG, arming=True)
    show(safety, "Forward", ARMING_S)
    show(safety, "NONE", 1.0, period_s=0.25)
    assert not show(safety, "Forward")
    show(safety, "NONE", 2.0, period_s=0.25)
    assert show(safety, "Forward")


def test_allowance_that_was_not_used_expires() -> None:
    """The guard: ``BURST_S`` in ``Allowance.step``."""
    allowance = Allowance(60.0)
    allowance.step(100.0)
    assert sum(allowance.take() for _ in range(1000)) == 60.0 * Allowance.BURST_S


def test_a_limit_of_jerk_lets_acceleration_grow_slowly() -> None:
    """The guard: ``max_jerk`` in ``_Axis.step``."""
    ramp = Ramp(ControlConfig(max_linear_jerk=2.0))
    speeds = [ramp.step(Velocity(1.0, 0.0), 0.1).linear_mps for _ in range(4)]
    assert speeds == [pytest.approx(0.02), pytest.approx(0.06), pytest.approx(0.12), pytest.approx(0.2)]
