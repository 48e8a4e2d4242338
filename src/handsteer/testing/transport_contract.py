"""What every transport must do; each transport's own test module inherits it, those of plug-ins too. Needs pytest."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

import numpy as np
import pytest

from handsteer.audit import WARN, AuditEvent, write_event
from handsteer.clock import Clock, RealClock, WallClock
from handsteer.errors import TransportError
from handsteer.images import bgr_image, image_message
from handsteer.messages import (
    AUDIT,
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    ROBOT_DESCRIPTION,
    SCAN,
    Header,
    Image,
    LaserScan,
    Log,
    String,
    Time,
    Topic,
    twist,
)
from handsteer.nodes.base import Node
from handsteer.nodes.diagnostics import split_reporter
from handsteer.transports.base import Publisher, Received, Session, Transport

M = TypeVar("M")
WAIT_S = 10.0
WORDS = Topic("/words", String)


def eventually(condition: Callable[[], object]) -> bool:
    """Return whether ``condition`` comes true: a transport may need time to bring both ends together."""
    deadline_s = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.005)
    return True


def _set(event: threading.Event, _: object) -> None:
    event.set()


def heard(publisher: Publisher[M]) -> Publisher[M]:
    """Return ``publisher`` once a node listens."""
    assert eventually(lambda: publisher.has_subscribers)
    return publisher


class TransportContract:
    """Inherit, and provide ``transport``.

    Attributes:
        settle_s: How long a message may take that must not arrive.
    """

    settle_s = 0.0

    def name_of(self, node: str) -> str:
        """Return what the graph calls the node of this process that is named ``node``."""
        return node

    @pytest.fixture
    def transport(self) -> Iterator[Transport]:
        raise NotImplementedError

    @pytest.fixture
    def clock(self) -> Clock:
        return RealClock()

    @pytest.fixture
    def make_node(self, transport: Transport, clock: Clock) -> Iterator[Callable[[str], Node]]:
        nodes = []

        def make(name: str) -> Node:
            nodes.append(Node(name, transport, clock))
            return nodes[-1]

        yield make
        for node in nodes:
            node.stop()
        transport.close()

    def test_a_message_arrives_with_its_capture_time(self, make_node: Callable[[str], Node]) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        got: list[Received[Image]] = []
        arrived = threading.Event()

        def callback(received: Received[Image]) -> None:
            got.append(received)
            arrived.set()

        listener.subscribe(IMAGE_RAW, callback)
        listener.start()
        captured_s = talker.clock.now() - 0.25
        header = Header(stamp=talker.clock.stamp(captured_s), frame_id="camera")
        picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
        heard(talker.publisher(IMAGE_RAW)).publish(image_message(picture, header), captured_s)
        assert arrived.wait(WAIT_S)
        assert got[0].captured_s == pytest.approx(captured_s, abs=0.01)
        assert got[0].message.header == header
        assert bgr_image(got[0].message).tolist() == picture.tolist()

    def test_a_message_without_a_header_keeps_its_capture_time_or_has_none(
        self, make_node: Callable[[str], Node]
    ) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        got: list[Received[String]] = []
        listener.subscribe(HAND_SIGN, got.append)
        listener.start()
        heard(talker.publisher(HAND_SIGN)).publish(String(data="Go"), captured_s=12.5)
        assert eventually(lambda: got)
        assert got[0].message == String(data="Go")
        assert got[0].captured_s in {12.5, None}

    def test_an_event_of_the_audit_arrives(self, make_node: Callable[[str], Node]) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        got: list[Received[Log]] = []
        listener.subscribe(AUDIT, got.append)
        listener.start()
        sent = write_event(AuditEvent("stopped", "viewer 1", "pressed Stop", "/stop", WARN), Time(12, 500))
        heard(talker.publisher(AUDIT)).publish(sent)
        assert eventually(lambda: got)
        assert got[0].message == sent

    def test_a_laser_scan_arrives_whole(self, make_node: Callable[[str], Node]) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        got: list[Received[LaserScan]] = []
        listener.subscribe(SCAN, got.append)
        listener.start()
        header = Header(stamp=talker.clock.stamp(talker.clock.now()), frame_id="base_scan")
        ranges = np.array([1.5, np.inf, -np.inf, np.nan], np.float32)
        sent = LaserScan(header, -3.0, 3.0, 2.0, 0.0, 0.1, 0.05, 8.0, ranges, np.zeros(0, np.float32))
        heard(talker.publisher(SCAN)).publish(sent)
        assert eventually(lambda: got)
        assert got[0].message.header == header
        assert got[0].message.angle_increment == 2.0
        np.testing.assert_array_equal(got[0].message.ranges, ranges)

    def test_several_messages_wait_for_a_busy_subscriber_where_the_topic_has_depth(
        self, make_node: Callable[[str], Node]
    ) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        started, let_go = threading.Event(), threading.Event()
        got: list[str] = []

        def callback(received: Received[String]) -> None:
            got.append(received.message.data)
            started.set()
            assert let_go.wait(WAIT_S)

        listener.subscribe(HAND_SIGN, callback)
        listener.start()
        publisher = heard(talker.publisher(HAND_SIGN))
        publisher.publish(String(data="first"))
        assert started.wait(WAIT_S)
        for number in range(HAND_SIGN.depth):
            publisher.publish(String(data=str(number)))
        time.sleep(self.settle_s)
        let_go.set()
        assert eventually(lambda: len(got) == 1 + HAND_SIGN.depth)
        assert got == ["first", *map(str, range(HAND_SIGN.depth))]

    def test_every_subscriber_gets_it(self, make_node: Callable[[str], Node]) -> None:
        talker = make_node("talker")
        arrived = [threading.Event() for _ in range(3)]
        for number, event in enumerate(arrived):
            listener = make_node(f"listener_{number}")
            listener.subscribe(HAND_SIGN, partial(_set, event))
            listener.start()
        heard(talker.publisher(HAND_SIGN)).publish(String(data="Stop"))
        assert all(event.wait(WAIT_S) for event in arrived)

    def test_a_busy_subscriber_blocks_nobody_and_gets_the_newest_only(self, make_node: Callable[[str], Node]) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        started, let_go, done = threading.Event(), threading.Event(), threading.Event()
        got: list[str] = []

        def callback(received: Received[String]) -> None:
            got.append(received.message.data)
            started.set()
            assert let_go.wait(WAIT_S)
            if received.message.data == "last":
                done.set()

        listener.subscribe(WORDS, callback)
        listener.start()
        publisher = heard(talker.publisher(WORDS))
        publisher.publish(String(data="first"))
        assert started.wait(WAIT_S)
        for number in range(100):
            publisher.publish(String(data=str(number)))
        publisher.publish(String(data="last"))
        time.sleep(self.settle_s)
        let_go.set()
        assert done.wait(WAIT_S)
        assert got == ["first", "last"]

    def test_a_callback_that_raises_is_logged_and_counted_and_the_node_goes_on(
        self, make_node: Callable[[str], Node], caplog: pytest.LogCaptureFixture
    ) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        failed, arrived = threading.Event(), threading.Event()

        def callback(received: Received[String]) -> None:
            if received.message.data == "bad":
                failed.set()
                raise RuntimeError("boom")
            arrived.set()

        listener.subscribe(HAND_SIGN, callback)
        listener.start()
        publisher = heard(talker.publisher(HAND_SIGN))
        publisher.publish(String(data="bad"))
        assert failed.wait(WAIT_S)
        publisher.publish(String(data="good"))
        assert arrived.wait(WAIT_S)
        assert listener.callback_errors == 1
        assert "/gesture/hand_sign" in caplog.text

    def test_wanted_tells_whether_anybody_listens(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", CMD_VEL)
        assert not publisher.has_subscribers
        subscription = transport.subscribe("listener", CMD_VEL, lambda _: None)
        assert eventually(lambda: publisher.has_subscribers)
        subscription.close()
        subscription.close()
        assert eventually(lambda: not publisher.has_subscribers)

    def test_a_late_subscriber_gets_the_last_message_of_a_latched_topic(self, transport: Transport) -> None:
        publisher = transport.advertise("robot", ROBOT_DESCRIPTION)
        publisher.publish(String(data="<old/>"))
        publisher.publish(String(data="<robot/>"))
        got: list[str] = []
        transport.subscribe("late", ROBOT_DESCRIPTION, lambda received: got.append(received.message.data))
        assert eventually(lambda: got)
        assert got == ["<robot/>"]
        again: list[str] = []
        transport.subscribe("later", ROBOT_DESCRIPTION, lambda received: again.append(received.message.data))
        assert eventually(lambda: again)
        assert again == ["<robot/>"]

    def test_a_closed_subscription_gets_nothing(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", HAND_SIGN)
        got: list[object] = []
        subscription = transport.subscribe("listener", HAND_SIGN, got.append)
        heard(publisher)
        subscription.close()
        publisher.publish(String(data="Go"))
        time.sleep(self.settle_s)
        assert got == []

    def test_a_message_of_another_type_is_refused(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", HAND_SIGN)
        with pytest.raises(TransportError, match=r"/gesture/hand_sign carries std_msgs/msg/String, not geometry_msgs"):
            publisher.publish(twist(0.0, 0.0))  # type: ignore[arg-type]

    def test_a_topic_has_one_type(self, transport: Transport) -> None:
        transport.advertise("talker", HAND_SIGN)
        with pytest.raises(TransportError, match="cannot carry geometry_msgs/msg/Twist too"):
            transport.subscribe("listener", Topic("/gesture/hand_sign", CMD_VEL.type), lambda _: None)

    def test_nothing_arrives_after_close(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", HAND_SIGN)
        got: list[object] = []
        transport.subscribe("listener", HAND_SIGN, got.append)
        heard(publisher)
        transport.close()
        transport.close()
        publisher.publish(String(data="Go"))
        time.sleep(self.settle_s)
        assert got == []

    def test_it_tells_who_publishes_a_topic(self, transport: Transport) -> None:
        assert transport.publishers_of(CMD_VEL) == []
        publishers = [transport.advertise("talker", topic) for topic in (CMD_VEL, HAND_SIGN)]
        assert eventually(lambda: len(transport.publishers_of(CMD_VEL)) == 1)
        (name,) = transport.publishers_of(CMD_VEL)
        assert name == self.name_of("talker")
        transport.subscribe("listener", CMD_VEL, lambda _: None)
        assert transport.publishers_of(CMD_VEL) == [name]
        assert transport.publishers_of(WORDS) == []
        transport.close()
        assert transport.publishers_of(HAND_SIGN) == []
        assert len(publishers) == 2

    def test_a_node_is_known_by_its_own_name(self, transport: Transport) -> None:
        assert split_reporter(transport.full_name("my_camera"))[1] == "my_camera"


class SessionContract(TransportContract):
    """Inherit, and provide ``session``: this process as a node whose name is ``full_name``."""

    settle_s = 0.3
    full_name = "/r1/tests"

    def name_of(self, node: str) -> str:
        return self.full_name

    @pytest.fixture
    def session(self) -> Iterator[Session]:
        raise NotImplementedError

    @pytest.fixture
    def transport(self, session: Session) -> Transport:
        return session.transport

    @pytest.fixture
    def clock(self, session: Session) -> Clock:
        assert isinstance(session.clock, WallClock)
        return session.clock

    def test_the_process_has_its_full_name(self, session: Session) -> None:
        assert session.name == self.full_name
        assert session.transport.full_name("my_camera") == f"{self.full_name[1:]}: my_camera"
