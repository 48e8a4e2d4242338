import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, ControlConfig, RobotConfig, SignsConfig, VirtualHandConfig
from handsteer.errors import ConfigError
from handsteer.graph import Graph
from handsteer.messages import AUDIT, CMD_VEL, HAND_SIGN, ODOM, TF, Log, Topic
from handsteer.testing import Trace
from handsteer.types import Pose2D


def drive(config: Config, duration_s: float = math.inf) -> tuple[Graph, Trace]:
    with Graph(config, SteppedClock()) as graph:
        trace = Trace(graph)
        graph.run_stepped(duration_s)
    return graph, trace


@pytest.fixture(scope="module")
def slideshow_drive(slideshow: Path) -> tuple[Graph, Trace]:
    return drive(Config(camera=CameraConfig(source=str(slideshow), at_end="end")))


@pytest.mark.slow
def test_people_in_a_video_drive_the_robot(slideshow_drive: tuple[Graph, Trace]) -> None:
    """The slide show: nobody, Stop, Forward, Go, Turn Right, nobody, Turn Left, nobody, Stop; 2.5 s each."""
    _, trace = slideshow_drive
    at_start, after_stop, after_forward, after_right, after_pause, after_left, after_none, at_end = (
        trace.pose_at(time_s) for time_s in (2.4, 5.0, 7.5, 12.5, 15.0, 17.5, 20.0, 22.4)
    )
    assert at_start == after_stop == Pose2D(0.0, 0.0, 0.0) or _moved(at_start, after_stop) < 1e-3
    assert after_forward.x - after_stop.x > 0.03
    assert abs(after_forward.yaw) < 0.05
    assert after_right.yaw < after_forward.yaw - 0.2
    # A turn of more than half a circle shows as one the other way round.
    assert (after_left.yaw - after_pause.yaw) % math.tau > 0.5
    assert _moved(after_none, at_end) < 0.01


def _moved(a: Pose2D, b: Pose2D) -> float:
    return math.hypot(b.x - a.x, b.y - a.y)


@pytest.mark.slow
def test_the_same_video_gives_the_same_drive(slideshow: Path, slideshow_drive: tuple[Graph, Trace]) -> None:
    _, first = slideshow_drive
    _, second = drive(Config(camera=CameraConfig(source=str(slideshow), at_end="end")), 10.0)
    assert second.commands == first.commands[: len(second.commands)]
    assert len(second.commands) > 100


@pytest.mark.slow
@pytest.mark.parametrize("handedness", ["Left", "Right"])
def test_the_virtual_hand_drives_a_course(handedness: str) -> None:
    """Forward, a turn to the left, on, stop: the pose ends where the signs lead."""
    config = Config(
        camera=CameraConfig(source="virtual"),
        virtual_hand=VirtualHandConfig.model_validate(
            {"script": "Forward:2 Go:1 Turn Left:1 Go:0.6 Forward:1 Go:1 Stop:3", "handedness": handedness}
        ),
        control=ControlConfig(max_linear=0.5, max_angular=1.0),
        robot=RobotConfig(world="empty"),
    )
    graph, trace = drive(config, 9.0)
    pose = graph.summary().final_pose
    expected = trace.dead_reckoning()
    assert pose is not None
    assert pose.x > 0.5
    assert pose.yaw > 0.5
    assert _moved(pose, expected) < 0.15
    assert pose.yaw == pytest.approx(expected.yaw, abs=0.2)
    assert trace.commands[-1] == (0.0, 0.0)


@pytest.fixture(scope="module")
def short() -> Graph:
    with Graph(Config(camera=CameraConfig(source="virtual", width=320, height=240)), SteppedClock()) as graph:
        graph.run_stepped(1.0)
    return graph


def test_summary_is_json(short: Graph) -> None:
    summary = json.loads(json.dumps(short.summary().as_dict()))
    assert summary["frames"] == 31
    assert summary["latency_median_ms"] is None
    assert sum(summary["signs"].values()) == 31
    assert summary["callback_errors"] == 0
    assert set(summary["final_pose"]) == {"x", "y", "yaw"}


def test_topics_and_rates() -> None:
    with Graph(Config(camera=CameraConfig(source="virtual", width=160, height=120)), SteppedClock()) as graph:
        counts = {HAND_SIGN.name: 0, CMD_VEL.name: 0, ODOM.name: 0, TF.name: 0}

        def count(name: str, _: object) -> None:
            counts[name] += 1

        topics: tuple[Topic[Any], ...] = (HAND_SIGN, CMD_VEL, ODOM, TF)
        for topic in topics:
            graph.transport.subscribe("test", topic, partial(count, topic.name))
        graph.run_stepped(2.0)
    assert counts[HAND_SIGN.name] in (60, 61)
    assert counts[CMD_VEL.name] == counts[HAND_SIGN.name] + 1, "one a sign, and one zero at the end"
    assert counts[ODOM.name] in (100, 101)
    assert counts[TF.name] == counts[ODOM.name]


@pytest.mark.slow
@pytest.mark.parametrize(
    "control",
    [
        {"mode": "joystick"},
        {"mode": "joystick", "engage": "on", "arming": "on"},
        {"mode": "joystick", "engage": "on", "engage_by": "hold"},
        {"engage": "on", "arming": "on"},
        {"engage": "on", "engage_by": "hold"},
        {"rule": "point"},
        {"rule": "point", "engage": "on", "arming": "on"},
        {"ramp": "per_second"},
    ],
    ids=lambda control: " ".join(map(str, control.values())),
)
def test_the_virtual_hand_drives_in_every_mode_without_a_script(control: dict[str, str]) -> None:
    camera = {"source": "virtual", "width": 320, "height": 240}
    config = Config.model_validate({"camera": camera, "control": control, "robot": {"world": "empty"}})
    with Graph(config, SteppedClock()) as graph:
        graph.run_stepped(14.0)
    assert graph.summary().path_length_m > 0.3


def test_a_real_clock_cannot_be_stepped() -> None:
    with (
        Graph(Config(camera=CameraConfig(source="virtual"))) as graph,
        pytest.raises(ConfigError, match="a stepped run needs"),
    ):
        graph.run_stepped(1.0)


def test_in_real_time_latency_is_measured_and_the_end_is_a_zero() -> None:
    commands: list[float] = []
    with Graph(Config(camera=CameraConfig(source="virtual", width=320, height=240))) as graph:
        graph.transport.subscribe("test", CMD_VEL, lambda received: commands.append(received.message.linear.x))
        graph.start()
        graph.wait(2.0)
    summary = graph.summary()
    assert summary.latency_median_ms is not None
    assert summary.latency_p99_ms is not None
    assert 0 < summary.latency_median_ms <= summary.latency_p99_ms
    assert commands[-1] == 0.0


def test_a_wait_for_what_is_not_a_number_ends() -> None:
    with Graph(Config(camera=CameraConfig(source="virtual"))) as graph:
        graph.wait(math.nan)


def test_changed_parameters_are_in_the_audit_with_who_changed_them() -> None:
    with Graph(Config(), SteppedClock()) as graph:
        told: list[Log] = []
        graph.transport.subscribe("listener", AUDIT, lambda received: told.append(received.message))
        slower = graph.config.control.model_copy(update={"max_linear": 0.3, "linear_step": 0.02})
        graph.reconfigure(graph.config.model_copy(update={"control": slower}), "viewer 1")
        graph.reconfigure(graph.config)
    assert {(each.function, each.name) for each in told} == {("setting_changed", "viewer 1")}
    assert sorted(each.msg for each in told) == [
        "changed control.linear_step from 0.01 to 0.02",
        "changed control.max_linear from 1 to 0.3",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"min_confidence": 0.8}, {"min_confidence": 0.8, "confirm_time": 0.3}])
def test_a_held_hand_does_not_drive_because_it_is_read_now(change: dict[str, float]) -> None:
    settings = {"arming": "on", "engage": "off", "renew": "off"}
    signs = {"min_confidence": 1.0, "release_confidence": 1.0}
    script = {"script": "Stop:1 Forward:600"}
    config = Config.model_validate(
        {"camera": {"source": "virtual"}, "control": settings, "signs": signs, "virtual_hand": script}
    )

    with Graph(config, SteppedClock()) as graph:
        graph.run_stepped(4.0)
        graph.reconfigure(graph.config.model_copy(update={"signs": SignsConfig.model_validate(change)}))
        graph.run_stepped(4.0)
        assert graph.recognition.counts["Forward"] > 60
        assert graph.robot.path_length_m < 0.001
