"""Reads the journals of a recording: what each node read from outside, spin by spin."""

import json
import math
from collections import OrderedDict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from handsteer.errors import RecordingError
from handsteer.nodes.journal import journal_topic
from handsteer.recordings.recorded import Recorded, Recording

_LONGEST_ENTRY = 1 << 20
_MOST_READ_AHEAD = 400
# A recorder's messages are at most some seconds behind the journal; pictures are large.
_KEPT, _KEPT_PICTURES = 2000, 200
_PICTURES = "sensor_msgs/msg/CompressedImage"


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
    while waiting:
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
        readings = [float(time_s) for time_s in entry["t"]]
        if not all(map(math.isfinite, readings)):
            raise ValueError("a time that is not finite")
        return Spin(
            recorded.time_s,
            readings,
            [_got(*values) for values in entry.get("got", ())],
            {str(topic): int(count) for topic, count in entry.get("gave", {}).items()},
            dict(entry.get("saw", {})),
            entry.get("config"),
            bool(entry.get("stop")),
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise RecordingError(f"the journal {recorded.topic} is damaged at {recorded.time_s:.3f} s: {error}") from None


def _got(topic: Any, number: Any, captured_s: Any, is_late: Any, by_player: Any) -> Got:
    captured = None if captured_s is None else float(captured_s)
    return Got(str(topic), int(number), captured, bool(is_late), bool(by_player))
