"""Messages over ROS 1, by rospy, with cheaper replacements for two of its operations.

rospy's sending wakes a thread per message, and its receiving of images returns all memory to the system each time.
"""

import ctypes
import functools
import itertools
import re
import socket
import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import rosgraph
import rospy
from rospy.impl.tcpros_pubsub import QueuedConnection

from handsteer.clock import Clock
from handsteer.messages import STOPPED, Bool, Topic, type_name
from handsteer.plugins.ros1.conversion import from_ros1, ros1_type, to_ros1
from handsteer.plugins.ros1.master import SystemState
from handsteer.timeouts import HEAR_STOP_S
from handsteer.transports.base import Deliver, Received
from handsteer.transports.encoding import MessageReader
from handsteer.transports.in_process import BasePublisher, BaseTransport, Receive
from handsteer.transports.timing import StaleMessageFilter, capture_time

M = TypeVar("M")

# With rospy's default of 64 kB, images wait in the socket for a callback that is slower than the camera. Only for
# images, because allocating the buffer has a cost per message.
_BUFFER_BYTES = {"sensor_msgs/msg/Image": 2**24, "sensor_msgs/msg/CompressedImage": 2**22}
_SMALL_BUFFER_BYTES = 2**16
_PLAYER = re.compile(r"(/\w+)*/play_\d{6,}", re.ASCII)
# Names and numbers of malloc.h; glibc accepts no larger threshold than this.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
_LARGEST_KEPT_BYTES = 2**25


class Ros1Transport(BaseTransport):
    """A :class:`~handsteer.transports.base.Transport` over rospy, as one ROS node for all nodes of this process.

    rospy must have been initialised; it delivers messages on a thread for each connection. Capture times are the stamps
    of message headers; messages without a header have none.

    Args:
        clock: The graph's clock.
        topics: New names of topics, by their full default names. Remapping overrides it.
        was_stopped: Whether a Stop is in force from before: subscribers of ``/stopped`` receive it first.
    """

    # TCP loses no part of a large image, and the course's cameras publish raw ones only.
    crosses_network = False

    def __init__(self, clock: Clock, topics: Mapping[str, str] | None = None, *, was_stopped: bool = False) -> None:
        super().__init__(set())
        self._was_stopped = was_stopped
        self._clock = clock
        self._topics = topics or {}
        self._state = SystemState()

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS nodes that publish ``topic``, as last reported by the master.

        A killed node stays registered at the master (``rosnode cleanup``).
        """
        return self._state.publishers_of(self.topic_name(topic))

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the full name, with namespace and remapping, which rospy does not change again."""
        name = str(rospy.resolve_name(topic.ros_name))
        is_remapped = name != rosgraph.names.resolve_name(topic.ros_name, rospy.get_name())
        if is_remapped:
            return name
        if topic.name in self._topics:
            return str(rospy.resolve_name(self._topics[topic.name]))
        if topic.beneath is None:
            return name
        return topic.moved_with(self.topic_name(topic.beneath))

    def full_name(self, node: str) -> str:
        """Return the ROS node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
        return f"{rospy.get_name().removeprefix('/')}: {node}"

    @property
    def is_stopped(self) -> bool:
        """Whether a Stop is in force: by the last message of this process on ``/stopped``, else from before."""
        name = self.topic_name(STOPPED)
        with self._lock:
            mine = [each for each in self._publishers if isinstance(each, _Ros1Publisher) and each.name == name]
        said = [publisher.latched for publisher in mine if publisher.latched is not None]
        return Bool(data=True) in said if said else self._was_stopped

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        self._state.close()
        super().close()

    def _open_publisher(self, node: str, name: str, topic: Topic[M]) -> BasePublisher[M]:
        known = next((publisher for publisher in self._publishers if publisher.name == name), None)
        return known or _Ros1Publisher(rospy.get_name(), name, topic)

    def _reception(self, node: str, name: str, topic: Topic[M]) -> Receive[M]:
        kind = type_name(topic.type)
        size = _BUFFER_BYTES.get(kind, _SMALL_BUFFER_BYTES)

        def receive(send: Deliver[M]) -> Callable[[], None]:
            stops = topic.stops
            kept = _Kept(self._state.publishers_before(name)) if stops is not None else None
            stale = None if topic.lifespan_s is None else StaleMessageFilter(topic.lifespan_s)

            if self._was_stopped and topic.name == STOPPED.name:
                send(Received(topic.type(data=True)))  # type: ignore[call-arg]

            reader: MessageReader[M] = MessageReader(name, lambda raw: from_ros1(raw, kind))

            def on_message(theirs: Any) -> None:
                message = reader.read(theirs.raw)
                if message is None:
                    return
                captured_s = capture_time(message, self._clock)
                is_kept = kept is not None and kept.has(theirs)
                by_player = captured_s is not None and _is_player(theirs)
                is_late = False
                if stale is not None and captured_s is not None and not by_player:  # ROS 1 has no times of sending
                    is_late = stale.is_late(_sender(theirs).encode(), captured_s, self._clock.now())
                if not (is_kept or is_late):
                    send(Received(message, captured_s, by_player=by_player))
                elif stops is not None and stops(message):
                    send(Received(message, captured_s, is_late=True))

            is_image = size > _SMALL_BUFFER_BYTES
            if is_image:
                keep_freed_memory()
            # rospy would drop images of a bag, too; of a camera's, the node keeps the newest itself.
            depth = None if is_image else topic.depth
            subscriber = rospy.Subscriber(
                name, ros1_type(kind), on_message, queue_size=depth, buff_size=size, tcp_nodelay=True
            )
            return subscriber.unregister  # type: ignore[no-any-return]

        return receive


def _is_player(theirs: Any) -> bool:
    """Return whether ``rosbag play`` sent a message: its nodes are always called play and the time."""
    return _PLAYER.fullmatch(_sender(theirs)) is not None


def _sender(theirs: Any) -> str:
    return _header(theirs).get("callerid", "")


def _header(theirs: Any) -> Mapping[str, str]:
    return getattr(theirs, "_connection_header", None) or {}


class _Kept:
    """Recognises what publishers that latch had sent before we subscribed, such as ``rostopic pub`` without ``-1``.

    They send it again to each new subscriber, as its first message: it says nothing of now.

    Args:
        publishers: The nodes that published the topic before; None if that is not known.
    """

    def __init__(self, publishers: set[str] | None) -> None:
        self._waits = publishers
        self._until_s = time.monotonic() + HEAR_STOP_S

    def has(self, theirs: Any) -> bool:
        """Return whether a message is one of these; each has to be asked for, once."""
        publisher, latches = _sender(theirs), _header(theirs).get("latching") == "1"
        if self._waits is None:
            return latches and time.monotonic() < self._until_s
        if publisher not in self._waits:
            return False
        self._waits.discard(publisher)
        return latches


class _Ros1Publisher(BasePublisher[M]):
    def __init__(self, node: str, name: str, topic: Topic[M]) -> None:
        super().__init__(node, name, topic)
        self.latched: M | None = None
        self._numbers = itertools.count(1)
        kind = ros1_type(type_name(topic.type))
        self._publisher: Any = rospy.Publisher(
            name, kind, queue_size=topic.depth, latch=topic.latched, tcp_nodelay=True
        )
        if topic.lifespan_s is not None:  # commands and signs are small and frequent, and useless when late
            send_promptly(self._publisher, topic.depth)

    @property
    def has_subscribers(self) -> bool:
        publisher = self._publisher
        return publisher is not None and publisher.get_num_connections() > 0

    def close(self) -> None:
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.unregister()

    def _send(self, message: M, captured_s: float | None) -> None:
        publisher = self._publisher
        if publisher is None:
            return
        if self.topic.latched:
            self.latched = message
        try:
            # rospy's senders, one per subscriber, drop messages for slow ones.
            publisher.publish(to_ros1(message, next(self._numbers)))
        except rospy.ROSException:
            if self._publisher is not None and not rospy.is_shutdown():
                raise


@functools.cache
def keep_freed_memory() -> None:
    """Let the allocator keep freed memory, up to 32 MB at once; does nothing where there is no ``mallopt``.

    rospy allocates a buffer of 16 MB for each read of an image. By default the library returns each to the system and
    gets the next one from there, page by page, which takes as long as everything else in receiving an image.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError):
        return
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT_BYTES)
    mallopt(_M_TRIM_THRESHOLD, 2 * _LARGEST_KEPT_BYTES)


def send_promptly(publisher: Any, depth: int) -> None:
    """Let a new ``rospy.Publisher`` send on the publishing thread what a subscriber's socket accepts at once.

    Up to ``depth`` messages wait for a slow subscriber.
    """
    implementation = publisher.impl
    add = implementation.add_connection
    implementation.set_queue_size(None)
    implementation.add_connection = lambda connection: add(PromptConnection(connection, depth))


class PromptConnection:
    """A connection of rospy's to a subscriber that never blocks: what its socket does not accept at once is queued.

    From then on, all messages go through rospy's queue, which keeps ``depth`` of them, and has its own sending thread.
    """

    def __init__(self, connection: Any, depth: int) -> None:
        self._connection = connection
        self._depth = depth
        self._queue: QueuedConnection | None = None
        # Python waits despite MSG_DONTWAIT if a socket has a timeout, which rospy sets for new ones.
        connection.socket.setblocking(True)

    def __getattr__(self, name: str) -> Any:
        # Other attributes are the connection's, as in rospy's own queue.
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._connection, name)

    def write_data(self, data: bytes) -> bool:
        """Send or queue a message; rospy never calls this concurrently.

        Raises:
            rospy.exceptions.TransportException: The subscriber has left.
        """
        if self._queue is None:
            sent = self._send(data)
            if sent == len(data):
                return True
            self._queue = QueuedConnection(_Rest(self._connection, data[sent:]), self._depth)
            data = b""  # sends the rest of this message
        return bool(self._queue.write_data(data))

    def _send(self, data: bytes) -> int:
        """Return how many bytes the socket has accepted."""
        connection = self._connection
        if not connection.socket or connection.done:
            raise rospy.exceptions.TransportTerminated("connection closed")
        try:
            sent = int(connection.socket.send(data, socket.MSG_DONTWAIT))
        except BlockingIOError:
            return 0
        except OSError as error:
            connection.close()
            raise rospy.exceptions.TransportTerminated(str(error)) from None
        connection.stat_bytes += sent
        connection.stat_num_msg += 1
        return sent


class _Rest:
    """A connection that sends the rest of a message first."""

    def __init__(self, connection: Any, rest: bytes) -> None:
        self._connection = connection
        self._rest = rest

    @property
    def done(self) -> bool:
        return bool(self._connection.done)

    def set_cleanup_callback(self, callback: Callable[[Any], None]) -> None:
        """Call it when the connection ends, after the topic's own callback."""
        before = self._connection.cleanup_cb

        def end(connection: Any) -> None:
            if before:
                before(connection)
            callback(connection)

        self._connection.set_cleanup_callback(end)

    def write_data(self, data: bytes) -> None:
        rest, self._rest = self._rest, b""
        self._connection.write_data(rest + data)
