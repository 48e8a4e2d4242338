import datetime
import importlib
import io
import os
import pickle
import struct
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer import messages
from handsteer.config import load
from handsteer.errors import PluginError, TransportError
from handsteer.images import image_message
from handsteer.messages import (
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    STEERING_CMD_VEL,
    Header,
    String,
    Time,
    Topic,
    Twist,
    twist,
)
from handsteer.plugins.page import editing
from handsteer.robots.world import load_world
from handsteer.testing.transport_contract import TransportContract, eventually
from handsteer.transports import piped
from handsteer.transports.base import Received, Transport
from handsteer.transports.in_process import InProcessTransport
from handsteer.transports.piped import Gateway, Pipe, PipedTransport

TOPICS = [value for value in vars(messages).values() if isinstance(value, Topic)]


def joined() -> tuple[Pipe, Pipe]:
    """Return both ends of a pipe, not started: the parent's, then the child's."""
    there, back = os.pipe(), os.pipe()
    return (
        Pipe(os.fdopen(back[0], "rb"), os.fdopen(there[1], "wb"), trusts=False, pure_modules=[editing.__name__]),
        Pipe(os.fdopen(there[0], "rb"), os.fdopen(back[1], "wb"), trusts=True),
    )


class Both:
    """A graph, and nodes of another process in it."""

    def __init__(self) -> None:
        self.near, self.far = joined()
        self.graph = InProcessTransport()
        self.gateway = Gateway(self.near, self.graph)
        self.transport = PipedTransport(self.far)

    def start(self) -> None:
        self.near.start()
        self.far.start()

    def close(self) -> None:
        self.transport.close()
        self.far.close()
        self.near.close()
        self.gateway.close()
        self.graph.close()


@pytest.fixture
def both() -> Iterator[Both]:
    both = Both()
    yield both
    both.close()


class TestPiped(TransportContract):
    settle_s = 0.3

    @pytest.fixture
    def transport(self, both: Both) -> Transport:
        both.start()
        return both.transport

    def test_wanted_tells_whether_anybody_listens(self, transport: Transport) -> None:
        # Who does is in the other process, and the nodes that use this transport publish little.
        assert transport.advertise("talker", CMD_VEL).has_subscribers


def test_messages_pass_both_ways_with_their_capture_times(both: Both) -> None:
    heard_here: list[Received[String]] = []
    heard_there: list[Received[Twist]] = []
    both.transport.subscribe("page", HAND_SIGN, heard_here.append)
    both.graph.subscribe("control", STEERING_CMD_VEL, heard_there.append)
    both.start()
    both.transport.advertise("steering", STEERING_CMD_VEL).publish(twist(0.5, -1.0))
    assert eventually(lambda: heard_there)
    assert heard_there[0] == Received(twist(0.5, -1.0), number=1)
    assert eventually(lambda: both.graph.advertise("recognition", HAND_SIGN).has_subscribers)
    both.graph.advertise("recognition", HAND_SIGN).publish(String(data="Go"), 12.5)
    assert eventually(lambda: heard_here)
    assert heard_here[0] == Received(String(data="Go"), 12.5, number=1)


def test_the_graph_counts_publishers_of_the_other_process_until_they_are_gone(both: Both) -> None:
    both.start()
    publisher = both.transport.advertise("steering", CMD_VEL)
    assert eventually(lambda: both.graph.publishers_of(CMD_VEL) == ["steering"])
    del publisher
    assert eventually(lambda: both.graph.publishers_of(CMD_VEL) == [])


def test_the_late_end_of_a_subscription_does_not_end_the_next_one(both: Both) -> None:
    both.start()
    both.far.say("subscribe", 1, "page", HAND_SIGN)
    both.far.say("subscribe", 2, "page", HAND_SIGN)
    both.far.say("unsubscribe", HAND_SIGN.name, 1)
    both.far.say("subscribe", 3, "page", CMD_VEL)
    assert eventually(lambda: both.graph.advertise("control", CMD_VEL).has_subscribers)
    publisher = both.graph.advertise("recognition", HAND_SIGN)
    assert publisher.has_subscribers
    both.far.say("unsubscribe", HAND_SIGN.name, 2)
    assert eventually(lambda: not publisher.has_subscribers)


def test_a_process_that_stands_still_gets_the_newest_only_and_holds_up_nobody(both: Both) -> None:
    signs: list[str] = []
    pictures: list[Received[Any]] = []
    in_callback, let_go = threading.Event(), threading.Event()

    def hang(received: Received[String]) -> None:
        signs.append(received.message.data)
        in_callback.set()
        let_go.wait(10)

    both.transport.subscribe("page", HAND_SIGN, hang)
    both.transport.subscribe("page", IMAGE_RAW, pictures.append)
    both.start()
    publisher, camera = both.graph.advertise("recognition", HAND_SIGN), both.graph.advertise("camera", IMAGE_RAW)
    assert eventually(lambda: publisher.has_subscribers and camera.has_subscribers)
    publisher.publish(String(data="first"))
    assert in_callback.wait(10)
    header = Header(stamp=Time(sec=0, nanosec=0), frame_id="camera")
    for number in range(300):  # 270 MB of pictures
        publisher.publish(String(data=str(number)))
        camera.publish(image_message(np.full((480, 640, 3), number % 256, np.uint8), header))
    let_go.set()
    assert eventually(lambda: signs[-1] == "299")
    assert eventually(lambda: pictures and pictures[-1].message.data[0] == 299 % 256)
    assert signs == sorted(signs[:1]) + sorted(signs[1:], key=int)  # in order
    # What was on its way, and what may wait.
    assert len(pictures) < 10


def test_a_steering_command_that_waited_too_long_is_not_obeyed(both: Both) -> None:
    heard: list[Received[Twist]] = []
    both.graph.subscribe("control", STEERING_CMD_VEL, heard.append)
    publisher = both.transport.advertise("steering", STEERING_CMD_VEL)
    publisher.publish(twist(1.0, 0.0))
    assert STEERING_CMD_VEL.lifespan_s is not None
    time.sleep(STEERING_CMD_VEL.lifespan_s + 0.05)
    publisher.publish(twist(0.0, 0.0))
    both.start()
    assert eventually(lambda: heard)
    assert [received.message.linear.x for received in heard] == [0.0]


def test_the_end_of_one_end_is_the_end_of_both(both: Both) -> None:
    both.start()
    both.far.close()
    assert both.near.ended.wait(10)
    both.transport.advertise("steering", CMD_VEL).publish(twist(1.0, 0.0))  # to nobody


def test_what_is_said_before_the_end_arrives() -> None:
    near, far = joined()
    heard: list[int] = []
    near.on("number", heard.append)
    near.start()
    far.start()
    for number in range(100):
        far.say("number", number)
    far.close(10.0)
    assert near.ended.wait(10)
    assert heard == list(range(100))


def test_an_end_that_takes_nothing_is_not_said_more_than_a_thousand_things() -> None:
    _, far = joined()
    for number in range(1000):
        far.say("number", number)
    with pytest.raises(TransportError, match="does not answer"):
        far.say("number", 1000)


def test_a_message_that_is_cut_short_ends_the_pipe() -> None:
    source, sink = os.pipe()
    pipe = Pipe(os.fdopen(source, "rb"), os.fdopen(os.open(os.devnull, os.O_WRONLY), "wb"), trusts=False)
    pipe.start()
    os.write(sink, b"\x00\x00\x00")
    os.close(sink)
    assert pipe.ended.wait(10)


def test_a_message_that_is_said_to_be_endless_ends_the_pipe() -> None:
    source, sink = os.pipe()
    pipe = Pipe(os.fdopen(source, "rb"), os.fdopen(os.open(os.devnull, os.O_WRONLY), "wb"), trusts=False)
    pipe.start()
    os.write(sink, struct.pack("<IQ", 1, 2**63) + b"x")
    assert pipe.ended.wait(10)
    os.close(sink)


def nested(depth: int) -> list[Any]:
    """Return lists in each other, as JSON of twice as many characters can contain them."""
    value: list[Any] = []
    for _ in range(depth):
        value = [value]
    return value


class Unreadable:
    """Can be pickled, but raises when it is read."""

    def __reduce__(self) -> tuple[Any, ...]:
        return int, ("\x1b[2Jno number",)


class Runs:
    """Runs code where it is read, unless only data is read."""

    def __init__(self, call: Callable[..., object], *what: object) -> None:
        self._call = (call, what)

    def __reduce__(self) -> tuple[Any, ...]:
        return self._call


@pytest.mark.parametrize(
    "call",
    [os.mkdir, Path.mkdir, partial(Path.mkdir), subprocess.run, eval, pickle.loads, importlib.import_module, getattr],
    ids=lambda call: getattr(call, "__qualname__", "partial"),
)
def test_a_parent_runs_no_code_of_its_child(
    call: Callable[..., object], caplog: pytest.LogCaptureFixture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    near, far = joined()
    heard: list[object] = []
    near.on("number", heard.append)
    near.start()
    far.start()
    far.say("number", Runs(call, "made"))
    far.say("number", 1)
    assert eventually(lambda: heard == [1])
    assert "is not a class of data" in caplog.text
    assert not Path("made").exists()
    far.close()


@pytest.mark.parametrize("name", ["field", "Any", "dataclass", "replace", "twist.__globals__", "builtins"])
def test_of_a_module_of_data_its_own_parts_are_read_only(name: str) -> None:
    with pytest.raises(pickle.UnpicklingError):
        piped._DataUnpickler(io.BytesIO(f"chandsteer.messages\n{name}\n.".encode()), piped._PURE_MODULES).load()


def test_functions_are_read_of_the_named_modules_only() -> None:
    with pytest.raises(pickle.UnpicklingError):
        piped._DataUnpickler(io.BytesIO(pickle.dumps(editing.edit)), piped._PURE_MODULES).load()


DATA = [
    *TOPICS,
    load(base={"camera": {"source": "virtual"}}),
    load_world("obstacles"),
    partial(editing.edit, name="box", fields={"x": 1.0}, section="obstacles"),
    np.zeros((2, 3), np.uint8),
    np.float64(0.5),
    np.datetime64("2026-01-01"),
    Path("a/b"),
    datetime.datetime.now(datetime.UTC),
    TransportError("no"),
    PluginError("no"),
    deque([1, {2}, frozenset({3})]),
]


@pytest.mark.parametrize("data", DATA, ids=lambda data: type(data).__name__)
def test_a_parent_reads_data_of_its_child(data: Any) -> None:
    near, far = joined()
    heard: list[Any] = []
    near.on("data", heard.append)
    near.start()
    far.start()
    far.say("data", data)
    assert eventually(lambda: heard)
    assert repr(heard[0]) == repr(data)
    far.close()


UNSENDABLE = {"function": lambda: None, "nested": nested(5000), "unreadable": Unreadable(), "lock": threading.Lock()}


@pytest.mark.parametrize("from_near", [True, False], ids=["near", "far"])
@pytest.mark.parametrize("kind", UNSENDABLE)
def test_what_cannot_be_sent_is_one_line_of_the_log_and_what_follows_arrives(
    kind: str, from_near: bool, caplog: pytest.LogCaptureFixture
) -> None:
    sender, reader = joined() if from_near else joined()[::-1]
    heard: list[object] = []
    reader.on("number", heard.append)
    sender.start()
    reader.start()
    for _ in range(3):
        sender.say("number", UNSENDABLE[kind])
    sender.say("number", 1)
    assert eventually(lambda: heard == [1])
    assert not sender.ended.is_set()
    assert not reader.ended.is_set()
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == 1, lines
    assert "about number cannot be " in lines[0]
    assert lines[0].isprintable()
    assert not any(record.exc_info for record in caplog.records)
    sender.close()


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_topic_can_be_used_from_another_process(topic: Topic[object]) -> None:
    assert pickle.loads(pickle.dumps(topic)) == topic


def test_a_handler_that_fails_is_logged_and_the_next_one_called(caplog: pytest.LogCaptureFixture) -> None:
    near, far = joined()
    heard: list[int] = []

    def handler(number: int) -> None:
        heard.append(1 // number)

    near.on("number", handler)
    near.start()
    far.start()
    far.say("number", 0)
    far.say("number", 1)
    assert eventually(lambda: heard == [1])
    assert "about number could not be handled" in caplog.text
    far.close()
