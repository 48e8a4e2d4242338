"""A node's journal: what it read from outside in each spin, so that a replay repeats its work bit for bit.

A node's results depend on the messages that it processes, and on when: on the readings of its clock, and on what it
asks the transport. The journal contains these, for each call of :meth:`~handsteer.nodes.base.Node.spin_once` that did
something. Each entry is JSON on the topic :func:`journal_topic`:

``t``
    The readings of the clock, in seconds, in order.
``got``
    The processed messages, in order: topic, number, capture time, whether it was late, whether a player sent it.
``gave``
    How many messages it published, by topic.
``saw``
    What the transport has answered, if it is not as before: has_subscribers of a topic, or its publishers.
``config``
    The configuration that it applied first.
``stop``
    True for the end of the node, where it publishes its last messages.
"""

import json
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.messages import String, Time, Topic
from handsteer.transports.base import Deliver, Publisher, Received, Subscription, Transport

JOURNALS = "journals"
"""Key of a recording's metadata if it contains journals."""

M = TypeVar("M")
Work = Sequence[tuple[str, Received[Any]]]


def journal_topic(node: str) -> Topic[String]:
    """Return the topic of the journal of the node named ``node``."""
    return Topic(f"/replay/{node}", String)


class Journal:
    """Notes what a node reads from outside.

    Construct the node with :attr:`clock` and :attr:`transport`, and set its attribute ``journal``.

    Args:
        transport: Carries the node's messages.
        clock: The graph's clock.

    Attributes:
        transport: The same, noting what the node asks and publishes.
        clock: The same, noting the node's readings.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self._readings: list[float] = []
        self._gave: dict[str, int] = {}
        self._saw: dict[str, Any] = {}
        self._answered: dict[str, Any] = {}
        # The thread that constructs the node, then the one that runs the current spin.
        self._thread: int | None = threading.get_ident()
        self._entry: dict[str, Any] = {}
        self._is_constructed = False
        self._write: Callable[[str], None] | None = None
        self._real = clock
        self.transport: Transport = _JournalTransport(transport, self)
        self.clock: Clock = _JournalClock(clock, self)

    def write_to(self, write: Callable[[str], None] | None) -> None:
        """Pass each entry to ``write`` from now on, or to nothing when None.

        The first entry is that of the node's construction, or, if it has run before, a single reading of the clock.
        """
        if write is not None:
            entry = {"t": [self._real.now()]} if self._is_constructed else self._close_entry()
            self._end_construction()
            self._answered = {}
            write(json.dumps(entry))
        self._write = write

    def begin(self, config: Config | None, work: Work, *, is_stop: bool = False) -> None:
        """Begin the entry of a spin, which applies ``config`` and processes ``work``, or of the node's stop."""
        self._end_construction()
        if self._write is None:
            return
        self._thread = threading.get_ident()
        if config is not None:
            self._entry["config"] = config.model_dump(mode="json")
        if is_stop:
            self._entry["stop"] = True
        if work:
            self._entry["got"] = [
                [topic, received.number, received.captured_s, received.is_late, received.by_player]
                for topic, received in work
            ]

    def end(self, *, keep: bool = True) -> None:
        """End the entry; unless ``keep``, the spin had nothing to do."""
        has_begun, self._thread = self._thread is not None, None
        entry = self._close_entry()
        if self._write is not None and has_begun and keep:
            self._write(json.dumps(entry))

    def read(self, time_s: float) -> None:
        """Note a reading of the clock."""
        if self._thread == threading.get_ident():
            self._readings.append(time_s)

    def give(self, topic: str) -> None:
        """Note that a message was published on ``topic``."""
        if self._thread == threading.get_ident():
            self._gave[topic] = self._gave.get(topic, 0) + 1

    def see(self, question: str, answer: Any) -> None:
        """Note an answer of the transport."""
        if self._thread == threading.get_ident() and self._answered.get(question) != answer:
            self._answered[question] = self._saw[question] = answer

    def _end_construction(self) -> None:
        if not self._is_constructed:
            self._is_constructed, self._thread = True, None
            if self._write is None:
                self._close_entry()

    def _close_entry(self) -> dict[str, Any]:
        entry = {"t": self._readings, **self._entry}
        entry |= {name: part for name, part in (("gave", self._gave), ("saw", self._saw)) if part}
        self._readings, self._gave, self._saw, self._entry = [], {}, {}, {}
        return entry


class _JournalClock:
    def __init__(self, clock: Clock, journal: Journal) -> None:
        self._clock = clock
        self._journal = journal

    @property
    def offset_s(self) -> float:
        return self._clock.offset_s

    def now(self) -> float:
        time_s = self._clock.now()
        self._journal.read(time_s)
        return time_s

    def stamp(self, time_s: float) -> Time:
        return self._clock.stamp(time_s)

    def time_of(self, stamp: Time) -> float:
        return self._clock.time_of(stamp)

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        self._clock.wait(wake, timeout_s)


class _JournalTransport:
    def __init__(self, transport: Transport, journal: Journal) -> None:
        self._transport = transport
        self._journal = journal

    @property
    def crosses_network(self) -> bool:
        return self._transport.crosses_network

    @property
    def is_one_machine(self) -> bool:
        return self._transport.is_one_machine

    def advertise(self, node: str, topic: Topic[M]) -> Publisher[M]:
        return _JournalPublisher(self._transport.advertise(node, topic), topic.name, self._journal)

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> Subscription:
        return self._transport.subscribe(node, topic, deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        names = self._transport.publishers_of(topic)
        self._journal.see(f"publishers {topic.name}", names)
        return names

    def topic_name(self, topic: Topic[Any]) -> str:
        return self._transport.topic_name(topic)

    def full_name(self, node: str) -> str:
        return self._transport.full_name(node)

    def close(self) -> None:
        self._transport.close()


class _JournalPublisher:
    def __init__(self, publisher: Publisher[M], topic: str, journal: Journal) -> None:
        self._publisher = publisher
        self._topic = topic
        self._journal = journal

    @property
    def has_subscribers(self) -> bool:
        answer = self._publisher.has_subscribers
        self._journal.see(f"subscribers {self._topic}", answer)
        return answer

    def publish(self, message: Any, captured_s: float | None = None) -> None:
        self._journal.give(self._topic)
        self._publisher.publish(message, captured_s)
