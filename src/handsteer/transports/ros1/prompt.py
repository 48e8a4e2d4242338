"""Cheaper replacements for two operations of rospy: sending, which wakes a thread per message, and receiving images."""

import ctypes
import functools
import socket
from collections.abc import Callable
from typing import Any

import rospy
from rospy.impl.tcpros_pubsub import QueuedConnection

# Names and numbers of malloc.h; glibc accepts no larger threshold than this.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
_LARGEST_KEPT_BYTES = 2**25


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
    """Let a ``rospy.Publisher`` send on the publishing thread what a subscriber's socket accepts at once.

    Args:
        publisher: One without subscribers yet.
        depth: How many messages may wait for a slow subscriber.
    """
    implementation = publisher.impl
    add = implementation.add_connection
    implementation.set_queue_size(None)
    implementation.add_connection = lambda connection: add(PromptConnection(connection, depth))


class PromptConnection:
    """A subscriber's connection that never blocks: what its socket does not accept at once waits in a queue.

    From then on, all messages go through rospy's queue, with its sending thread.

    Args:
        connection: rospy's own.
        depth: How many messages may wait; older ones are dropped.
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
