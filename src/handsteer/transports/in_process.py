"""Messages within one process, and what all transports share of it.

Each topic has one type in a process, and each message is received and decoded once for all its subscribers there.
"""

import itertools
import threading
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, MutableSet
from contextlib import ExitStack
from typing import Any, Generic, TypeVar

from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.base import Deliver, Received, Subscription

M = TypeVar("M")
Receive = Callable[[Deliver[M]], Callable[[], None]]


class TopicTypes:
    """The type of each topic in this process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holders: dict[str, list[type]] = {}

    def claim(self, name: str, topic: Topic[Any]) -> None:
        """Record that the topic whose full name is ``name`` has the type of ``topic``.

        Raises:
            TransportError: It has another type already.
        """
        with self._lock:
            holders = self._holders.setdefault(name, [])
            known = holders[0] if holders else topic.type
            if known is not topic.type:
                raise TransportError(f"{name} carries {type_name(known)}, it cannot carry {type_name(topic.type)} too")
            holders.append(known)

    def release(self, name: str) -> None:
        """Release one claim of the topic."""
        with self._lock:
            self._holders[name].pop()

    def is_shared(self, name: str) -> bool:
        """Return whether the topic was claimed more than once."""
        with self._lock:
            return len(self._holders.get(name, ())) > 1


def check_type(topic: Topic[Any], message: object) -> None:
    """Raise TransportError unless ``message`` is of the type of ``topic``."""
    if not isinstance(message, topic.type):
        raise TransportError(f"{topic.name} carries {type_name(topic.type)}, not {type_name(type(message))}")


class Fanout(Generic[M]):
    """The subscribers of a topic in this process.

    Args:
        latched: Whether a late subscriber gets the last message at once.
        receive: Called with a function for received messages when the first subscriber is added; starts receiving, and
            returns a function that ends it. None if messages come from this process.

    Attributes:
        numbers: Numbers for the messages of this process.
    """

    def __init__(self, *, latched: bool, receive: Receive[M] | None = None) -> None:
        self.numbers = itertools.count(1)
        self._latched = latched
        self._receive = receive
        self._end: Callable[[], None] | None = None
        self._lock = threading.RLock()
        # Replaced, never changed, so that it can be read without the lock.
        self._subscribers: tuple[Deliver[M], ...] = ()
        self._last: Received[M] | None = None

    @property
    def has_subscribers(self) -> bool:
        """Whether there is a subscriber."""
        return bool(self._subscribers)

    def add(self, deliver: Deliver[M]) -> Subscription:
        """Call ``deliver`` for each message from now on."""
        subscription = ExitStack()
        subscription.callback(self.remove, deliver)
        with self._lock:
            self._subscribers = (*self._subscribers, deliver)
            if self._last is not None:
                deliver(self._last)
            if self._receive is not None and self._end is None:
                self._end = self._receive(self.send)
        return subscription

    def remove(self, deliver: Deliver[M]) -> None:
        """Stop calling ``deliver``; does nothing if it was removed already."""
        with ExitStack() as unlocked, self._lock:
            self._subscribers = tuple(known for known in self._subscribers if known is not deliver)
            if not self._subscribers and self._receive is not None:
                self._close(unlocked)

    def send(self, received: Received[M]) -> None:
        """Deliver ``received`` to all subscribers, on this thread."""
        with self._lock:
            if self._latched:
                self._last = received
            subscribers = self._subscribers
        for deliver in subscribers:
            deliver(received)

    def close(self) -> None:
        """Remove all subscribers and stop receiving; may be called twice."""
        with ExitStack() as unlocked, self._lock:
            self._close(unlocked)

    def _close(self, unlocked: ExitStack) -> None:
        # Receiving ends outside the lock, because a message that is being delivered may wait for it.
        if self._end is not None:
            unlocked.callback(self._end)
        self._subscribers, self._end, self._last = (), None, None


class BasePublisher(ABC, Generic[M]):
    """Publisher of a topic.

    Args:
        node: Name of its node in the graph.
        name: Full name of the topic in the graph.
        topic: The topic.
    """

    def __init__(self, node: str, name: str, topic: Topic[M]) -> None:
        self.node = node
        self.name = name
        self.topic = topic

    @property
    @abstractmethod
    def has_subscribers(self) -> bool:
        """Whether there are subscribers, in this process or another."""

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Send ``message`` to all subscribers; never waits for them."""
        check_type(self.topic, message)
        if self.topic.latched or self.has_subscribers:
            self._send(message, captured_s)

    def flush(self, timeout_s: float) -> None:
        """Wait until all reliable subscribers have what was published, for at most ``timeout_s`` seconds."""

    def close(self) -> None:
        """Stop publishing; may be called twice."""

    @abstractmethod
    def _send(self, message: M, captured_s: float | None) -> None: ...


class BaseTransport(ABC):
    """The part of a :class:`~handsteer.transports.base.Transport` that is the same for all.

    Args:
        publishers: Where open publishers are kept: a weak set if a publisher ends with its last reference.
    """

    crosses_network = False
    is_one_machine = False

    def __init__(self, publishers: MutableSet[BasePublisher[Any]]) -> None:
        self._types = TopicTypes()
        self._lock = threading.RLock()
        self._publishers = publishers
        self._fanouts: dict[str, Fanout[Any]] = {}

    def advertise(self, node: str, topic: Topic[M]) -> BasePublisher[M]:
        """Return a publisher of ``topic`` for the node named ``node``."""
        with self._lock:
            publisher = self._open_publisher(node, self._claim(topic), topic)
            self._publishers.add(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> Subscription:
        """Call ``deliver`` for each message on ``topic`` from now on."""
        return self._fanout(node, self._claim(topic), topic).add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the name of the node of each publisher of ``topic`` in this process."""
        name = self.topic_name(topic)
        with self._lock:
            return sorted(publisher.node for publisher in self._publishers if publisher.name == name)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic``."""
        return topic.name

    def full_name(self, node: str) -> str:
        """Return the full name of the node ``node``."""
        return node

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        with self._lock:
            publishers, fanouts = list(self._publishers), list(self._fanouts.values())
            self._publishers.clear()
            self._fanouts.clear()
        for publisher in publishers:
            publisher.close()
        for fanout in fanouts:
            fanout.close()

    def _claim(self, topic: Topic[Any]) -> str:
        name = self.topic_name(topic)
        self._types.claim(name, topic)
        return name

    def _fanout(self, node: str, name: str, topic: Topic[M]) -> Fanout[M]:
        with self._lock:
            if name not in self._fanouts:
                self._fanouts[name] = Fanout(latched=topic.latched, receive=self._reception(node, name, topic))
            return self._fanouts[name]

    @abstractmethod
    def _open_publisher(self, node: str, name: str, topic: Topic[M]) -> BasePublisher[M]:
        """Return a new publisher of ``topic``, whose full name is ``name``."""

    @abstractmethod
    def _reception(self, node: str, name: str, topic: Topic[M]) -> Receive[M] | None:
        """Return a function that starts to receive ``topic`` from elsewhere; None if messages only come from here."""


class InProcessTransport(BaseTransport):
    """Passes messages by reference, on the publisher's thread."""

    is_one_machine = True

    def __init__(self) -> None:
        super().__init__(weakref.WeakSet())

    def _open_publisher(self, node: str, name: str, topic: Topic[M]) -> BasePublisher[M]:
        return _InProcessPublisher(node, name, topic, self._fanout(node, name, topic))

    def _reception(self, node: str, name: str, topic: Topic[M]) -> None:
        return None


class _InProcessPublisher(BasePublisher[M]):
    def __init__(self, node: str, name: str, topic: Topic[M], fanout: Fanout[M]) -> None:
        super().__init__(node, name, topic)
        self._fanout = fanout

    @property
    def has_subscribers(self) -> bool:
        return self._fanout.has_subscribers

    def _send(self, message: M, captured_s: float | None) -> None:
        self._fanout.send(Received(message, captured_s, number=next(self._fanout.numbers)))
