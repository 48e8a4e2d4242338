import logging
from typing import Any

import pytest

from handsteer.errors import TransportError
from handsteer.messages import Time
from handsteer.plugins.ros2.base_session import RosoutHandler
from handsteer.transports.encoding import decode, encode


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
