"""What a node gets in a replay instead of a graph: recorded messages, and the recorded clock."""

import threading
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, TypeVar

from handsteer.clock import to_seconds, to_stamp
from handsteer.messages import Time, Topic
from handsteer.transports.base import Deliver, Publisher, Received, Subscription

M = TypeVar("M")


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
