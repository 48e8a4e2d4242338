"""What a node calls: its inboxes and timers, and the log of those that fail."""

import logging
import math
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from handsteer.errors import HandsteerError
from handsteer.transports.base import Received

M = TypeVar("M")
log = logging.getLogger(__name__)

FAILURES_LOGGED_EVERY_S = 10.0
"""Log period of a callback that fails repeatedly; bad pictures may arrive thirty times a second."""

_LONGEST_REASON = 200


@dataclass
class Timer:
    """A periodic callback.

    Attributes:
        period_s: Time between two calls; 0 calls it in every cycle.
        callback: What to call.
        due_s: Time of the next call, on the graph's clock.
    """

    period_s: float
    callback: Callable[[], None]
    due_s: float

    def schedule_next(self, now_s: float) -> None:
        """Schedule the call after the one at ``now_s``."""
        self.due_s += self.period_s
        if self.due_s <= now_s:
            self.due_s = now_s + self.period_s

    def delay_until(self, time_s: float) -> None:
        """Skip all calls before ``time_s``."""
        self.due_s = max(self.due_s, time_s)


@dataclass(eq=False)
class Inbox(Generic[M]):
    """The newest messages of a topic that wait for a node.

    Attributes:
        topic: Full name of the topic.
        callback: Processes each message.
        key: Returns what distinguishes several publishers, whose newest messages are kept each; None for one publisher.
        depth: How many messages are kept, of each publisher.
        queue: Where messages wait that are processed each, in order; None if there are none.
    """

    topic: str
    callback: Callable[[Received[M]], None]
    key: Callable[[M], Hashable] | None
    depth: int = 1
    queue: "Queue[M] | None" = None
    _newest: dict[Hashable, deque[Received[M]]] = field(default_factory=dict)

    @property
    def filled(self) -> bool:
        """Whether messages wait."""
        return bool(self._newest or self.queue)

    def put(self, received: Received[M]) -> None:
        """Add a message; the oldest one beyond the depth is dropped."""
        if self.queue is not None and self.queue.takes(received):
            self.queue.put(received, self.topic)
            return
        key = self.key(received.message) if self.key else None
        self._newest.setdefault(key, deque(maxlen=self.depth)).append(received)

    def take(self) -> list[Received[M]]:
        """Remove and return all messages, oldest first, but only one of the queue: timers must not wait for many."""
        taken = [received for waiting in self._newest.values() for received in waiting]
        self._newest.clear()
        return [self.queue.take(), *taken] if self.queue else taken


class Queue(Generic[M]):
    """Messages that are processed each, in order, up to a total size; beyond it, new ones are dropped with a warning.

    Args:
        takes: Returns whether a message belongs into it; called on the thread that delivers.
        size: Returns the size of a message in bytes.
        most_bytes: The total size; one message always fits.
        advice: What to do when it is full, for the warning.
    """

    def __init__(
        self, takes: Callable[[Received[M]], bool], size: Callable[[M], int], most_bytes: int, advice: str
    ) -> None:
        self.takes = takes
        self._size = size
        self._most_bytes = most_bytes
        self._advice = advice
        self._waiting: deque[Received[M]] = deque()
        self._bytes = 0
        self._is_full = False

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, received: Received[M], topic: str) -> None:
        """Add a message of the topic named ``topic``."""
        size = self._size(received.message)
        if self._waiting and self._bytes + size > self._most_bytes:
            if not self._is_full:
                log.warning("%s: %d messages wait, and new ones are dropped: %s", topic, len(self), self._advice)
            self._is_full = True
            return
        self._waiting.append(received)
        self._bytes += size

    def take(self) -> Received[M]:
        """Remove and return the oldest message."""
        received = self._waiting.popleft()
        self._bytes -= self._size(received.message)
        self._is_full = self._is_full and bool(self._waiting)
        return received


class FailureLog:
    """Logs callbacks that raise: the first time with the traceback, later the count at a limited rate.

    Args:
        node: Name of the node.
    """

    def __init__(self, node: str) -> None:
        self._node = node
        self._failures: dict[tuple[str, type[BaseException]], _Failure] = {}

    def add(self, source: str, error: BaseException, now_s: float) -> None:
        """Record that the callback of ``source`` has raised ``error`` at ``now_s``."""
        failure = self._failures.setdefault((source, type(error)), _Failure())
        failure.count += 1
        if now_s - failure.logged_s < FAILURES_LOGGED_EVERY_S:
            return
        if failure.count == 1 and isinstance(error, HandsteerError):
            # Something from outside that is wrong: where it was noticed in our code helps no one.
            log.error("%s: callback of %s failed: %s", self._node, source, error)
        elif failure.count == 1:
            log.error("%s: callback of %s failed", self._node, source, exc_info=error)
        else:
            reason = str(error)[:_LONGEST_REASON]
            log.error("%s: callback of %s has failed %d times: %s", self._node, source, failure.count, reason)
        failure.logged_s = now_s


@dataclass
class _Failure:
    count: int = 0
    logged_s: float = -math.inf
