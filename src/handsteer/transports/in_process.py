"""Messages within one process: handed over by reference, no copy, no thread of its own."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.protocol import Received

M = TypeVar("M")
Deliver = Callable[[Received[M]], None]


class InProcessTransport:
    """A :class:`~handsteer.transports.protocol.Transport` for the nodes of one process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._channels: dict[str, _Channel[Any]] = {}

    def advertise(self, node: str, topic: Topic[M]) -> "InProcessPublisher[M]":
        """Return the sending end of ``topic`` for the node named ``node``."""
        return InProcessPublisher(self._channel(topic))

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> "InProcessSubscription[M]":
        """Call ``deliver`` for each message on ``topic`` from now on, on the publisher's thread."""
        channel = self._channel(topic)
        channel.add(deliver)
        return InProcessSubscription(channel, deliver)

    def full_name(self, node: str) -> str:
        """Return ``node``."""
        return node

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        with self._lock:
            for channel in self._channels.values():
                channel.clear()
            self._channels.clear()

    def _channel(self, topic: Topic[M]) -> "_Channel[M]":
        with self._lock:
            channel = self._channels.setdefault(topic.name, _Channel(topic))
        if channel.topic.type is not topic.type:
            raise TransportError(
                f"{topic.name} carries {type_name(channel.topic.type)}, it cannot carry {type_name(topic.type)} too"
            )
        return channel


class InProcessPublisher(Generic[M]):
    """The sending end of a topic."""

    def __init__(self, channel: "_Channel[M]") -> None:
        self._channel = channel

    @property
    def wanted(self) -> bool:
        """Whether anybody listens."""
        return bool(self._channel.subscribers)

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Hand ``message`` to every subscriber's inbox."""
        topic = self._channel.topic
        if not isinstance(message, topic.type):
            raise TransportError(f"{topic.name} carries {type_name(topic.type)}, not {type_name(type(message))}")
        self._channel.send(Received(message, captured_s))


class InProcessSubscription(Generic[M]):
    """The receiving end of a topic."""

    def __init__(self, channel: "_Channel[M]", deliver: Deliver[M]) -> None:
        self._channel = channel
        self._deliver = deliver

    def close(self) -> None:
        """Receive no more; may be called twice."""
        self._channel.remove(self._deliver)


@dataclass
class _Channel(Generic[M]):
    """The subscribers of one topic; the tuple is replaced, never changed, so that sending needs no lock."""

    topic: Topic[M]
    subscribers: tuple[Deliver[M], ...] = ()
    _last: Received[M] | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = (*self.subscribers, deliver)
            if self._last is not None:
                deliver(self._last)

    def remove(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = tuple(known for known in self.subscribers if known is not deliver)

    def clear(self) -> None:
        with self._lock:
            self.subscribers = ()

    def send(self, received: Received[M]) -> None:
        if self.topic.latched:
            with self._lock:
                self._last = received
        for deliver in self.subscribers:
            deliver(received)
