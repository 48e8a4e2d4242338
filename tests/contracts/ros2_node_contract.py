"""What our nodes must do as processes in every graph of ROS 2; each transport's own test module inherits it."""

import itertools
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import partial
from typing import Any

import pytest

from tests.contracts.node_contract import (
    CMD_VEL,
    ODOM,
    VIRTUAL,
    ControlContract,
    Driver,
    MakeDriver,
    Running,
    Twists,
    twists,
)
from tests.processes import Peer, Process, Processes, as_tests_drive, eventually

NODE = "hand_sign_control"
SCRIPT = ("-p", "virtual_hand.script:=Forward:25 Stop:1.5")
"""Neutral again and again: a pause of a busy machine may have required it, as of odometry that was silent."""
SETTLE_S = 0.3
"""One end sees the other first; the other follows within milliseconds."""

_numbers = itertools.count()


class PeerGraph(Processes, ABC):
    """The processes of a test in a graph of ROS 2, with one plain program among them that looks on.

    Attributes:
        env: Environment of the processes.
        peer: The plain program.
        transport: What joins our nodes.
    """

    env: dict[str, str]
    peer: Peer
    transport: str

    @abstractmethod
    def start_peer(self) -> Peer:
        """Start a plain program; wait until it is ready."""

    @abstractmethod
    def handsteer(self, *arguments: str) -> Process:
        """Start ``handsteer`` with ``arguments`` in this graph."""

    @abstractmethod
    def publishes(self, node: str, topic: str) -> bool:
        """Return whether the plain program knows that the node of this full name publishes ``topic``."""

    def node(self, verb: str, *arguments: str, name: str, ros: tuple[str, ...] = ()) -> Process:
        """Start one of handsteer's nodes and wait until it is in the graph under ``name``."""
        words = ("--ros-args", *ros) if ros else ()
        process = self.handsteer(verb, "--transport", self.transport, *as_tests_drive(verb, arguments), *words)
        eventually(lambda: name in self.nodes() or not process.running, what=f"{name} to start")
        assert process.running, process.text
        return process

    def nodes(self) -> dict[str, Any]:
        """Return the nodes as the plain program knows them: what they publish and subscribe to."""
        return dict(self.peer.ask("graph"))


class DdsDriver(Driver):
    """Shows signs by the plain program, whatever joins it; with ``kept_stop``, it has published a Stop before."""

    def __init__(
        self, graph: PeerGraph, *options: str, parameters: Mapping[str, Any] | None = None, kept_stop: bool = False
    ) -> None:
        namespace = f"/n{next(_numbers)}"
        self.signs, self.cmd_vel, self._peer = f"{namespace}/gesture/hand_sign", f"{namespace}{CMD_VEL}", graph.peer
        self._joy = f"{namespace}/gesture/joy"
        self._is_joystick = (parameters or {}).get("mode") == "joystick"
        record_twists(graph.peer, self.cmd_vel)
        self.stop = f"{namespace}/stop"
        if kept_stop:
            graph.peer.ask("advertise", topic=self.stop, type="Bool", latched=True, depth=1)
            graph.peer.ask("publish", topic=self.stop, values={"data": True})
        graph.peer.ask("advertise", topic=self.signs, type="String")
        if self._is_joystick:
            graph.peer.ask("advertise", topic=self._joy, type="Joy")
        words = [word for name, value in (parameters or {}).items() for word in ("-p", f"{name}:={value}")]
        ros = ("-r", f"__ns:={namespace}", *words)
        self.process = graph.node("control", *options, name=f"{namespace}/{NODE}", ros=ros)
        eventually(lambda: graph.peer.ask("listeners", topic=self.signs) > 0)
        eventually(lambda: graph.publishes(f"{namespace}/{NODE}", self.cmd_vel))
        # One end sees the other first; with Fast DDS the other follows up to three seconds later.
        eventually(self._is_heard, what="the control to hear the signs")
        time.sleep(2 * SETTLE_S)
        self._before = len(twists(self._peer, self.cmd_vel))

    def _is_heard(self) -> bool:
        if self._is_joystick:
            self.hold(0.0, 0.0, held=False)
        else:
            self.show("NONE")
        return bool(twists(self._peer, self.cmd_vel))

    def show(self, sign: str, count: int = 1, period_s: float = 0.02) -> None:
        self._peer.ask("publish", topic=self.signs, values={"data": sign}, count=count, period_s=period_s)

    def hold(self, left: float, forward: float, *, held: bool = True) -> None:
        values = {"axes": [left, forward], "buttons": [int(held)]}
        self._peer.ask("publish", topic=self._joy, values=values, period_s=0.02)

    def show_raw(self, raw: bytes) -> None:
        self._peer.ask("publish_raw", topic=self.signs, hex=raw.hex())

    def interfere(self) -> None:
        self._peer.ask("advertise", topic=self.cmd_vel, type="Twist")

    @property
    def commands(self) -> Twists:
        return twists(self._peer, self.cmd_vel)[self._before :]


def record_twists(peer: Peer, topic: str = CMD_VEL) -> None:
    peer.ask("record", topic=topic, type="Twist", fields=["linear.x", "angular.z"])


def driving_chain(graph: PeerGraph) -> Running:
    """Return all nodes, not started yet."""
    record_twists(graph.peer)
    fields = ["twist.twist.linear.x", "pose.pose.position.x"]
    graph.peer.ask("record", topic=ODOM, type="Odometry", fields=fields)
    start = {
        "robot": lambda: graph.node("robot", "--world", "empty", name="/robot"),
        "control": lambda: graph.node("control", name=f"/{NODE}", ros=("-p", "max_linear:=0.3")),
        "recognition": lambda: graph.node("recognition", name="/hand_sign_recognition"),
        "camera": lambda: graph.node("camera", *VIRTUAL, name="/my_camera", ros=SCRIPT),
    }
    return Running(graph.peer, start)


class Ros2NodeContract(ControlContract):
    """Inherit, and provide ``graph``.

    Attributes:
        images: A topic of a camera whose images reach the plain program, and its type.
    """

    images = ("image_raw", "Image")

    @pytest.fixture
    def graph(self) -> PeerGraph:
        raise NotImplementedError

    @pytest.fixture
    def drive(self, graph: PeerGraph) -> MakeDriver:
        return partial(DdsDriver, graph)

    def test_what_is_no_text_does_not_end_the_node(self, graph: PeerGraph) -> None:
        driver = DdsDriver(graph)
        driver.show_raw(b"\x00\x01\x00\x00\x03\x00\x00\x00\xff\xfe\x00\x00")
        driver.show("Turn Left")
        driver.expect((0.0, 0.1))
        assert "a message of 12 bytes cannot be read" in driver.process.text
        assert "Traceback" not in driver.process.text

    def test_a_stop_that_was_kept_stops_a_control_that_starts_later(self, graph: PeerGraph) -> None:
        driver = DdsDriver(graph, parameters={"sign_timeout": 5.0}, kept_stop=True)
        driver.show("Forward", count=3)
        eventually(lambda: len(driver.twists) >= 3, what="a twist for each sign")
        assert set(driver.twists) == {(0.0, 0.0)}
        graph.peer.ask("publish", topic=driver.stop, values={"data": False})
        driver.show("Stop", count=5, period_s=0.1)
        driver.show("Forward")
        eventually(lambda: driver.twists[-1] == (0.01, 0.0), what="the robot to be driven after the reset")
        assert "nothing passes" not in driver.process.text

    def test_a_late_subscriber_gets_the_description_of_the_robot(self, graph: PeerGraph) -> None:
        topic = "/late/robot_description"
        graph.node("robot", name="/late/robot", ros=("-r", "__ns:=/late"))
        eventually(lambda: graph.publishes("/late/robot", topic))
        graph.peer.ask("record", topic=topic, type="String", fields=["data"], latched=True)
        [[_, [description]]] = eventually(lambda: graph.peer.ask("get", topic=topic))
        assert "<robot" in description

    def test_a_robot_follows_another_programs_twists(self, graph: PeerGraph) -> None:
        peer, odom = graph.peer, f"/lone{ODOM}"
        graph.node("robot", name="/lone/robot", ros=("-r", "__ns:=/lone", "-r", f"{CMD_VEL[1:]}:=/lone/cmd_vel"))
        fields = ["twist.twist.angular.z", "pose.pose.orientation.z"]
        peer.ask("record", topic=odom, type="Odometry", fields=fields, reliable=False)
        peer.ask("advertise", topic="/lone/cmd_vel", type="Twist")
        eventually(lambda: peer.ask("listeners", topic="/lone/cmd_vel") > 0)
        eventually(lambda: peer.ask("get", topic=odom))

        def turns_left() -> bool:
            peer.ask("publish", topic="/lone/cmd_vel", values={"angular.z": 0.5}, count=10, period_s=0.05)
            noted: list[Any] = [values for _, values in peer.ask("get", topic=odom)]
            return bool(noted[-1][1] > 0.1 and max(speed for speed, _ in noted) == pytest.approx(0.5, abs=0.05))

        eventually(turns_left, 20.0, what="the robot to turn")
        eventually(lambda: abs(peer.ask("get", topic=odom)[-1][1][0]) < 0.01, 5.0, what="the robot to stand")

    def test_simulated_time_is_followed(self, graph: PeerGraph) -> None:
        peer, (name, kind) = graph.peer, self.images
        topic = f"/simulated/{name}"
        peer.ask("advertise", topic="/clock", type="Clock", reliable=False, depth=1)
        peer.ask("record", topic=topic, type=kind, fields=["header.stamp"], reliable=False)
        words = ("-r", "__ns:=/simulated", "-p", "use_sim_time:=true")
        camera = graph.node("camera", *VIRTUAL, name="/simulated/my_camera", ros=words)
        eventually(lambda: peer.ask("listeners", topic="/clock") > 0)
        for values in ({"clock.sec": 2**31 - 1, "clock.nanosec": 2**32 - 1}, {"clock.sec": -1}):
            peer.ask("publish", topic="/clock", values=values, count=5, period_s=0.05)
        peer.ask("run_clock", from_s=1000.0, seconds=30.0)
        eventually(lambda: [v for _, (v,) in peer.ask("get", topic=topic) if 1000.0 < v < 1040.0], 15.0)
        assert camera.running
        assert camera.text.count("/clock: a message with ") == 1
        assert "Traceback" not in camera.text
