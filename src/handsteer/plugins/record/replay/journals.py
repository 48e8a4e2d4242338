"""The journals of a recording: what each node read from outside, spin by spin, and what gives it to a node again."""

import json
import threading
from collections import OrderedDict, deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from handsteer.clock import to_seconds, to_stamp
from handsteer.errors import RecordingError
from handsteer.messages import Time, Topic
from handsteer.nodes.journal import journal_topic
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.transports.base import Deliver, Publisher, Received, Subscription

M = TypeVar("M")

_LONGEST_ENTRY = 1 << 20
_MOST_READ_AHEAD = 400
# A recorder's messages are at most some seconds behind the journal; pictures are large.
_KEPT, _KEPT_PICTURES = 2000, 200
_PICTURES = "sensor_msgs/msg/CompressedImage"
# No stamp of ROS holds more; what is far larger cannot be converted to one.
_END_OF_TIME_S = 2.0**31


@dataclass(frozen=True)
class Got:
    """A message that a node processed.

    Attributes:
        topic: Full name of its topic.
        number: Its number among the messages of the topic.
        captured_s: Capture time of the frame that led to it, on the recording's clock; None if there was none.
        is_late: Whether it was late.
        by_player: Whether a player of recordings sent it.
        recorded: The message itself; None if the recording lacks it.
    """

    topic: str
    number: int
    captured_s: float | None
    is_late: bool
    by_player: bool
    recorded: Recorded | None = None


@dataclass(frozen=True)
class Spin:
    """What a node read from outside in one spin.

    Attributes:
        time_s: When it ended, in seconds since the epoch of the recording's stamps.
        readings: The readings of its clock in seconds, in order.
        got: The messages that it processed.
        gave: How many messages it published, by topic.
        saw: New answers of the transport to its questions.
        config: The configuration that it applied first, as JSON values; None if it was the same.
        is_stop: Whether this is the end of the node.
    """

    time_s: float
    readings: list[float]
    got: list[Got] = field(default_factory=list)
    gave: dict[str, int] = field(default_factory=dict)
    saw: dict[str, Any] = field(default_factory=dict)
    config: dict[str, Any] | None = None
    is_stop: bool = False


def clock_offset(about: Mapping[str, str]) -> float | None:
    """Return what is added to a time in a journal to get its stamp, in seconds; None if it is missing or not a time.

    Args:
        about: The metadata of the recording.
    """
    try:
        return _time(about.get("clock_offset_s", ""))
    except ValueError:
        return None


def read_spins(file: Recording, node: str) -> Iterator[Spin]:
    """Yield the spins of the node named ``node``, first its construction, with the messages that it processed.

    Raises:
        RecordingError: The recording cannot be read, or its journal is damaged.
    """
    journal = journal_topic(node).name
    waiting: deque[Spin] = deque()
    seen: dict[str, OrderedDict[int, Recorded]] = {}
    for recorded in file.messages():
        if recorded.topic == journal:
            waiting.append(parse_spin(recorded))
        elif not recorded.topic.startswith("/replay/"):
            of_topic = seen.setdefault(recorded.topic, OrderedDict())
            of_topic[recorded.number] = recorded
            if len(of_topic) > (_KEPT_PICTURES if recorded.type == _PICTURES else _KEPT):
                of_topic.popitem(last=False)
        while waiting and (len(waiting) > _MOST_READ_AHEAD or _is_complete(waiting[0], seen)):
            yield _filled(waiting.popleft(), seen)
    while waiting and (file.problem is None or _is_complete(waiting[0], seen)):  # else it was cut off there
        yield _filled(waiting.popleft(), seen)


def _is_complete(spin: Spin, seen: dict[str, OrderedDict[int, Recorded]]) -> bool:
    return all(got.number in seen.get(got.topic, ()) for got in spin.got)


def _filled(spin: Spin, seen: dict[str, OrderedDict[int, Recorded]]) -> Spin:
    found = [seen[got.topic].get(got.number) if got.topic in seen else None for got in spin.got]
    return replace(spin, got=[replace(got, recorded=recorded) for got, recorded in zip(spin.got, found, strict=True)])


def parse_spin(recorded: Recorded) -> Spin:
    """Return the entry of a journal, without the messages that it names.

    Raises:
        RecordingError: It is damaged.
    """
    try:
        text = recorded.message.data
        entry = json.loads(text if len(text) <= _LONGEST_ENTRY else "")
        return Spin(
            recorded.time_s,
            [_time(reading) for reading in entry["t"]],
            [_got(*values) for values in entry.get("got", ())],
            {str(topic): int(count) for topic, count in entry.get("gave", {}).items()},
            dict(entry.get("saw", {})),
            entry.get("config"),
            bool(entry.get("stop")),
        )
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise RecordingError(f"the journal {recorded.topic} is damaged at {recorded.time_s:.3f} s: {error}") from None


def _time(value: Any) -> float:
    """Return a time in seconds; raise a ValueError if it is not one."""
    time_s = float(value)
    if not abs(time_s) < _END_OF_TIME_S:  # nan is not
        raise ValueError("a number that is not a time")
    return time_s


def _got(topic: Any, number: Any, captured_s: Any, is_late: Any, by_player: Any) -> Got:
    captured = None if captured_s is None else _time(captured_s)
    return Got(str(topic), int(number), captured, bool(is_late), bool(by_player))


class ReplayClock:
    """A clock with recorded readings.

    Args:
        offset_s: What is added to a time to get its stamp, in seconds.
    """

    def __init__(self, offset_s: float) -> None:
        self.offset_s = offset_s
        self._readings: Sequence[float] = (0.0,)
        self._next = 0

    def set(self, readings: Sequence[float]) -> None:
        """Return ``readings`` in turn from now on; the last one is repeated."""
        if readings:
            self._readings, self._next = readings, 0

    def now(self) -> float:
        """Return the next reading, in seconds."""
        reading = self._readings[min(self._next, len(self._readings) - 1)]
        self._next += 1
        return reading

    def stamp(self, time_s: float) -> Time:
        """Return the header stamp of ``time_s``."""
        return to_stamp(time_s + self.offset_s)

    def time_of(self, stamp: Time) -> float:
        """Return the time of a header stamp."""
        return to_seconds(stamp) - self.offset_s

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Return at once; nothing waits in a replay."""


class ReplayTransport:
    """Delivers recorded messages to one node, and keeps what it publishes.

    Attributes:
        published: Messages since the last :meth:`take`: full topic name, message, capture time.
        answers: The recorded answers to what the node asks, as in :mod:`handsteer.nodes.journal`.
    """

    crosses_network = False
    is_one_machine = True

    def __init__(self) -> None:
        self.published: list[tuple[str, Any, float | None]] = []
        self.answers: dict[str, Any] = {}
        self._deliveries: dict[str, list[Deliver[Any]]] = {}

    def take(self) -> list[tuple[str, Any, float | None]]:
        """Remove and return the published messages."""
        taken, self.published = self.published, []
        return taken

    def deliver(self, topic: str, received: Received[Any]) -> None:
        """Deliver a message to the node, if it subscribes to the topic."""
        for deliver in self._deliveries.get(topic, ()):
            deliver(received)

    def advertise(self, node: str, topic: Topic[M]) -> Publisher[M]:
        """Return a publisher of ``topic``."""
        return _ReplayPublisher(self, topic.name)

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> Subscription:
        """Call ``deliver`` for each recorded message of ``topic`` from now on."""
        deliveries = self._deliveries.setdefault(topic.name, [])
        deliveries.append(deliver)
        subscription = ExitStack()
        subscription.callback(lambda: deliveries.remove(deliver) if deliver in deliveries else None)
        return subscription

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the recorded answer."""
        return list(self.answers.get(f"publishers {topic.name}", ()))

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic``."""
        return topic.name

    def full_name(self, node: str) -> str:
        """Return the full name of the node ``node``."""
        return node

    def close(self) -> None:
        """Do nothing."""


class _ReplayPublisher:
    def __init__(self, transport: ReplayTransport, topic: str) -> None:
        self._transport = transport
        self._topic = topic

    @property
    def has_subscribers(self) -> bool:
        return bool(self._transport.answers.get(f"subscribers {self._topic}", True))

    def publish(self, message: Any, captured_s: float | None = None) -> None:
        self._transport.published.append((self._topic, message, captured_s))
