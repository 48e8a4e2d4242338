"""Hands the messages of topics to the clients that have subscribed to them; what waits for each is limited."""

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

from handsteer.clock import Clock
from handsteer.messages import Topic
from handsteer.transports.base import Received, Subscription, Transport
from handsteer.transports.encoding import encode
from handsteer.transports.piped import kept

_NODE: Final = "foxglove"
_CHANGE_PERIOD_S: Final = 0.1
_MOST_REPLIES: Final = 16


class Message:
    """A message of a topic, encoded once for all clients when the first of them takes it.

    Args:
        message: The message.
        time_ns: When it was received, in ns since 1970.
    """

    def __init__(self, message: Any, time_ns: int) -> None:
        self.time_ns = time_ns
        self._message = message

    @cached_property
    def raw(self) -> bytes:
        """The message as little-endian CDR.

        Raises:
            Exception: It has a value that its type does not allow.
        """
        return encode(self._message)


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


class Feed:
    """A topic and its readers: clients with the numbers of their subscriptions.

    Args:
        topic: The topic.
        awake: Called on the thread of a message when :meth:`take` has something new.

    Attributes:
        readers: The subscription's number by the client's outbox.
        last: The last message of a latched topic.
        subscription: Of the topic, while there are readers.
    """

    def __init__(self, topic: Topic[Any], awake: Callable[["Feed"], None], clock: Clock) -> None:
        self.topic = topic
        self.keep = kept(topic)
        self.readers: dict[Outbox, int] = {}
        self.last: Message | None = None
        self.subscription: Subscription | None = None
        self._awake = awake
        self._clock = clock
        self._lock = threading.Lock()
        self._arrived: deque[Message] = deque(maxlen=self.keep)

    def deliver(self, received: Received[Any]) -> None:
        """Keep a message until it is taken, the newest ones only; on any thread."""
        stamp = self._clock.stamp(self._clock.now())
        message = Message(received.message, stamp.sec * 1_000_000_000 + stamp.nanosec)
        with self._lock:
            is_first = not self._arrived
            self._arrived.append(message)
        if is_first:
            self._awake(self)

    def take(self) -> list[Message]:
        """Return what has arrived since."""
        with self._lock:
            messages = list(self._arrived)
            self._arrived.clear()
        return messages


class Feeds:
    """The topics; each is subscribed only while a client reads it. To be used on one event loop.

    Args:
        transport: Carries the messages.
        clock: The graph's clock, for the times of messages.
        topics: What to offer.

    Attributes:
        channels: Full name and topic by the number of the channel.
    """

    def __init__(self, transport: Transport, clock: Clock, topics: Sequence[Topic[Any]]) -> None:
        named = ((transport.topic_name(topic), topic) for topic in topics)
        self.channels: Mapping[int, tuple[str, Topic[Any]]] = dict(enumerate(named, start=1))
        self._transport = transport
        self._loop = asyncio.get_running_loop()
        self._feeds = {number: Feed(topic, self._wake, clock) for number, (_, topic) in self.channels.items()}
        self._changed = asyncio.Event()

    def join(self, channel: int, outbox: Outbox, subscription: int) -> None:
        """Give a client the messages of a channel from now on; a latched topic's last message at once."""
        feed = self._feeds[channel]
        feed.readers[outbox] = subscription
        if feed.last is not None:
            outbox.put(subscription, feed.last, feed.keep)
        self._changed.set()

    def leave(self, channel: int, outbox: Outbox) -> None:
        """Give a client no more messages of a channel."""
        self._feeds[channel].readers.pop(outbox, None)
        self._changed.set()

    async def keep_subscribed(self) -> None:
        """Subscribe to the topics that have readers, and end the other subscriptions, until cancelled.

        Clients that change their minds all the time cost the graph ten changes a second at most.
        """
        try:
            while True:
                await self._changed.wait()
                self._changed.clear()
                for feed in self._feeds.values():
                    self._follow(feed)
                await asyncio.sleep(_CHANGE_PERIOD_S)
        finally:
            for feed in self._feeds.values():
                feed.readers.clear()
                self._follow(feed)

    def _follow(self, feed: Feed) -> None:
        if feed.readers and feed.subscription is None:
            feed.subscription = self._transport.subscribe(_NODE, feed.topic, feed.deliver)
        elif not feed.readers and feed.subscription is not None:
            feed.subscription.close()
            feed.subscription = feed.last = None

    def _wake(self, feed: Feed) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._pass_on, feed)

    def _pass_on(self, feed: Feed) -> None:
        for message in feed.take():
            if feed.topic.latched and feed.subscription is not None:
                feed.last = message
            for outbox, subscription in feed.readers.items():
                outbox.put(subscription, message, feed.keep)
