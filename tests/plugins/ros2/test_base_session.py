import logging
from typing import Any

import pytest

from handsteer.errors import TransportError
from handsteer.messages import CLOCK, ClockMessage, Time
from handsteer.plugins.ros2.base_session import Ros2Session, RosoutHandler
from handsteer.transports.encoding import decode, encode
from handsteer.transports.in_process import InProcessTransport


@pytest.fixture
def handler() -> RosoutHandler:
    return RosoutHandler("/r1/my_camera", lambda: Time(sec=7, nanosec=0))


@pytest.fixture
def log(handler: RosoutHandler) -> logging.Logger:
    logger = logging.Logger("handsteer.test")
    logger.addHandler(handler)
    return logger


def test_a_record_becomes_a_message(handler: RosoutHandler, log: logging.Logger) -> None:
    log.warning("%s is lost", "the camera")
    sent: list[Any] = []
    handler.send(sent.append)
    (message,) = [decode(encode(one), "rcl_interfaces/msg/Log") for one in sent]
    assert (message.level, message.name, message.msg) == (30, "r1.my_camera", "the camera is lost")
    assert (message.stamp.sec, message.function) == (7, "test_a_record_becomes_a_message")
    assert message.file.endswith("test_base_session.py")
    handler.send(sent.append)
    assert len(sent) == 1


def test_an_exception_is_told_with_its_traceback(handler: RosoutHandler, log: logging.Logger) -> None:
    try:
        raise ValueError("odd")
    except ValueError:
        log.exception("it failed")
    sent: list[Any] = []
    handler.send(sent.append)
    assert sent[0].level == 40
    assert sent[0].msg.startswith("it failed\nTraceback")


def test_what_the_sending_logs_is_not_sent(handler: RosoutHandler, log: logging.Logger) -> None:
    sent: list[Any] = []

    def publish(message: Any) -> None:
        sent.append(message)
        log.warning("a subscriber is too slow")

    log.warning("once")
    for _ in range(3):
        handler.send(publish)
    assert [message.msg for message in sent] == ["once"]


def test_a_network_that_fails_drops_them(handler: RosoutHandler, log: logging.Logger) -> None:
    def refuse(_: Any) -> None:
        raise TransportError("gone")

    log.warning("once")
    handler.send(refuse)
    sent: list[Any] = []
    handler.send(sent.append)
    assert sent == []


def test_only_the_newest_wait(handler: RosoutHandler, log: logging.Logger) -> None:
    for number in range(1000):
        log.warning("%d", number)
    sent: list[Any] = []
    handler.send(sent.append)
    assert [message.msg for message in sent] == [str(number) for number in range(900, 1000)]


class Wire(InProcessTransport):
    """Messages of this process, where a session expects those of a network."""

    def check(self) -> None:
        pass

    def flush(self, timeout_s: float) -> None:
        pass


def test_what_is_no_time_on_clock_is_ignored_and_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    wire: Any = Wire()
    session = Ros2Session("my_camera", ["--ros-args", "-p", "use_sim_time:=true"], lambda _name, _clock: wire)
    clock = wire.advertise("simulator", CLOCK)
    clock.publish(ClockMessage(Time(sec=7, nanosec=500_000_000)))
    for sec, nanosec in ((2**31 - 1, 2**32 - 1), (8, 10**9), (-1, 0)):
        clock.publish(ClockMessage(Time(sec=sec, nanosec=nanosec)))
        assert session.clock.now() < 60.0
    assert session.clock.stamp(session.clock.now()) == Time(sec=7, nanosec=500_000_000)
    assert caplog.messages == [
        "/clock: a message with 2147483647 s and 4294967295 ns is not a valid time: such messages are ignored"
    ]
    clock.publish(ClockMessage(Time(sec=2**31 - 1, nanosec=0)))
    assert session.clock.stamp(session.clock.now()) == Time(sec=2**31 - 1, nanosec=0)
    assert not session.wait(0.0)
    session.close()
