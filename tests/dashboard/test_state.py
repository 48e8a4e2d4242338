import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.control.sign_control import ZERO, Velocity
from handsteer.dashboard.panels.steer import read_deflection
from handsteer.dashboard.panels.velocity import bar
from handsteer.dashboard.state import (
    STALE_S,
    Observed,
    Report,
    camera_name,
    compose,
    explain,
    frame_rate,
    place_in_world,
)
from handsteer.robots.protocol import Pose2D

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


@given(commanded=FINITE, measured=FINITE, scale=st.sampled_from([1.0, 2.0, -2.0]))
def test_a_bar_stays_in_its_track_and_ends_at_its_value(commanded: float, measured: float, scale: float) -> None:
    shown = bar(commanded, measured, scale)
    assert 0 <= shown.left <= shown.left + shown.width <= 100.1
    assert 0 <= shown.mark <= 100
    end = shown.left if measured / scale < 0 else shown.left + shown.width
    assert end == pytest.approx(50 + 50 * max(-1, min(measured / scale, 1)), abs=0.11)


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
