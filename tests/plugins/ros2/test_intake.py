import threading
import time
from typing import Any

import numpy as np
import pytest

from handsteer.clock import RealClock
from handsteer.images import image_message
from handsteer.messages import IMAGE_RAW, STEERING_CMD_VEL, STOP, Bool, Header, Topic, twist
from handsteer.plugins.ros2 import base_transport
from handsteer.plugins.ros2.base_transport import Intake, Once, Players
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


def test_a_reset_that_was_held_back_does_not_end_a_newer_stop_of_another(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the link to the page was cut when *Reset* was pressed there, and then Stop on the robot's side."""
    heard: list[Received[Any]] = []
    intake = Intake(STOP, "/stop", RealClock(), heard.append)
    for is_stopped, sender, sent_s, arrived_s in (
        (True, b"page", 0.0, 0.0),
        (True, b"robot", 2.0, 2.0),
        (False, b"page", 1.0, 5.0),
        (False, b"page", 6.0, 6.0),
    ):
        monkeypatch.setattr(base_transport, "monotonic", lambda arrived_s=arrived_s: arrived_s)
        intake.take(encode(Bool(data=is_stopped)), sender, sent_s)
    assert [each.message.data for each in heard] == [True, True, False]
    assert caplog.text.count("sent before the last Stop") == 1


@pytest.mark.parametrize(
    ("nodes", "is_late", "by_player"),
    [
        (["/my_camera"], False, False),
        (["/rosbag2_player"], False, True),
        (["/my_camera", "/rosbag2_player"], True, False),
        (["/r1/rosbag2_player_1", "/rosbag2_player"], False, True),
        ([], False, False),
    ],
)
def test_old_images_count_if_players_are_the_only_publishers(nodes: list[str], is_late: bool, by_player: bool) -> None:
    """The guard: ``are_among_others`` in ``Intake.take``: their age is not that of a clock that was set."""
    heard: list[Received[Any]] = []
    clock = RealClock()
    intake = Intake(IMAGE_RAW, "/image_raw", clock, heard.append, Players(lambda: nodes))
    for age_s in (3600.0, 0.1):
        header = Header(stamp=clock.stamp(clock.now() - age_s), frame_id="")
        intake.take(encode(image_message(np.zeros((4, 4, 3), np.uint8), header)), b"sender", time.time())
    assert [each.is_late for each in heard] == [is_late, False]
    assert [each.by_player for each in heard] == [by_player, by_player]


def test_a_message_of_two_readers_is_passed_on_once() -> None:
    """The guard: ``Once``."""
    passed: list[float | None] = []
    once = Once(lambda _raw, _sender, sent_s: passed.append(sent_s))
    for sent_s in (1.0, 1.0, 2.0, 1.0, 2.0, 3.0, None, None):
        once.take(b"stop", b"", sent_s)
    once.take(b"reset", b"", 3.0)
    assert passed == [1.0, 2.0, 3.0, None, None, 3.0]


def test_of_two_readers_the_newest_message_is_passed_on_last() -> None:
    """The reliable reader waits for what was lost, while the other one goes on."""
    passed: list[bytes] = []
    once = Once(lambda raw, _sender, _sent_s: passed.append(raw))
    for raw, sent_s in ((b"stop", 2.0), (b"reset", 1.0), (b"stop", 2.0), (b"stop", 2.0)):
        once.take(raw, b"", sent_s)
    assert passed == [b"stop", b"reset", b"stop"]


def test_several_readers_pass_on_from_threads_of_their_own_one_after_the_other() -> None:
    """Over Zenoh, each reader has a thread; what decodes and compares their messages is not made for several."""
    inside, together, failed = threading.Lock(), list[str](), list[BaseException]()

    def take(_raw: bytes, _sender: bytes, _sent_s: float | None) -> None:
        if not inside.acquire(blocking=False):
            together.append(threading.current_thread().name)
            return
        time.sleep(0.0002)
        inside.release()

    once = Once(take)

    def read(first_s: float) -> None:
        try:
            for number in range(200):
                once.take(b"stop", b"", first_s + number)
        except BaseException as error:
            failed.append(error)

    readers = [threading.Thread(target=read, args=(1000.0 * number,)) for number in range(3)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    assert (together, failed) == ([], [])


def test_a_message_that_cannot_be_read_is_left_out(caplog: pytest.LogCaptureFixture) -> None:
    heard: list[Received[Any]] = []
    intake = Intake(STEERING_CMD_VEL, "/steering/cmd_vel", RealClock(), heard.append)
    for raw in (b"", b"\0\1\0\0\xff", encode(AHEAD)):
        intake.take(raw, b"sender", None)
    assert [each.message for each in heard] == [AHEAD]
    assert caplog.text.count("cannot be read") == 1
