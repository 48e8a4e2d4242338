import time
from typing import Any

import pytest

from handsteer.clock import RealClock
from handsteer.messages import STEERING_CMD_VEL, STOP, Bool, Topic, twist
from handsteer.plugins.ros2.base_transport import Intake
from handsteer.transports.base import Received
from handsteer.transports.encoding import encode

ZERO, AHEAD = twist(0.0, 0.0), twist(0.5, 0.0)


def taken(topic: Topic[Any], *messages: tuple[Any, float]) -> list[Received[Any]]:
    """Return what a subscriber gets of messages, each sent so many seconds ago by one sender."""
    heard: list[Received[Any]] = []
    intake = Intake(topic, topic.name, RealClock(), heard.append)
    for message, age_s in messages:
        intake.take(encode(message), b"sender", time.monotonic() - age_s)
    return heard


def test_of_late_messages_only_those_that_stop_are_sent_on_and_marked() -> None:
    """The guards: ``is_late`` and ``stops`` in ``Intake.take``."""
    heard = taken(STEERING_CMD_VEL, (AHEAD, 0.0), (AHEAD, 0.9), (ZERO, 0.9), (AHEAD, 0.0))
    assert [(each.message, each.is_late) for each in heard] == [(AHEAD, False), (ZERO, True), (AHEAD, False)]


def test_a_stop_is_sent_on_however_late() -> None:
    heard = taken(STOP, (Bool(data=False), 0.0), (Bool(data=True), 0.9))
    assert [each.message.data for each in heard] == [False, True]


def test_a_message_that_cannot_be_read_is_left_out(caplog: pytest.LogCaptureFixture) -> None:
    heard: list[Received[Any]] = []
    intake = Intake(STEERING_CMD_VEL, "/steering/cmd_vel", RealClock(), heard.append)
    for raw in (b"", b"\0\1\0\0\xff", encode(AHEAD)):
        intake.take(raw, b"sender", None)
    assert [each.message for each in heard] == [AHEAD]
    assert caplog.text.count("cannot be read") == 1
