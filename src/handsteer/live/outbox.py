"""What waits for one client; it is limited, whatever the client reads."""

import asyncio
from collections import deque
from collections.abc import Hashable
from typing import Any

from handsteer.transports.ros2.encoding import encode

_MOST_REPLIES = 16


class Message:
    """A message of a topic, encoded once for all clients when the first of them takes it.

    Args:
        message: The message.
        time_ns: When it was received, in ns since 1970.
    """

    def __init__(self, message: Any, time_ns: int) -> None:
        self.time_ns = time_ns
        self._message = message
        self._raw: bytes | None = None

    def raw(self) -> bytes:
        """Return the message as little-endian CDR.

        Raises:
            Exception: It has a value that its type does not allow.
        """
        if self._raw is None:
            self._raw = encode(self._message)
        return self._raw


class Outbox:
    """Replies and messages for a client, in order; used on one event loop.

    Of each subscription the newest messages are kept, as many as its topic allows, and the oldest dropped.
    """

    def __init__(self) -> None:
        self._queues: dict[Hashable, deque[Any]] = {}
        self._order: deque[Hashable] = deque()
        self._news = asyncio.Event()

    def reply(self, text: str) -> None:
        """Add a text message; the oldest are dropped if many wait."""
        self._put(None, text, _MOST_REPLIES)

    def put(self, subscription: int, message: Message, keep: int) -> None:
        """Add a message of a subscription, of which the newest ``keep`` messages are kept."""
        self._put(subscription, message, keep)

    def forget(self, subscription: int) -> None:
        """Drop what waits of a subscription."""
        if self._queues.pop(subscription, None) is not None:
            self._order = deque(key for key in self._order if key != subscription)

    async def take(self) -> tuple[int, Message] | str:
        """Wait for the oldest message; return it with its subscription, or a text."""
        while not self._order:
            self._news.clear()
            await self._news.wait()
        key = self._order.popleft()
        queue = self._queues[key]
        what = queue.popleft()
        if not queue:
            del self._queues[key]
        return what if isinstance(what, str) else (key, what)  # type: ignore[return-value]  # only texts have no key

    def _put(self, key: Hashable, what: object, keep: int) -> None:
        queue = self._queues.setdefault(key, deque(maxlen=keep))
        if len(queue) < keep:
            self._order.append(key)
        queue.append(what)
        self._news.set()
