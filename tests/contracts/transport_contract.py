"""What every transport must do; each transport's own test module inherits it."""

import threading
from collections.abc import Callable, Iterator

import pytest

from handsteer.clock import RealClock
from handsteer.errors import TransportError
from handsteer.messages import CMD_VEL, HAND_SIGN, ROBOT_DESCRIPTION, String, Topic, twist
from handsteer.nodes.node import Node
from handsteer.transports.protocol import Received, Transport

WAIT_S = 5.0


class TransportContract:
    """Inherit, and provide ``transport``."""

    @pytest.fixture
    def transport(self) -> Iterator[Transport]:
        raise NotImplementedError

    @pytest.fixture
    def make_node(self, transport: Transport) -> Iterator[Callable[[str], Node]]:
        nodes = []

        def make(name: str) -> Node:
            nodes.append(Node(name, transport, RealClock()))
            return nodes[-1]

        yield make
        for node in nodes:
            node.stop()
        transport.close()

    def test_a_message_arrives_with_its_capture_time(self, make_node: Callable[[str], Node]) -> None:
        talker, listener = make_node("talker"), make_node("listener")
        got: list[Received[String]] = []
        arrived = threading.Event()

        def callback(received: Received[String]) -> None:
            got.append(received)
            arrived.set()

        listener.subscribe(HAND_SIGN, callback)
        listener.start()
        talker.publisher(HAND_SIGN).publish(String(data="Go"), captured_s=12.5)
        assert arrived.wait(WAIT_S)
        assert got == [Received(String(data="Go"), 12.5)]

    def test_every_subscriber_gets_it(self, make_node: Callable[[str], Node]) -> None:
        talker = make_node("talker")
        arrived = [threading.Event() for _ in range(3)]
        for number, event in enumerate(arrived):
            listener = make_node(f"listener_{number}")
            listener.subscribe(HAND_SIGN, lambda _, event=event: event.set())  # type: ignore[misc]
            listener.start()
        talker.publisher(HAND_SIGN).publish(String(data="Stop"))
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

        listener.subscribe(HAND_SIGN, callback)
        listener.start()
        publisher = talker.publisher(HAND_SIGN)
        publisher.publish(String(data="first"))
        assert started.wait(WAIT_S)
        for number in range(100):
            publisher.publish(String(data=str(number)))
        publisher.publish(String(data="last"))
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
        publisher = talker.publisher(HAND_SIGN)
        publisher.publish(String(data="bad"))
        assert failed.wait(WAIT_S)
        publisher.publish(String(data="good"))
        assert arrived.wait(WAIT_S)
        assert listener.callback_errors == 1
        assert "/gesture/hand_sign" in caplog.text

    def test_wanted_tells_whether_anybody_listens(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", CMD_VEL)
        assert not publisher.wanted
        subscription = transport.subscribe("listener", CMD_VEL, lambda _: None)
        assert publisher.wanted
        subscription.close()
        subscription.close()
        assert not publisher.wanted

    def test_a_late_subscriber_gets_the_last_message_of_a_latched_topic(self, transport: Transport) -> None:
        publisher = transport.advertise("robot", ROBOT_DESCRIPTION)
        publisher.publish(String(data="<old/>"))
        publisher.publish(String(data="<robot/>"))
        got: list[str] = []
        transport.subscribe("late", ROBOT_DESCRIPTION, lambda received: got.append(received.message.data))
        assert got == ["<robot/>"]

    def test_a_closed_subscription_gets_nothing(self, transport: Transport) -> None:
        publisher = transport.advertise("talker", HAND_SIGN)
        got: list[object] = []
        subscription = transport.subscribe("listener", HAND_SIGN, got.append)
        subscription.close()
        publisher.publish(String(data="Go"))
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
        transport.close()
        transport.close()
        publisher.publish(String(data="Go"))
        assert got == []
