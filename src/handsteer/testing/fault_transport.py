"""A transport that drops, delays, duplicates, reorders and holds messages on request."""

import heapq
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Generic, TypeVar

from handsteer.clock import Clock
from handsteer.messages import Topic
from handsteer.nodes.base import Node
from handsteer.transports.base import Publisher, Received, Subscription, Transport
from handsteer.transports.in_process import check_type
from handsteer.transports.timing import StaleMessageFilter, capture_time

M = TypeVar("M")
_Link = tuple[str, str]
"""A topic and the node that sends."""


@dataclass(frozen=True)
class LinkFault:
    """A fault of a topic's messages.

    Attributes:
        drop: Probability that a message is lost, 0 to 1.
        delay_s: Delay of each message, in seconds.
        jitter_s: Maximum of the random additional delay, in seconds. The order is kept, as over DDS, Zenoh and TCP.
        duplicate: Probability that a message arrives twice, 0 to 1.
        reorder: Probability that a message arrives after the next one, 0 to 1; the last one, without a next one, is not
            delivered.
        frozen: Messages are held, and delivered at once and in order when the fault ends.
    """

    drop: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    frozen: bool = False


CUT = LinkFault(drop=1.0)
"""All messages are lost."""
FROZEN = LinkFault(frozen=True)
"""Messages are held until the fault ends, then delivered at once."""


class FaultTransport:
    """A :class:`~handsteer.transports.base.Transport` around another one, with a fault on any of its topics.

    ::

        transport = FaultTransport(InProcessTransport(), clock, seed=1)
        graph = Graph(config, clock, transport)
        graph.add(transport.wire)
        transport.spoil(CMD_VEL, LinkFault(delay_s=0.2, drop=0.1))
        graph.run_stepped(10.0)
        transport.heal(CMD_VEL)

    The same seed and the same messages give the same faults. The node :attr:`wire` delivers delayed messages in time of
    the graph's clock, stepped or real; it must run with the other nodes.

    Args:
        inner: Carries the messages.
        clock: The graph's clock, in whose time messages are delayed.
        seed: Seed of the random numbers.
        guards: Whether late messages are handled as over DDS and Zenoh: of topics with a ``lifespan_s``, messages are
            dropped whose delay exceeds the sender's shortest one by more than it. A transport within one process does
            not need this, and ROS 1 cannot do it.
        carries_capture_times: Whether a sign carries the capture time of its frame. Over ROS, only messages with a
            header carry a time.

    Attributes:
        wire: Delivers delayed messages.
        clock: The graph's clock.
    """

    def __init__(
        self,
        inner: Transport,
        clock: Clock,
        *,
        seed: int = 0,
        guards: bool = True,
        carries_capture_times: bool = True,
    ) -> None:
        self.crosses_network = inner.crosses_network
        self.is_one_machine = inner.is_one_machine
        self._inner = inner
        self.clock = clock
        self._guards = guards
        self._carries_capture_times = carries_capture_times
        self._random = random.Random(seed)
        self._faults: dict[tuple[str, str | None], LinkFault] = {}
        # Delivery time of each link's last message whose order is kept.
        self._due_s: dict[_Link, float] = {}
        self.wire = _Wire(inner, clock)

    def spoil(self, topic: Topic[Any] | str, fault: LinkFault, *, sender: str | None = None) -> None:
        """Apply ``fault`` to messages of ``topic`` from now on, in place of its previous fault.

        Args:
            topic: The topic, or its name, such as ``/image_raw``.
            fault: The fault.
            sender: Only for messages of this node; overrides a fault for all senders.
        """
        self._faults[_name(topic), sender] = fault
        if not fault.frozen:
            self.wire.thaw(_name(topic), sender)

    def heal(self, topic: Topic[Any] | str, *, sender: str | None = None) -> None:
        """End the fault; held messages are delivered now, delayed ones when they are due."""
        self._faults.pop((_name(topic), sender), None)
        self.wire.thaw(_name(topic), sender)

    def advertise(self, node: str, topic: Topic[M]) -> "FaultPublisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        lateness = StaleMessageFilter(topic.lifespan_s) if self._guards and topic.lifespan_s is not None else None
        return FaultPublisher(self, node, topic, self._inner.advertise(node, topic), lateness)

    def subscribe(self, node: str, topic: Topic[M], deliver: Callable[[Received[M]], None]) -> Subscription:
        """Call ``deliver`` for each message on ``topic`` that is delivered."""
        return self._inner.subscribe(node, topic, deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the publishers that the inner transport knows: faults affect messages only."""
        return self._inner.publishers_of(topic)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the name of ``topic`` in the inner transport."""
        return self._inner.topic_name(topic)

    def full_name(self, node: str) -> str:
        """Return the name of ``node`` in the inner transport."""
        return self._inner.full_name(node)

    def close(self) -> None:
        """End all publishing and receiving; delayed messages are lost."""
        self.wire.clear()
        self._inner.close()

    def send(self, node: str, topic: Topic[Any], deliver: Callable[[], None]) -> None:
        """Schedule ``deliver`` for a message that ``node`` sends now, once per copy that arrives."""
        fault = self._faults.get((topic.name, node)) or self._faults.get((topic.name, None))
        if fault is None:
            deliver()
            return
        if self._random.random() < fault.drop:
            return
        link = (topic.name, node)
        for _ in range(2 if self._random.random() < fault.duplicate else 1):
            if fault.frozen or self._random.random() < fault.reorder:
                self.wire.hold(link, math.inf, deliver)
            else:
                due_s = self.clock.now() + fault.delay_s + self._random.uniform(0.0, fault.jitter_s)
                due_s = self._due_s[link] = max(due_s, self._due_s.get(link, due_s))
                self.wire.hold(link, due_s, deliver)
                self.wire.follow(link, due_s)

    def captured(self, message: object, captured_s: float | None) -> float | None:
        """Return the capture time received with a ``message`` that was sent with ``captured_s``."""
        return captured_s if self._carries_capture_times else capture_time(message, self.clock)


class FaultPublisher(Generic[M]):
    """Publisher of a topic that may have a fault."""

    def __init__(
        self,
        transport: FaultTransport,
        node: str,
        topic: Topic[M],
        inner: Publisher[M],
        lateness: StaleMessageFilter | None,
    ) -> None:
        self._transport = transport
        self._node = node
        self._topic = topic
        self._inner = inner
        self._lateness = lateness

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers."""
        return self._inner.has_subscribers

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Send ``message`` as the current fault has it."""
        check_type(self._topic, message)
        deliver = partial(self._arrive, message, captured_s, self._transport.clock.now())
        self._transport.send(self._node, self._topic, deliver)

    def _arrive(self, message: M, captured_s: float | None, sent_s: float) -> None:
        late = self._lateness is not None and self._lateness.is_late(b"", sent_s, self._transport.clock.now())
        if not late:
            self._inner.publish(message, self._transport.captured(message, captured_s))


@dataclass(order=True)
class _Message:
    due_s: float
    number: int
    link: _Link = field(compare=False)
    deliver: Callable[[], None] = field(compare=False)


class _Wire(Node):
    """Holds messages until they are due, and delivers them on its own thread or in a stepped run."""

    def __init__(self, transport: Transport, clock: Clock) -> None:
        super().__init__("wire", transport, clock)
        self._number = 0
        self._under_way: list[_Message] = []
        self._waiting: list[_Message] = []

    @property
    def next_due_s(self) -> float | None:
        """When the next message is due; None without one."""
        with self._wake:
            return self._under_way[0].due_s if self._under_way else None

    def spin_once(self) -> bool:
        """Deliver the messages that are due; return whether there were any."""
        with self._wake:
            due: list[_Message] = []
            while self._under_way and self._under_way[0].due_s <= self.clock.now():
                due.append(heapq.heappop(self._under_way))
        for message in due:
            self._guard(message.link[0], message.deliver)
        return bool(due)

    def hold(self, link: _Link, due_s: float, deliver: Callable[[], None]) -> None:
        """Call ``deliver`` at ``due_s``; if that is infinite, after another message of ``link``, or once thawed."""
        with self._wake:
            self._number += 1
            message = _Message(due_s, self._number, link, deliver)
            if math.isinf(due_s):
                self._waiting.append(message)
            else:
                heapq.heappush(self._under_way, message)
            self._wake.notify()

    def follow(self, link: _Link, due_s: float) -> None:
        """Schedule messages that wait for the one of ``link`` due at ``due_s`` right after it."""
        self._release(lambda waiting: waiting == link, due_s)

    def thaw(self, topic: str, sender: str | None) -> None:
        """Deliver all held messages of ``topic`` now; those of ``sender`` only, unless it is None."""
        self._release(lambda link: link[0] == topic and sender in (None, link[1]), self.clock.now())

    def clear(self) -> None:
        """Drop all waiting messages."""
        with self._wake:
            self._under_way, self._waiting = [], []

    def _release(self, is_meant: Callable[[_Link], bool], due_s: float) -> None:
        with self._wake:
            meant = [message for message in self._waiting if is_meant(message.link)]
            self._waiting = [message for message in self._waiting if not is_meant(message.link)]
            for message in meant:
                self._number += 1
                heapq.heappush(self._under_way, _Message(due_s, self._number, message.link, message.deliver))
            self._wake.notify()


def _name(topic: Topic[Any] | str) -> str:
    return topic if isinstance(topic, str) else topic.name
