"""What all transports have in common within a process: one type per topic, and several subscribers per message."""

import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.protocol import Received

M = TypeVar("M")
Deliver = Callable[[Received[M]], None]
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
    """The subscribers of a topic in this process; each message is received and decoded once for all of them.

    Args:
        latched: Whether a late subscriber gets the last message at once.
        receive: Called with a function for received messages when the first subscriber is added; starts receiving, and
            returns a function that ends it. None if messages come from this process.
    """

    def __init__(self, *, latched: bool, receive: Receive[M] | None = None) -> None:
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

    def add(self, deliver: Deliver[M]) -> "FanoutSubscription[M]":
        """Call ``deliver`` for each message from now on."""
        with self._lock:
            self._subscribers = (*self._subscribers, deliver)
            if self._last is not None:
                deliver(self._last)
            if self._receive is not None and self._end is None:
                self._end = self._receive(self.send)
        return FanoutSubscription(self, deliver)

    def remove(self, deliver: Deliver[M]) -> None:
        """Stop calling ``deliver``; does nothing if it was removed already."""
        with self._lock:
            self._subscribers = tuple(known for known in self._subscribers if known is not deliver)
            is_last = not self._subscribers and self._receive is not None
        if is_last:
            self.close()

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
        with self._lock:
            end, self._end = self._end, None
            self._subscribers, self._last = (), None
        # Outside the lock, because a message that is being delivered may wait for it.
        if end is not None:
            end()


class FanoutSubscription(Generic[M]):
    """A subscription to a topic."""

    def __init__(self, fanout: Fanout[M], deliver: Deliver[M]) -> None:
        self._fanout = fanout
        self._deliver = deliver

    def close(self) -> None:
        """End the subscription; may be called twice."""
        self._fanout.remove(self._deliver)
