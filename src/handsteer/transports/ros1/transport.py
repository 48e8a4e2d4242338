"""Messages over ROS 1: one ROS node for all nodes of this process, as rospy has it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import rosgraph
import rospy

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.protocol import Received
from handsteer.transports.ros1.conversion import from_ros1, ros1_type, to_ros1
from handsteer.transports.stamps import capture_time

M = TypeVar("M")
Deliver = Callable[[Received[M]], None]

# With rospy's default of 64 kB, images wait in the socket for a callback that is slower than the camera.
_BUFFER_BYTES = 2**24


class Ros1Transport:
    """A :class:`~handsteer.transports.protocol.Transport` over rospy, which must have been initialised.

    Capture times travel in the stamps of message headers; messages without a header come without one.

    Args:
        clock: The graph's clock.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._types: dict[str, type] = {}
        self._outgoing: dict[str, Ros1Publisher[Any]] = {}
        self._incoming: dict[str, _Incoming[Any]] = {}

    def advertise(self, node: str, topic: Topic[M]) -> "Ros1Publisher[M]":
        """Return the sending end of ``topic`` for the node named ``node``."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._outgoing:
                self._outgoing[name] = Ros1Publisher(topic, name)
            return self._outgoing[name]

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> "Ros1Subscription[M]":
        """Call ``deliver`` for each message on ``topic`` from now on, on the thread of the connection it came by."""
        name = self._claim(topic)
        with self._lock:
            incoming = self._incoming.setdefault(name, _Incoming(topic, name, self._clock))
        incoming.add(deliver)
        return Ros1Subscription(incoming, deliver)

    def full_name(self, node: str) -> str:
        """Return the ROS node's name and ``node``, as ROS's own diagnostics do: ``r1/my_camera: my_camera``."""
        return f"{rospy.get_name().removeprefix('/')}: {node}"

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        with self._lock:
            publishers, incoming = list(self._outgoing.values()), list(self._incoming.values())
            self._outgoing = {}
            self._incoming = {}
        for publisher in publishers:
            publisher.close()
        for channel in incoming:
            channel.close()

    def _claim(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic``, namespace and remappings included, unless it is in use otherwise."""
        name = _full_name(topic)
        with self._lock:
            known = self._types.setdefault(name, topic.type)
        if known is not topic.type:
            raise TransportError(f"{name} carries {type_name(known)}, it cannot carry {type_name(topic.type)} too")
        return name


class Ros1Publisher(Generic[M]):
    """The sending end of a topic."""

    def __init__(self, topic: Topic[M], name: str) -> None:
        self._topic = topic
        there = ros1_type(type_name(topic.type))
        self._publisher: Any = rospy.Publisher(
            name, there, queue_size=topic.depth, latch=topic.latched, tcp_nodelay=True
        )

    @property
    def wanted(self) -> bool:
        """Whether anybody listens, in this process or another."""
        publisher = self._publisher
        return publisher is not None and publisher.get_num_connections() > 0

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Give ``message`` to rospy's senders, one a subscriber, which drop what a slow one leaves waiting."""
        if not isinstance(message, self._topic.type):
            raise TransportError(
                f"{self._topic.name} carries {type_name(self._topic.type)}, not {type_name(type(message))}"
            )
        publisher = self._publisher
        if publisher is None or not (self._topic.latched or self.wanted):
            return
        try:
            publisher.publish(to_ros1(message))
        except rospy.ROSException:
            if self._publisher is not None and not rospy.is_shutdown():
                raise

    def close(self) -> None:
        """Send no more; may be called twice."""
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.unregister()


class Ros1Subscription(Generic[M]):
    """The receiving end of a topic."""

    def __init__(self, incoming: "_Incoming[M]", deliver: Deliver[M]) -> None:
        self._incoming = incoming
        self._deliver = deliver

    def close(self) -> None:
        """Receive no more; may be called twice."""
        self._incoming.remove(self._deliver)


@dataclass
class _Incoming(Generic[M]):
    """One topic's subscribers in this process: they share one connection, and each message is converted once."""

    topic: Topic[M]
    name: str
    clock: Clock
    subscribers: tuple[Deliver[M], ...] = ()
    _subscriber: Any = None
    _last: Received[M] | None = None
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def add(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = (*self.subscribers, deliver)
            if self._last is not None:
                deliver(self._last)
            if self._subscriber is None:
                there = ros1_type(type_name(self.topic.type))
                self._subscriber = rospy.Subscriber(
                    self.name,
                    there,
                    self._on_message,
                    queue_size=self.topic.depth,
                    buff_size=_BUFFER_BYTES,
                    tcp_nodelay=True,
                )

    def remove(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = tuple(known for known in self.subscribers if known is not deliver)
            if not self.subscribers:
                self.close()

    def close(self) -> None:
        with self._lock:
            subscriber, self._subscriber = self._subscriber, None
            self.subscribers, self._last = (), None
        if subscriber is not None:
            subscriber.unregister()

    def _on_message(self, theirs: Any) -> None:
        message = from_ros1(theirs, type_name(self.topic.type))
        received = Received(message, capture_time(message, self.clock))
        with self._lock:
            if self.topic.latched:
                self._last = received
            subscribers = self.subscribers
        for deliver in subscribers:
            deliver(received)


def _full_name(topic: Topic[Any]) -> str:
    """Return the name after namespace and remappings, which rospy leaves as it is when it is given."""
    name = str(rospy.resolve_name(topic.ros_name))
    is_remapped = name != rosgraph.names.resolve_name(topic.ros_name, rospy.get_name())
    if topic.beneath is None or is_remapped:
        return name
    return _full_name(topic.beneath) + topic.name.removeprefix(topic.beneath.name)
