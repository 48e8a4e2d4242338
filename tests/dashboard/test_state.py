import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.dashboard.page import spoken
from handsteer.dashboard.state import (
    STALE_S,
    Observed,
    Report,
    Viewers,
    camera_name,
    compose,
    explain,
    frame_rate,
    place_in_world,
)
from handsteer.dashboard.steer_panel import mux_inputs
from handsteer.dashboard.steering_input import read_deflection, read_number
from handsteer.types import ZERO, Pose2D, Velocity

OK, WARN, ERROR = 0, 1, 2
FINITE = st.floats(-100, 100)
POSES = st.builds(Pose2D, FINITE, FINITE, st.floats(-7, 7))


def report(message: str, level: int = OK, came_s: float = 0.0, **values: str) -> Report:
    return Report(level, message, values, came_s)


def control(message: str, linear: str = "0.000", angular: str = "0.000", source: str = "signs") -> Report:
    return report(message, source=source, linear_mps=linear, angular_radps=angular)


CAMERA = report("virtual hand: delivers frames", frames="10")
NO_HAND = report("no hand is in view", sign="NONE", seen="NONE")


@pytest.mark.parametrize(
    ("reports", "says"),
    [
        ({}, ("waiting", "Waiting", "the node hand_sign_control does not report")),
        (
            {"hand_sign_control": control("driving: Forward", linear="0.300")},
            ("driving", "Driving", "Forward"),
        ),
        (
            {
                "hand_sign_control": control("driving: Turn Left", angular="-0.100"),
                "robot": report("touches crate", WARN),
            },
            ("driving", "Driving", "Turn Left, but the robot touches crate"),
        ),
        (
            {"hand_sign_control": control("standing: no sign is seen"), "hand_sign_recognition": NO_HAND},
            ("standing", "Standing", "no hand is in view"),
        ),
        (
            {
                "hand_sign_control": control("standing: no sign is seen"),
                "hand_sign_recognition": report("Forward is not confirmed yet", sign="NONE", seen="Forward"),
            },
            ("standing", "Standing", "Forward is not confirmed yet"),
        ),
        (
            {
                "hand_sign_control": report(
                    "standing: disarmed, moves once Stop is shown", source="signs", armed="False"
                ),
                "hand_sign_recognition": report("no hand is in view", sign="NONE", seen="NONE"),
            },
            ("standing", "Standing", "disarmed, moves once Stop is shown"),
        ),
        (
            {
                "hand_sign_control": report(
                    "standing: disarmed, moves once Stop is shown", source="signs", armed="False"
                ),
                "hand_sign_recognition": report("the camera is frozen: the same picture for 1.0 s", WARN, sign="NONE"),
            },
            ("standing", "Standing", "the camera is frozen: the same picture for 1.0 s"),
        ),
        (
            {
                "hand_sign_control": control("standing: the Stop sign is shown"),
                "hand_sign_recognition": report("Stop is shown", sign="Stop", seen="Stop"),
            },
            ("standing", "Standing", "the Stop sign is shown"),
        ),
        (
            {
                "hand_sign_control": control("standing: no sign is seen"),
                "hand_sign_recognition": report("no frame for 2.0 s", WARN, sign="NONE"),
                "my_camera": report("/dev/video0 was unplugged", ERROR),
            },
            ("trouble", "Standing", "/dev/video0 was unplugged"),
        ),
        (
            {"hand_sign_control": control("standing: no sign has come for 0.5 s", source="nobody")},
            ("trouble", "Standing", "the node hand_sign_recognition does not report"),
        ),
        (
            {
                "hand_sign_control": control("standing: steered by hand, at zero", source="steering"),
                "hand_sign_recognition": NO_HAND,
                "my_camera": report("/dev/video0 was unplugged", ERROR),
            },
            ("standing", "Standing", "steered by hand, at zero"),
        ),
    ],
)
def test_says_in_a_sentence_what_the_robot_does_and_why(reports: dict[str, Report], says: tuple[str, str, str]) -> None:
    assert explain(reports) == says


def test_composes_the_figures() -> None:
    reports = {
        "my_camera": report("/dev/video0: delivers frames", frames="60"),
        "hand_sign_recognition": report(
            "Forward is shown", sign="Forward", seen="Forward", confidence="0.93", handedness="Left"
        ),
        "hand_sign_control": report(
            "driving: Forward",
            source="signs",
            linear_mps="0.250",
            angular_radps="0.000",
            latency_median_ms="11.5",
            latency_p99_ms="20.0",
        ),
        "robot": report("moves freely", collisions="2", path_length_m="1.25"),
    }
    state = compose(
        Observed(reports, Velocity(0.25, 0.0), 0.0, Velocity(0.24, 0.01), frame_counts=((-1.0, 30.0), (0.0, 60.0))),
        now_s=0.1,
    )
    assert (state.sign, state.seen, state.confidence, state.handedness) == ("Forward", "Forward", 0.93, "Left")
    assert (state.commanded, state.measured) == (Velocity(0.25, 0.0), Velocity(0.24, 0.01))
    assert (state.latency_median_ms, state.latency_p99_ms, state.fps) == (11.5, 20.0, 30.0)
    assert (state.path_length_m, state.collisions) == (1.25, 2)
    assert (state.camera, state.driver, state.no_picture) == ("video0", "signs", "")


def test_knows_nothing_before_anything_has_come() -> None:
    state = compose(Observed(), now_s=100.0)
    assert (state.mood, state.sign, state.commanded, state.no_picture) == ("waiting", "NONE", ZERO, "no report yet")
    assert (state.latency_median_ms, state.fps, state.path_length_m, state.collisions) == (None, None, None, None)


def test_says_why_there_is_no_picture() -> None:
    silent = report("no frame for 3.0 s", WARN, sign="NONE")
    reports = {"hand_sign_recognition": silent, "my_camera": CAMERA}
    assert compose(Observed(reports), now_s=0.1).no_picture == "no frame for 3.0 s"
    reports["my_camera"] = report("webcam 0 was unplugged", ERROR)
    assert compose(Observed(reports), now_s=0.1).no_picture == "webcam 0 was unplugged"


def test_forgets_a_node_that_has_gone_silent() -> None:
    observed = Observed({"hand_sign_control": control("driving: Forward", linear="0.3")}, Velocity(0.3, 0.0), 0.0)
    assert compose(observed, now_s=0.1).headline == "Driving"
    late = compose(observed, now_s=STALE_S + 0.1)
    assert (late.headline, late.commanded) == ("Waiting", ZERO)


@pytest.mark.parametrize("value", ["", "fast", "nan", "inf"])
def test_takes_a_figure_that_is_no_number_for_unknown(value: str) -> None:
    assert report("", speed=value).number("speed") is None
    assert report("").number("speed") is None


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
    ("message", "name"),
    [
        ("virtual hand: delivers frames", "virtual hand"),
        ("/dev/video0: delivers frames", "video0"),
        ("/a/folder/clip.mp4: waiting for the first frame", "clip.mp4"),
        ("rtsp://user:secret@host/stream: delivers frames", "stream"),
        ("", ""),
    ],
)
def test_shortens_the_camera_to_a_name_without_secrets(message: str, name: str) -> None:
    assert camera_name(message) == name


@given(truth=POSES, then=POSES, forward=FINITE)
def test_the_robot_goes_on_from_its_true_pose_as_its_wheels_count(truth: Pose2D, then: Pose2D, forward: float) -> None:
    now = Pose2D(then.x + forward * math.cos(then.yaw), then.y + forward * math.sin(then.yaw), then.yaw)
    placed = place_in_world(truth, then, now)
    assert placed.x == pytest.approx(truth.x + forward * math.cos(truth.yaw), abs=1e-6)
    assert placed.y == pytest.approx(truth.y + forward * math.sin(truth.yaw), abs=1e-6)
    assert placed.yaw == pytest.approx(truth.yaw, abs=1e-9)


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
    for speed in ("0.100", "0.000"):
        reports = {
            "hand_sign_control": report("driving: Forward", linear_mps=speed),
            "robot": report("is not there: nobody listens on /cmd_vel", level=ERROR),
        }
        assert explain(reports) == ("trouble", "Trouble", "the robot is not there: nobody listens on /cmd_vel")


STOPPED = {"hand_sign_control": report("standing: stopped, until it is reset", stopped="True")}


@pytest.mark.parametrize(
    ("viewers", "says"),
    [
        (Viewers(), "stopped, until you reset it"),
        (Viewers(stopped="you"), "stopped by you, until you reset it"),
        (Viewers(stopped="you", may_reset=False), "stopped by you, until the driver resets it"),
        (Viewers(stopped="another viewer"), "stopped by another viewer, until you reset it"),
    ],
)
def test_says_who_stopped_the_robot_and_who_may_reset_it(viewers: Viewers, says: str) -> None:
    assert explain(STOPPED, viewers) == ("trouble", "Stopped", says)
    assert compose(Observed(STOPPED), 0.1, viewers).stopped


def test_steering_past_the_control_is_said_whatever_the_control_says() -> None:
    direct = Viewers(steers="you", topic="/cmd_vel")
    standing = {"hand_sign_control": control("standing: no sign is seen"), "hand_sign_recognition": NO_HAND}
    for reports in (standing, {}):
        assert explain(reports, direct) == ("driving", "Driving", "steered by hand, straight on /cmd_vel")
    halted = Viewers(topic="/cmd_vel", stopped="you", stands=True)
    for reports in (standing, {}):
        assert explain(reports, halted) == ("trouble", "Stopped", "stopped by you, until you reset it")
        assert compose(Observed(reports), 0.1, halted).stopped


def test_a_stop_is_said_once_the_control_obeys_it_or_when_there_is_no_control() -> None:
    halted = Viewers(stopped="you", stands=True)
    assert not compose(Observed({"hand_sign_control": control("driving: Forward", linear="0.1")}), 0.1, halted).stopped
    assert compose(Observed(STOPPED), 0.1, halted).stopped
    assert compose(Observed(), 0.1, halted).headline == "Stopped"
    assert compose(Observed(), 0.1).headline == "Waiting"


@pytest.mark.parametrize(
    ("stopped", "source", "viewers", "holds"),
    [
        ("False", "nobody", Viewers(), None),
        ("False", "signs", Viewers(), "Signs"),
        ("False", "steering", Viewers(steers="you"), "By hand: you"),
        ("False", "steering", Viewers(steers="another viewer"), "By hand: another viewer"),
        ("False", "steering", Viewers(), "By hand: another node"),
        ("False", "signs", Viewers(steers="you", topic="/cmd_vel"), "By hand: you"),
        ("True", "steering", Viewers(steers="you", stopped="another viewer"), "Stop: another viewer"),
        ("True", "signs", Viewers(), "Stop"),
    ],
)
def test_at_most_one_source_has_the_robot(stopped: str, source: str, viewers: Viewers, holds: str | None) -> None:
    reports = {"hand_sign_control": report("standing: x", stopped=stopped, source=source)}
    shown = mux_inputs(compose(Observed(reports), 0.1, viewers))
    assert [entry.name for entry in shown] == ["Stop", "By hand", "Signs"]
    holding = [entry.name + (f": {entry.viewer}" if entry.viewer else "") for entry in shown if entry.is_active]
    assert holding == ([holds] if holds else [])


@pytest.mark.parametrize(
    ("values", "confirmed"),
    [
        ({"sign": "NONE", "seen": "NONE", "progress": "0.00"}, 0.0),
        ({"sign": "NONE", "seen": "Forward", "progress": "0.67"}, 0.67),
        ({"sign": "Go", "seen": "Forward", "progress": "0.10"}, 0.1),
        ({"sign": "Forward", "seen": "Forward", "progress": "0.00"}, 1.0),
        ({"sign": "NONE", "seen": "Forward", "progress": "7"}, 1.0),
        ({"sign": "NONE", "seen": "Forward"}, 0.0),
        ({}, 0.0),
    ],
)
def test_tells_how_far_a_sign_is_confirmed(values: dict[str, Any], confirmed: float) -> None:
    assert compose(Observed({"hand_sign_recognition": report("", **values)}), 0.1).confirmed == confirmed


def test_knows_the_limits_of_the_control() -> None:
    state = compose(Observed({"hand_sign_control": report("", max_linear="0.3", max_angular="1.5")}), 0.1)
    assert (state.max_linear_mps, state.max_angular_radps) == (0.3, 1.5)


@given(
    sent=st.one_of(st.none(), st.booleans(), st.text(), st.floats(), st.integers()),
    low=st.floats(-5, 0),
    high=st.floats(0, 5),
)
def test_a_number_of_a_browser_is_within_limits_whatever_was_sent(sent: object, low: float, high: float) -> None:
    assert low <= read_number(sent, low, high, 0.0) <= high


def test_a_screen_reader_is_not_told_each_tenth_of_a_second() -> None:
    def said(reason: str) -> str:
        reports = {"hand_sign_control": control("standing: no sign is seen"), "my_camera": CAMERA}
        return spoken(compose(Observed({**reports, "hand_sign_recognition": report(reason, sign="NONE")}), 0.1))

    assert said("no hand seen for 0.4 s") == said("no hand seen for 12 s") == "Standing: no hand seen"
