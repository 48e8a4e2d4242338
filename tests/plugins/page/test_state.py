import math
from dataclasses import replace
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import ControlConfig
from handsteer.control import Source
from handsteer.control.explain import Reason
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status
from handsteer.plugins.page.observed import STALE_S, Observed, Report, Reporting, Viewers
from handsteer.plugins.page.state import compose, explain, frame_rate
from handsteer.plugins.page.status_bar import Notable, spoken
from handsteer.plugins.page.steer_panel import mux_inputs
from handsteer.plugins.page.steering_input import read_deflection, read_number
from handsteer.types import SIGNS, ZERO, Velocity

NO_SIGN = Reason("no_sign")


def observed(*statuses: Status, **rest: Any) -> Observed:
    return Observed({type(status): Report(status, 0.0) for status in statuses}, **rest)


def reporting(*statuses: Status) -> Reporting:
    return Reporting.at(0.1, observed(*statuses))


def control(reason: Reason, linear: float = 0.0, angular: float = 0.0, source: Source = "signs") -> ControlStatus:
    return ControlStatus(reason, source, linear_mps=linear, angular_radps=angular)


CAMERA = CameraStatus("virtual hand", "delivers", frames=10)
UNPLUGGED = CameraStatus("/dev/video0", "lost", problem="/dev/video0 was unplugged")
NO_HAND = RecognitionStatus(seen="NONE")
DISARMED = ControlStatus(Reason("disarmed", "no sign came"), "signs", armed=False)

DISENGAGED = ControlStatus(Reason("disengaged", "1"), "signs", engaged=False, engage_progress=0.0)


@pytest.mark.parametrize(
    ("statuses", "says"),
    [
        ((), ("waiting", "Waiting", "the node hand_sign_control does not report")),
        ((control(Reason("sign", "Forward"), linear=0.3),), ("driving", "Driving", "Forward")),
        (
            (control(Reason("sign", "Turn Left"), angular=-0.1), RobotStatus(touches=("crate",))),
            ("driving", "Driving", "Turn Left, but the robot touches crate"),
        ),
        ((control(NO_SIGN), NO_HAND), ("standing", "Standing", "no hand is in view")),
        (
            (control(NO_SIGN), RecognitionStatus(seen="Forward", handedness="Left")),
            ("standing", "Standing", "hold Forward a moment longer"),
        ),
        (
            (DISARMED, NO_HAND),
            ("standing", "Ready", "show Stop or lower your hand to begin (no sign came)"),
        ),
        (
            (DISARMED, RecognitionStatus(refused="the picture is black")),
            ("standing", "Standing", "the picture is black"),
        ),
        (
            (control(Reason("stop_sign", "Stop")), RecognitionStatus("Stop", seen="Stop", handedness="Left")),
            ("standing", "Standing", "the Stop sign is shown"),
        ),
        (
            (replace(control(Reason("sign", "Forward"), linear=0.3), renew_s=3),),
            ("driving", "Driving", "Forward; stops in 3 s unless it changes"),
        ),
        (
            (replace(DISARMED, reason=Reason("renew", "20")), NO_HAND),
            ("standing", "Ready", "the same sign for 20 s: show Stop or lower your hand, then show it again"),
        ),
        (
            (replace(DISENGAGED, reason=Reason("disengaged")), NO_HAND),
            ("standing", "Disengaged", "open, close and open your hand to begin"),
        ),
        ((DISENGAGED, NO_HAND), ("standing", "Disengaged", "hold an open palm for 1 s to begin")),
        (
            (DISENGAGED, RecognitionStatus(no_frame_s=2.0), UNPLUGGED),
            ("trouble", "Standing", "/dev/video0 was unplugged"),
        ),
        (
            (replace(DISENGAGED, reason=Reason("disengaged", "1", "turtle1")), NO_HAND),
            ("standing", "Disengaged", "hold an open palm for 1 s to begin with turtle1"),
        ),
        (
            (replace(DISENGAGED, reason=Reason("steered_at_zero"), source="steering"), NO_HAND),
            ("standing", "Standing", "steered directly, at zero"),
        ),
        (
            (control(Reason("not_held"), source="joystick"), NO_HAND),
            ("standing", "Standing", "no hand holds the joystick: open it, then close the fist"),
        ),
        (
            (control(Reason("not_held"), source="joystick"), RecognitionStatus(refused="the picture is black")),
            ("standing", "Standing", "the picture is black"),
        ),
        (
            (control(Reason("held"), source="joystick"), RecognitionStatus("Go", seen="Go", handedness="Left")),
            ("standing", "Standing", "the joystick is held, in the middle"),
        ),
        (
            (control(Reason("joystick"), linear=0.3, source="joystick"),),
            ("driving", "Driving", "driven by the hand as a joystick"),
        ),
        (
            (control(NO_SIGN), RecognitionStatus(no_frame_s=2.0), UNPLUGGED),
            ("trouble", "Standing", "/dev/video0 was unplugged"),
        ),
        (
            (control(Reason("no_input", "0.5"), source="none"),),
            ("trouble", "Standing", "the node hand_sign_recognition does not report"),
        ),
        (
            (control(Reason("steered_at_zero"), source="steering"), NO_HAND, UNPLUGGED),
            ("standing", "Standing", "steered directly, at zero"),
        ),
    ],
)
def test_says_in_a_sentence_what_the_robot_does_and_why(
    statuses: tuple[Status, ...], says: tuple[str, str, str]
) -> None:
    assert explain(reporting(*statuses)) == says


@pytest.mark.parametrize(
    ("status", "headline"),
    [
        (control(NO_SIGN), "Standing"),
        (DISARMED, "Ready"),
        (DISENGAGED, "Disengaged"),
        (ControlStatus(Reason("stopped"), stopped=True), "Stopped"),
    ],
)
def test_is_stopping_until_the_measured_speed_is_about_zero(status: ControlStatus, headline: str) -> None:
    for measured, came_s, said in (
        (Velocity(0.38, 0.0), 0.0, "Stopping"),
        (Velocity(0.0, -0.3), 0.0, "Stopping"),
        (Velocity(0.01, 0.04), 0.0, headline),
        (Velocity(0.38, 0.0), -2.0, headline),
    ):
        state = compose(observed(status, NO_HAND, measured=measured, measured_came_s=came_s), 0.1)
        assert state.headline == said


def test_composes_the_figures() -> None:
    state = compose(
        observed(
            CameraStatus("/dev/video0", "delivers", frames=60),
            RecognitionStatus("Forward", seen="Forward", confidence=0.93, handedness="Left"),
            replace(control(Reason("sign", "Forward"), linear=0.25), latency_median_ms=11.5, latency_p99_ms=20.0),
            RobotStatus(collisions=2, path_length_m=1.25),
            command=Velocity(0.25, 0.0),
            command_came_s=0.0,
            measured=Velocity(0.24, 0.01),
            frame_counts=((-1.0, 30.0), (0.0, 60.0)),
        ),
        now_s=0.1,
    )
    assert (state.recognition.sign, state.seen, state.recognition.confidence, state.recognition.handedness) == (
        "Forward",
        "Forward",
        0.93,
        "Left",
    )
    assert (state.commanded, state.measured) == (Velocity(0.25, 0.0), Velocity(0.24, 0.01))
    assert (state.control.latency_median_ms, state.control.latency_p99_ms, state.fps) == (11.5, 20.0, 30.0)
    assert (state.robot.path_length_m, state.robot.collisions) == (1.25, 2)
    assert (state.camera, state.control.source, state.no_picture) == ("video0", "signs", "")


def test_knows_nothing_before_anything_has_come() -> None:
    state = compose(Observed(), now_s=100.0)
    assert (state.mood, state.recognition.sign, state.commanded, state.no_picture) == (
        "waiting",
        "NONE",
        ZERO,
        "no report yet",
    )
    assert (state.control.latency_median_ms, state.fps, state.robot.path_length_m, state.robot.collisions) == (
        None,
        None,
        None,
        None,
    )


def test_says_why_there_is_no_picture() -> None:
    silent = RecognitionStatus(no_frame_s=3.0)
    assert compose(observed(silent, CAMERA), now_s=0.1).no_picture == (
        "no frame for 3.0 s: connect the camera again, or choose another"
    )
    assert compose(observed(silent, UNPLUGGED), now_s=0.1).no_picture == "/dev/video0 was unplugged"


def test_forgets_a_node_that_has_gone_silent() -> None:
    driving = observed(control(Reason("sign", "Forward"), linear=0.3), command=Velocity(0.3, 0.0), command_came_s=0.0)
    assert compose(driving, now_s=0.1).headline == "Driving"
    late = compose(driving, now_s=STALE_S + 0.1)
    assert (late.headline, late.commanded) == ("Waiting", ZERO)


@pytest.mark.parametrize(
    ("counts", "now_s", "rate"),
    [
        ((), 0.0, None),
        (((0.0, 10.0),), 0.1, None),
        (((0.0, 10.0), (0.5, 25.0), (1.0, 40.0)), 1.1, 30.0),
        (((0.0, 10.0), (1.0, 40.0)), 1.1 + STALE_S, 0.0),
        (((0.0, 40.0), (1.0, 3.0)), 1.1, None),
        (((1.0, 3.0), (1.0, 4.0)), 1.1, None),
    ],
)
def test_counts_frames_a_second(counts: tuple[tuple[float, float], ...], now_s: float, rate: float | None) -> None:
    assert frame_rate(counts, now_s) == rate


@pytest.mark.parametrize(
    ("sent", "read"),
    [
        ({"x": 0.5, "y": -1}, (0.5, -1.0)),
        ({"x": 2, "y": 0.1}, (0.0, 0.1)),
        ({"x": math.nan, "y": math.inf}, (0.0, 0.0)),
        ({"x": "1", "y": True}, (0.0, 0.0)),
        ({}, (0.0, 0.0)),
        (None, (0.0, 0.0)),
        ([1, 1], (0.0, 0.0)),
    ],
)
def test_reads_only_sound_deflections_of_the_pad(sent: object, read: tuple[float, float]) -> None:
    assert read_deflection(sent) == read


def test_what_is_wrong_with_the_robot_is_said_whatever_it_is_told() -> None:
    for speed in (0.1, 0.0):
        robot = RobotStatus(trouble="is not there: no node subscribes to /cmd_vel")
        says = explain(reporting(control(Reason("sign", "Forward"), linear=speed), robot))
        assert says == ("trouble", "Trouble", "the robot is not there: no node subscribes to /cmd_vel")


STOPPED = ControlStatus(Reason("stopped"), stopped=True)


@pytest.mark.parametrize(
    ("viewers", "says"),
    [
        (Viewers(), "until you reset it"),
        (Viewers(stopped="you"), "by you, until you reset it"),
        (Viewers(stopped="you", may_reset=False), "by you, until the driver resets it"),
        (Viewers(stopped="another viewer"), "by another viewer, until you reset it"),
        (Viewers(stopped="you", stopped_for="the lesson"), "for the lesson, until you reset it"),
        (Viewers(stopped_for="the lap", may_reset=False), "for the lap, until the driver resets it"),
    ],
)
def test_says_who_stopped_the_robot_and_who_may_reset_it(viewers: Viewers, says: str) -> None:
    assert explain(reporting(STOPPED), viewers) == ("trouble", "Stopped", says)
    assert compose(observed(STOPPED), 0.1, viewers).stopped


def test_that_it_is_stopped_is_said_once() -> None:
    state = compose(observed(STOPPED), 0.1, Viewers(stopped="you"))
    assert (state.headline, state.reason) == ("Stopped", "by you, until you reset it")


@pytest.mark.parametrize(
    ("status", "seen", "reason"),
    [
        (control(Reason("steered_at_zero"), source="steering"), NO_HAND, "steered directly"),
        (control(Reason("held"), source="joystick"), NO_HAND, "driven by the hand as a joystick"),
        (
            replace(control(NO_SIGN, source="joystick"), rule=ControlConfig(rule="point")),
            RecognitionStatus("Forward", seen="Forward"),
            "driven where the hand points",
        ),
        (control(NO_SIGN), RecognitionStatus("Forward", seen="Forward"), "Forward"),
    ],
)
def test_beside_a_command_to_drive_an_older_report_does_not_say_that_it_stands(
    status: ControlStatus, seen: RecognitionStatus, reason: str
) -> None:
    since = {"command": Velocity(0.5, 0.0), "command_came_s": 0.05, "measured": Velocity(0.4, 0.0)}
    state = compose(observed(status, seen, measured_came_s=0.05, **since), 0.1)
    assert (state.headline, state.reason, state.commanded) == ("Driving", reason, Velocity(0.5, 0.0))


def test_an_older_or_foreign_command_does_not_outdo_the_report() -> None:
    steered = control(Reason("steered_at_zero"), source="steering")
    older = observed(steered, NO_HAND, command=Velocity(0.5, 0.0), command_came_s=-0.05)
    newer: dict[str, Any] = {"command": Velocity(0.5, 0.0), "command_came_s": 0.05}
    rivals = observed(replace(steered, warning="two nodes command the robot"), NO_HAND, **newer)
    silent = observed(control(NO_SIGN), RecognitionStatus("Stop", seen="Stop"), **newer)
    for each in (older, rivals, silent):
        assert compose(each, 0.1).headline == "Standing"
    assert compose(observed(STOPPED, NO_HAND, **newer), 0.1).headline == "Stopped"


def test_without_frames_it_says_what_to_do() -> None:
    state = compose(observed(control(NO_SIGN), RecognitionStatus(no_frame_s=12.0), CAMERA), 0.1)
    assert state.reason == "no frame for 12.0 s: connect the camera again, or choose another"


def test_steering_past_the_control_is_said_whatever_the_control_says() -> None:
    direct = Viewers(steers="you", topic="/cmd_vel")
    standing = (control(NO_SIGN), NO_HAND)
    for statuses in (standing, ()):
        assert explain(reporting(*statuses), direct) == ("driving", "Driving", "steered straight on /cmd_vel")
    halted = Viewers(topic="/cmd_vel", stopped="you", stands=True)
    for statuses in (standing, ()):
        assert explain(reporting(*statuses), halted) == ("trouble", "Stopped", "by you, until you reset it")
        assert compose(observed(*statuses), 0.1, halted).stopped


def test_a_stop_is_said_once_the_control_obeys_it() -> None:
    halted = Viewers(stopped="you", stands=True)
    assert not compose(observed(control(Reason("sign", "Forward"), linear=0.1)), 0.1, halted).stopped
    assert compose(observed(STOPPED), 0.1, halted).stopped
    assert compose(Observed(), 0.1).headline == "Waiting"


def test_a_stop_of_which_no_control_reports_is_not_said_to_have_stopped_the_robot() -> None:
    halted = Viewers(stopped="you", stands=True)
    state = compose(Observed(), 0.1, halted)
    assert (state.mood, state.headline) == ("trouble", "Trouble")
    assert "the robot may still drive" in state.reason
    assert state.stopped, "it can be reset"
    assert state.unheard
    assert Notable.of(state).news_since(Notable.of(compose(Observed(), 0.1))) is None
    assert not compose(observed(STOPPED), 0.1, halted).unheard


@pytest.mark.parametrize(
    ("stopped", "source", "viewers", "holds"),
    [
        (False, "none", Viewers(), None),
        (False, "signs", Viewers(), "Signs"),
        (False, "steering", Viewers(steers="you", steered="you"), "Pad and keys: you"),
        (False, "steering", Viewers(steered="you"), "Pad and keys: you"),
        (False, "steering", Viewers(steered="another viewer"), "Pad and keys: another viewer"),
        (False, "steering", Viewers(), "Pad and keys: another node"),
        (False, "signs", Viewers(steers="you", steered="you", topic="/cmd_vel"), "Pad and keys: you"),
        (True, "steering", Viewers(steers="you", stopped="another viewer"), "Stop: another viewer"),
        (True, "signs", Viewers(), "Stop"),
    ],
)
def test_at_most_one_source_has_the_robot(
    *, stopped: bool, source: Source, viewers: Viewers, holds: str | None
) -> None:
    shown = mux_inputs(compose(observed(ControlStatus(source=source, stopped=stopped)), 0.1, viewers))
    assert [entry.name for entry in shown] == ["Stop", "Pad and keys", "Signs"]
    holding = [entry.name + (f": {entry.viewer}" if entry.viewer else "") for entry in shown if entry.is_active]
    assert holding == ([holds] if holds else [])


@pytest.mark.parametrize(("by", "engaging"), [("gesture", 0.67), ("hold", 0.67)])
def test_the_progress_of_the_gesture_is_that_of_the_recognition(
    by: Literal["gesture", "hold"], engaging: float
) -> None:
    control = ControlStatus(engaged=False, engage_progress=0.0, rule=ControlConfig(engage_by=by))
    state = compose(observed(control, RecognitionStatus(engage_progress=0.67)), 0.1)
    assert (state.engaging, state.engages_by_gesture) == (engaging, by == "gesture")


@pytest.mark.parametrize(
    ("source", "holds"), [("joystick", ["Joystick"]), ("steering", ["Pad and keys"]), ("none", [])]
)
def test_the_hand_as_a_joystick_is_a_source_instead_of_the_signs(source: Source, holds: list[str]) -> None:
    status = ControlStatus(source=source, rule=ControlConfig(mode="joystick"))
    shown = mux_inputs(compose(observed(status), 0.1))
    assert [entry.name for entry in shown] == ["Stop", "Pad and keys", "Joystick"]
    assert [entry.name for entry in shown if entry.is_active] == holds


@pytest.mark.parametrize(
    ("status", "engaging"),
    [
        (None, None),
        (ControlStatus(), None),
        (ControlStatus(engaged=False, engage_progress=0.4), 0.4),
        (ControlStatus(engaged=False, engage_progress=7.0), 1.0),
        (ControlStatus(engaged=False, engage_progress=0.4, stopped=True), None),
        (ControlStatus(engaged=False, engage_progress=0.0, rule=ControlConfig()), 0.0),
    ],
)
def test_tells_how_far_the_hand_is_engaged_while_that_matters(
    status: ControlStatus | None, engaging: float | None
) -> None:
    assert compose(observed(status) if status else Observed(), 0.1).engaging == engaging


@pytest.mark.parametrize(
    ("sign", "seen", "progress", "confirmed"),
    [
        ("NONE", "NONE", 0.0, 0.0),
        ("NONE", "Forward", 0.67, 0.67),
        ("Go", "Forward", 0.1, 0.1),
        ("Forward", "Forward", 0.0, 1.0),
        ("NONE", "Forward", 7.0, 1.0),
        ("NONE", "Forward", -1.0, 0.0),
        ("NONE", None, 0.0, 0.0),
    ],
)
def test_tells_how_far_a_sign_is_confirmed(sign: str, seen: str | None, progress: float, confirmed: float) -> None:
    assert compose(observed(RecognitionStatus(sign, seen=seen, progress=progress)), 0.1).confirmed == confirmed


@given(
    sent=st.one_of(st.none(), st.booleans(), st.text(), st.floats(), st.integers()),
    low=st.floats(-5, 0),
    high=st.floats(0, 5),
)
def test_a_number_of_a_browser_is_within_limits_whatever_was_sent(sent: object, low: float, high: float) -> None:
    assert low <= read_number(sent, low, high, 0.0) <= high


def test_the_legend_is_of_what_was_last_known() -> None:
    rule, signs = ControlConfig(max_linear=0.3), ("Stop", "Peace")
    before = compose(observed(), 100.0)
    assert (before.signs, before.rule) == (SIGNS, None)
    after = compose(observed(RecognitionStatus(signs=signs), ControlStatus(rule=rule)), 100.0)
    assert (after.signs, after.rule, after.control.rule) == (signs, rule, None)


def test_a_warning_of_two_nodes_is_shown_once() -> None:
    warning = "two nodes command the robot"
    both = observed(ControlStatus(warning=warning), RobotStatus(warning=warning))
    assert compose(both, 0.1).warnings == (warning,)


def test_a_screen_reader_is_not_told_each_tenth_of_a_second() -> None:
    def said(no_hand_s: float) -> str:
        seen = RecognitionStatus(seen="NONE", no_hand_s=no_hand_s)
        return spoken(compose(observed(control(NO_SIGN), CAMERA, seen), 0.1))

    assert said(0.4) == said(12.0) == "Standing: no hand seen"


def test_the_most_important_news_is_told() -> None:
    waits, ready, forward = Notable(False, False, "NONE"), Notable(False, True, "NONE"), Notable(False, True, "Forward")
    stopped = Notable(True, False, "NONE")
    assert ready.news_since(waits) == ("ready", "Ready for signs")
    assert Notable(False, True, "Stop").news_since(waits) == ("ready", "Ready for signs")
    assert forward.news_since(ready) == ("sign", "Sign accepted: Forward")
    assert stopped.news_since(forward) == ("stopped", "Stopped")
    assert [now.news_since(before) for now, before in ((waits, stopped), (ready, forward), (forward, forward))] == [
        None,
        None,
        None,
    ]
