"""What drives our nodes in a DDS domain, and notes what they do; the domain's peer may be of any make."""

import itertools
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from tests.contracts.node_contract import CMD_VEL, FORWARD, ODOM, Driver, Running, Twists, twists
from tests.processes import Peer, Process, Processes, as_tests_drive, eventually

NODE = "hand_sign_control"
SCRIPT = ("-p", "virtual_hand.script:=Forward:60")
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
    def __init__(self, graph: PeerGraph, *options: str, parameters: Mapping[str, Any] | None = None) -> None:
        namespace = f"/n{next(_numbers)}"
        self.signs, self.cmd_vel, self._peer = f"{namespace}/gesture/hand_sign", f"{namespace}{CMD_VEL}", graph.peer
        self._joy = f"{namespace}/gesture/joy"
        self._is_joystick = (parameters or {}).get("mode") == "joystick"
        record_twists(graph.peer, self.cmd_vel)
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
        "camera": lambda: graph.node("camera", *FORWARD, name="/my_camera", ros=SCRIPT),
    }
    return Running(graph.peer, start)
