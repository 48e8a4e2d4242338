"""Messages over ROS 1: one ROS node for all nodes of this process."""

import re
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Generic, TypeVar

import rosgraph
import rospy

from handsteer.clock import Clock
from handsteer.messages import Topic, type_name
from handsteer.transports.channels import Deliver, Fanout, FanoutSubscription, TopicTypes, check_type
from handsteer.transports.protocol import Received
from handsteer.transports.ros1.conversion import from_ros1, ros1_type, to_ros1
from handsteer.transports.ros1.master import SystemState
from handsteer.transports.ros1.prompt import keep_freed_memory, send_promptly
from handsteer.transports.stamps import capture_time

M = TypeVar("M")

# With rospy's default of 64 kB, images wait in the socket for a callback that is slower than the camera. Only for
# images, because allocating the buffer has a cost per message.
_BUFFER_BYTES = {"sensor_msgs/msg/Image": 2**24, "sensor_msgs/msg/CompressedImage": 2**22}
_SMALL_BUFFER_BYTES = 2**16
_PLAYER = re.compile(r"(/\w+)*/play_\d{6,}", re.ASCII)


class Ros1Transport:
    """A :class:`~handsteer.transports.protocol.Transport` over rospy, which must have been initialised.

    Capture times are the stamps of message headers; messages without a header have none.

    Args:
        clock: The graph's clock.
        topics: New names of topics, by their full default names. Remapping overrides it.
    """

    # TCP loses no part of a large image, and the course's cameras publish raw ones only.
    crosses_network = False

    def __init__(self, clock: Clock, topics: Mapping[str, str] | None = None) -> None:
        self._clock = clock
        self._topics = topics or {}
        self._types = TopicTypes()
        self._lock = threading.Lock()
        self._outgoing: dict[str, Ros1Publisher[Any]] = {}
        self._incoming: dict[str, Fanout[Any]] = {}
        self._state = SystemState()

    def advertise(self, node: str, topic: Topic[M]) -> "Ros1Publisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._outgoing:
                self._outgoing[name] = Ros1Publisher(topic, name)
            return self._outgoing[name]

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> FanoutSubscription[M]:
        """Call ``deliver`` for each message on ``topic`` from now on, on the thread of its connection."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._incoming:
                self._incoming[name] = Fanout(latched=topic.latched, receive=partial(self._receive, name, topic))
            fanout: Fanout[M] = self._incoming[name]
        return fanout.add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS nodes that publish ``topic``, as last reported by the master.

        A killed node stays registered at the master (``rosnode cleanup``).
        """
        return self._state.publishers_of(self._full_name(topic))

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped."""
        return self._full_name(topic)

    def full_name(self, node: str) -> str:
        """Return the ROS node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
        return f"{rospy.get_name().removeprefix('/')}: {node}"

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        self._state.close()
        with self._lock:
            publishers, incoming = list(self._outgoing.values()), list(self._incoming.values())
            self._outgoing = {}
            self._incoming = {}
        for publisher in publishers:
            publisher.close()
        for channel in incoming:
            channel.close()

    def _claim(self, topic: Topic[Any]) -> str:
        """Claim ``topic`` and return its full name, with namespace and remapping."""
        name = self._full_name(topic)
        self._types.claim(name, topic)
        return name

    def _full_name(self, topic: Topic[Any]) -> str:
        """Return the name with namespace and remapping, which rospy does not change again."""
        name = str(rospy.resolve_name(topic.ros_name))
        is_remapped = name != rosgraph.names.resolve_name(topic.ros_name, rospy.get_name())
        if is_remapped:
            return name
        if topic.name in self._topics:
            return str(rospy.resolve_name(self._topics[topic.name]))
        if topic.beneath is None:
            return name
        return topic.moved_with(self._full_name(topic.beneath))

    def _receive(self, name: str, topic: Topic[M], send: Deliver[M]) -> Callable[[], None]:
        kind = type_name(topic.type)

        def on_message(theirs: Any) -> None:
            message = from_ros1(theirs, kind)
            captured_s = capture_time(message, self._clock)
            send(Received(message, captured_s, by_player=captured_s is not None and _is_player(theirs)))

        size = _BUFFER_BYTES.get(kind, _SMALL_BUFFER_BYTES)
        if size > _SMALL_BUFFER_BYTES:
            keep_freed_memory()
        subscriber = rospy.Subscriber(
            name, ros1_type(kind), on_message, queue_size=topic.depth, buff_size=size, tcp_nodelay=True
        )
        return subscriber.unregister  # type: ignore[no-any-return]


def _is_player(theirs: Any) -> bool:
    """Return whether ``rosbag play`` sent a message: its nodes are always called play and the time."""
    header = getattr(theirs, "_connection_header", None) or {}
    return _PLAYER.fullmatch(header.get("callerid", "")) is not None


class Ros1Publisher(Generic[M]):
    """Publisher of a topic."""

    def __init__(self, topic: Topic[M], name: str) -> None:
        self._topic = topic
        there = ros1_type(type_name(topic.type))
        self._publisher: Any = rospy.Publisher(
            name, there, queue_size=topic.depth, latch=topic.latched, tcp_nodelay=True
        )
        if topic.lifespan_s is not None:  # commands and signs are small and frequent, and useless when late
            send_promptly(self._publisher, topic.depth)

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers, in this process or another."""
        publisher = self._publisher
        return publisher is not None and publisher.get_num_connections() > 0

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Pass ``message`` to rospy, whose senders, one per subscriber, drop messages for slow ones."""
        check_type(self._topic, message)
        publisher = self._publisher
        if publisher is None or not (self._topic.latched or self.has_subscribers):
            return
        try:
            publisher.publish(to_ros1(message))
        except rospy.ROSException:
            if self._publisher is not None and not rospy.is_shutdown():
                raise

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.unregister()
