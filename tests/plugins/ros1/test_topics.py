"""Sending to a subscriber of ROS 1: at once as long as it reads, never waiting for it when it does not."""

import socket
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from tests.processes import eventually

pytestmark = pytest.mark.ros1

DEPTH = 10
LENGTH = 8


class Connection:
    """What rospy's connection is to a queue: a socket, and a callback at its end."""

    def __init__(self, end: socket.socket) -> None:
        self.socket = end
        self.done = False
        self.stat_bytes = self.stat_num_msg = 0
        self.cleanup_cb: Any = None
        self.endpoint_id = "/peer"

    def set_cleanup_callback(self, callback: Any) -> None:
        self.cleanup_cb = callback

    def write_data(self, data: bytes) -> None:
        self.socket.sendall(data)

    def close(self) -> None:
        self.done = True
        if self.cleanup_cb:
            self.cleanup_cb(self)


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    here, there = socket.socketpair()
    with here, there:
        here.settimeout(60)
        here.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        yield here, there


def prompt(end: socket.socket) -> tuple[Any, Connection]:
    from handsteer.plugins.ros1.topics import PromptConnection  # noqa: PLC0415 - rospy is not everywhere

    connection = Connection(end)
    return PromptConnection(connection, DEPTH), connection


def message(number: int) -> bytes:
    return b"%08d" % number


def numbers(data: bytes) -> list[int]:
    assert len(data) % LENGTH == 0, "a message has come in parts"
    return [int(data[at : at + LENGTH]) for at in range(0, len(data), LENGTH)]


def test_message_is_with_the_subscriber_when_write_returns(ends: tuple[socket.socket, socket.socket]) -> None:
    here, there = ends
    connection, _ = prompt(here)
    threads = threading.active_count()

    connection.write_data(message(1))

    assert numbers(there.recv(LENGTH, socket.MSG_DONTWAIT)) == [1]
    assert threading.active_count() == threads
    assert connection.endpoint_id == "/peer"


def test_subscriber_that_reads_nothing_holds_up_nobody_and_gets_whole_messages_in_order_later(
    ends: tuple[socket.socket, socket.socket],
) -> None:
    here, there = ends
    connection, transport = prompt(here)
    last = 5000
    for number in range(last + 1):
        connection.write_data(message(number))  # would hang here

    data = b""
    while not data.endswith(message(last)):
        data += there.recv(2**16)
    came = numbers(data)
    assert came == sorted(set(came))
    assert came[:10] == list(range(10))
    assert came[-DEPTH:] == list(range(last - DEPTH + 1, last + 1))
    transport.close()


def test_end_of_the_connection_ends_the_thread_and_tells_the_topic(ends: tuple[socket.socket, socket.socket]) -> None:
    here, there = ends
    connection, transport = prompt(here)
    told: list[Any] = []
    transport.set_cleanup_callback(told.append)
    threads = threading.active_count()
    for number in range(5000):
        connection.write_data(message(number))
    there.close()

    transport.close()

    assert transport in told
    eventually(lambda: threading.active_count() == threads, what="the end of the thread")


def test_subscriber_that_has_left_is_said(ends: tuple[socket.socket, socket.socket]) -> None:
    from rospy.exceptions import TransportTerminated  # noqa: PLC0415

    here, there = ends
    connection, transport = prompt(here)
    there.close()
    with pytest.raises(TransportTerminated):
        connection.write_data(message(1))
    assert transport.done


def test_what_a_publisher_has_latched_before_is_kept_apart_once() -> None:
    from handsteer.plugins.ros1.topics import _Kept  # noqa: PLC0415 - rospy is not everywhere

    def of(publisher: str, *, latches: bool) -> Any:
        return SimpleNamespace(_connection_header={"callerid": publisher, "latching": str(int(latches))})

    kept = _Kept({"/old", "/plain"})
    assert kept.has(of("/old", latches=True))
    assert not kept.has(of("/old", latches=True)), "its next message is new"
    assert not kept.has(of("/plain", latches=False))
    assert not kept.has(of("/new", latches=True)), "it was not there before, as rostopic pub -1"
    unknown = _Kept(None)
    assert unknown.has(of("/any", latches=True))
    assert not unknown.has(of("/any", latches=False))
