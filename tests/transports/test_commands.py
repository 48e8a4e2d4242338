"""Which of two types velocity commands go out as, by what a graph tells of its subscribers."""

import logging
from functools import partial
from typing import Any

import pytest

from handsteer.clock import SteppedClock
from handsteer.config import ControlConfig
from handsteer.messages import CMD_VEL, STEERING_CMD_VEL, Topic, Twist, TwistStamped, cmd_vel, twist, twist_in
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.steering import SteeringNode
from handsteer.transports.base import KnowsTypes
from handsteer.transports.commands import Commands
from handsteer.transports.in_process import InProcessTransport, TopicTypes

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
FORWARD = (TWIST, 0.2)


class TellingTransport(InProcessTransport):
    """Tells of subscribers of other processes, and notes what these get: the type, and m/s."""

    def __init__(self) -> None:
        super().__init__()
        self.takes: dict[str, set[str]] = {}
        self.got: list[tuple[str, float]] = []

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        return self.takes.get(topic.name, set())

    def withdraw(self, publisher: Any) -> None:
        publisher.is_open = False

    def advertise(self, node: str, topic: Topic[Any]) -> Any:
        return Far(topic, self) if topic.type in {Twist, TwistStamped} else super().advertise(node, topic)


class Far:
    """A sending end whose subscribers are in other processes."""

    def __init__(self, topic: Topic[Any], transport: TellingTransport) -> None:
        self._topic = topic
        self._transport = transport
        self.is_open = True

    @property
    def has_subscribers(self) -> bool:
        return self._topic.type.__msgtype__ in self._transport.subscribed_types(self._topic)

    def publish(self, message: Any, captured_s: float | None = None) -> None:
        assert self.is_open
        assert isinstance(message, self._topic.type)
        if self.has_subscribers:
            self._transport.got.append((message.__msgtype__, twist_in(message).linear.x))


class Bench:
    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.transport = TellingTransport()
        assert isinstance(self.transport, KnowsTypes)

    def commands(self, kind: str = "auto") -> Commands:
        advertise = partial(self.transport.advertise, "test")
        topic: Topic[Any] = cmd_vel(kind)  # type: ignore[arg-type]
        return Commands(self.transport, advertise, topic, self.clock, "base_link")

    def takes(self, *kinds: str, topic: str = CMD_VEL.name) -> None:
        """Let subscribers take these types from now on, and time pass until that is looked at again."""
        self.transport.takes[topic] = set(kinds)
        self.clock.advance(0.3)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_they_go_out_as_what_is_taken_and_who_was_commanded_before_stands(bench: Bench) -> None:
    commands = bench.commands()
    assert not commands.follow()
    for kind, changes in ((TWIST, False), (STAMPED, True), (TWIST, True), (TWIST, False)):
        bench.takes(kind)
        assert commands.follow() is changes
        assert not commands.follow()
        commands.send(0.2, 0.0)
    assert bench.transport.got == [FORWARD, (STAMPED, 0.2), FORWARD, FORWARD]


def test_nobody_changes_nothing(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    commands = bench.commands()
    bench.takes(STAMPED)
    assert commands.follow()
    bench.takes()
    assert not commands.follow()
    bench.takes("std_msgs/msg/String")
    assert not commands.follow()
    bench.takes(STAMPED)
    commands.send(0.2, 0.0)
    assert bench.transport.got == [(STAMPED, 0.2)]
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_where_both_are_taken_one_is_left_standing_and_this_is_said_once(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    commands = bench.commands()
    bench.takes(TWIST)
    commands.follow()
    commands.send(0.2, 0.0)
    for _ in range(3):
        bench.takes(TWIST, STAMPED)
        commands.follow()
        commands.send(0.2, 0.0)
    assert bench.transport.got == [FORWARD, (TWIST, 0.0), *[(STAMPED, 0.2)] * 3]
    assert [line for line in caplog.messages if "take both" in line] == [
        f"{CMD_VEL.name}: subscribers take both {STAMPED} and {TWIST}; commands go out as {STAMPED} only: end the "
        "others, or set cmd_vel_type"
    ]


@pytest.mark.parametrize("kind", ["twist", "twist_stamped"])
def test_what_was_asked_for_is_kept(bench: Bench, kind: str) -> None:
    commands = bench.commands(kind)
    bench.takes(TWIST)
    bench.takes(STAMPED)
    assert not commands.follow()


def test_where_the_graph_cannot_tell_it_is_a_twist() -> None:
    transport, clock = InProcessTransport(), SteppedClock()
    got: list[Any] = []
    transport.subscribe("robot", cmd_vel("auto"), got.append)
    commands = Commands(transport, partial(transport.advertise, "test"), cmd_vel("auto"), clock, "base_link")
    assert not commands.follow()
    commands.send(0.2, 0.0)
    assert [received.message for received in got] == [twist(0.2, 0.0)]


def test_steering_has_to_let_go_before_it_drives_another_robot(bench: Bench) -> None:
    node = SteeringNode(bench.transport, bench.clock, ControlConfig(), cmd_vel("auto"))
    bench.transport.takes[STEERING_CMD_VEL.name] = set()

    def steer(speed: float) -> None:
        bench.clock.advance(0.1)
        node.steer(speed, 0.0)
        node.spin_once()

    bench.takes(TWIST, topic="/cmd_vel")
    node.send_to("/cmd_vel")
    steer(0.0)
    steer(0.2)
    assert FORWARD in bench.transport.got
    bench.transport.takes["/cmd_vel"] = {STAMPED}
    for _ in range(8):  # never letting go
        steer(0.2)
    assert {kind for kind, _ in bench.transport.got[-5:]} == {STAMPED}
    assert {speed for kind, speed in bench.transport.got if kind == STAMPED} == {0.0}
    steer(0.0)
    steer(0.2)
    assert bench.transport.got[-1] == (STAMPED, 0.2)


def test_each_of_several_robots_is_sent_what_it_takes(bench: Bench) -> None:
    config = ControlConfig(robots=("r1", "r2"), actions={"Peace": "next_robot"})
    node = HandSignControlNode(bench.transport, bench.clock, config, cmd_vel("auto"))
    bench.takes(TWIST, topic=f"/r1{CMD_VEL.name}")
    bench.takes(STAMPED, topic=f"/r2{CMD_VEL.name}")
    node.spin_once()
    assert node._selection is not None
    node._selection.select("r2")
    bench.clock.advance(0.1)
    node.spin_once()
    node.on_stop()
    assert (STAMPED, 0.0) in bench.transport.got
    assert (TWIST, 0.0) in bench.transport.got


def test_a_topic_is_free_for_another_type_when_all_have_let_go() -> None:
    types = TopicTypes()
    topic = cmd_vel("twist")
    types.claim("/x", topic)
    assert not types.is_shared("/x")
    types.claim("/x", topic)
    assert types.is_shared("/x")
    types.release("/x")
    types.release("/x")
    types.claim("/x", cmd_vel("twist_stamped"))
