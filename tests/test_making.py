from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import pytest

from handsteer.cameras import VIRTUAL_HAND, choose
from handsteer.clock import SteppedClock
from handsteer.config import Config
from handsteer.errors import CameraNotFound, HandsteerError
from handsteer.graph import Graph
from handsteer.making import make_camera, make_control, open_robot
from handsteer.messages import CMD_VEL, HAND_SIGN, String, Topic
from handsteer.nodes.control import HandSignControlNode
from handsteer.testing.faulty_camera import FaultyCamera
from handsteer.transports.in_process import InProcessTransport
from tests.nodes.stepping import Bench


def drives(choice: str, *, cmd_vel: str = CMD_VEL.name, simulated: bool = False) -> bool:
    """Return whether the first sign moves a robot on ``cmd_vel``, with that choice of arming and engaging."""
    bench = Bench()
    config = Config.model_validate({"control": {"arming": choice, "engage": choice}})
    topic = replace(CMD_VEL, name=cmd_vel)
    node = make_control(config, bench.transport, bench.clock, simulated=simulated, cmd_vel=topic)
    bench.nodes, twists = [node], bench.record(topic)
    signs = bench.transport.advertise("recognition", HAND_SIGN)
    for _ in range(60):
        signs.publish(String(data="Forward"), bench.clock.now())
        bench.run(1 / 30)
    return twists[-1].linear.x > 0.0


@pytest.mark.parametrize(
    ("choice", "cmd_vel", "simulated", "first_sign_drives"),
    [
        ("auto", CMD_VEL.name, False, False),
        ("auto", CMD_VEL.name, True, True),
        ("course", CMD_VEL.name, False, True),
        ("course", "/cmd_vel", False, False),
        ("course", "/real/robot_diff_drive_controller/cmd_vel", False, False),
        ("course", "/cmd_vel", True, True),
        ("on", CMD_VEL.name, True, False),
        ("off", "/cmd_vel", False, True),
    ],
)
def test_signs_drive_from_the_start_only_where_the_robot_is_known_to_be_simulated(
    choice: str, cmd_vel: str, simulated: bool, first_sign_drives: bool
) -> None:
    assert drives(choice, cmd_vel=cmd_vel, simulated=simulated) == first_sign_drives


@pytest.mark.parametrize(("choice", "simulated", "drives_on"), [("auto", False, False), ("auto", True, True)])
def test_a_sign_drives_for_ever_only_where_the_robot_is_known_to_be_simulated(
    choice: str, simulated: bool, drives_on: bool
) -> None:
    bench = Bench()
    config = Config.model_validate({"control": {"arming": "off", "engage": "off", "renew": choice, "renew_time": 2.0}})
    bench.nodes = [make_control(config, bench.transport, bench.clock, simulated=simulated)]
    twists = bench.record(CMD_VEL)
    signs = bench.transport.advertise("recognition", HAND_SIGN)
    for _ in range(80):
        signs.publish(String(data="Forward"), bench.clock.now())
        bench.run(1 / 30)
    assert (twists[-1].linear.x > 0.0) == drives_on


class Namespaced(InProcessTransport):
    """As in ROS, where all nodes are in /r1."""

    def full_name(self, node: str) -> str:
        return f"r1/{node}: {node}"

    def topic_name(self, topic: Topic[Any]) -> str:
        return f"/r1{topic.name}"


def test_the_courses_robot_may_be_in_the_namespace_of_its_control() -> None:
    config = Config.model_validate({"control": {"engage": "course", "arming": "course"}})
    node = make_control(config, Namespaced(), SteppedClock())
    assert isinstance(node, HandSignControlNode)
    assert node._report().engaged


@pytest.fixture
def no_webcam(monkeypatch: pytest.MonkeyPatch) -> Config:
    monkeypatch.setattr(choose, "webcams", lambda: [])
    return Config.model_validate({"camera": {"source": "auto", "width": 320, "height": 240}})


@pytest.mark.parametrize(
    "wrong",
    [{"signs": {"model": "/nowhere.npz"}}, {"camera": {"source": "/nowhere.mp4"}}, {"signs": {"profile": "no"}}],
)
def test_a_graph_that_cannot_start_closes_its_robot(wrong: dict[str, Any]) -> None:
    robot, closed = open_robot(Config(), SteppedClock()), []
    robot.close = lambda: closed.append(robot)  # type: ignore[method-assign]
    with pytest.raises(HandsteerError):
        Graph(Config.model_validate(wrong), SteppedClock(), robot=robot)
    assert closed == [robot]


def test_a_graph_that_cannot_start_closes_its_camera() -> None:
    camera = FaultyCamera([], SteppedClock())
    config = Config.model_validate({"camera": {"calibration": "/nowhere.yaml"}})
    with pytest.raises(HandsteerError):
        Graph(config, SteppedClock(), camera=camera)
    assert camera.closed


def test_a_robot_that_fails_at_the_start_is_closed() -> None:
    robot, closed = open_robot(Config(), SteppedClock()), []
    robot.close = lambda: closed.append(robot)  # type: ignore[method-assign]
    robot.step = Mock(side_effect=OSError)  # type: ignore[method-assign]
    with pytest.raises(OSError):
        Graph(Config(), SteppedClock(), robot=robot)
    assert closed == [robot]


def test_without_a_webcam_the_virtual_hand_drives_the_simulated_robot(no_webcam: Config) -> None:
    with Graph(no_webcam, SteppedClock()) as graph:
        assert graph.cameras.name == VIRTUAL_HAND


def test_without_a_webcam_no_virtual_hand_drives_what_may_be_a_real_robot(no_webcam: Config) -> None:
    bench, real = Bench(), open_robot(no_webcam, SteppedClock())
    with pytest.raises(CameraNotFound, match="has to be named"):
        make_camera(no_webcam, bench.transport, bench.clock)
    with pytest.raises(CameraNotFound, match="has to be named"):
        Graph(no_webcam, SteppedClock(), robot=real)
    named = no_webcam.model_copy(update={"camera": no_webcam.camera.model_copy(update={"source": "virtual"})})
    with Graph(named, SteppedClock(), robot=real) as graph:
        assert graph.cameras.name == VIRTUAL_HAND
