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


@dataclass
class Inbox(Generic[M]):
    """The newest messages of a topic that wait for a node.

    Attributes:
        topic: Full name of the topic.
        callback: Processes each message.
        key: Returns what distinguishes several publishers, whose newest messages are kept each; None for one publisher.
        depth: How many messages are kept, of each publisher.
    """

    topic: str
    callback: Callable[[Received[M]], None]
    key: Callable[[M], Hashable] | None
    depth: int = 1
    _newest: dict[Hashable, deque[Received[M]]] = field(default_factory=dict)

    @property
    def filled(self) -> bool:
        """Whether messages wait."""
        return bool(self._newest)

    def put(self, received: Received[M]) -> None:
        """Add a message; the oldest one beyond the depth is dropped."""
        key = self.key(received.message) if self.key else None
        self._newest.setdefault(key, deque(maxlen=self.depth)).append(received)

    def take(self) -> list[Received[M]]:
        """Remove and return all messages, oldest first."""
        taken = [received for waiting in self._newest.values() for received in waiting]
        self._newest.clear()
        return taken


class FailureLog:
    """Logs callbacks that raise: the first time with the traceback, later the count at a limited rate.

    Args:
        node: Name of the node.
    """

    def __init__(self, node: str) -> None:
        self._node = node
        self._failures: dict[tuple[str, type[Exception]], _Failure] = {}

    def add(self, source: str, error: Exception, now_s: float) -> None:
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
