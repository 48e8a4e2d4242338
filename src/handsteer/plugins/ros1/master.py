"""The ROS 1 master: requests with short timeouts, a connection that detects its end, and its topics."""

import errno
import http.client
import logging
import select
import socket
import threading
import urllib.parse
import xmlrpc.client
from typing import Any

import rosgraph
import rospy

from handsteer.errors import TransportError

_TIMEOUT_S = 2.0
_LISTENS_OR_IS_BUSY = (0, errno.EAGAIN, errno.EINPROGRESS, errno.ETIMEDOUT)


class MasterGone(TransportError):  # noqa: N818 - reads as the other ends of a connection do
    """There is no master at the address: the connection was refused."""


class Master:
    """The ROS master at an address. Not thread-safe."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        try:
            self._proxy = xmlrpc.client.ServerProxy(uri, transport=_ImpatientTransport())
        except OSError:
            raise TransportError(f"ROS_MASTER_URI is {uri!r}: it should be as http://localhost:11311") from None

    def ping(self) -> int:
        """Return its process ID.

        Raises:
            MasterGone: The connection was refused.
            TransportError: It does not reply in time; it may be busy.
        """
        return int(self._ask("getPid", "/handsteer")[2])

    def publishers(self, caller: str) -> dict[str, list[str]]:
        """Return the nodes that publish each topic, by full names.

        Args:
            caller: Full name of the requesting node.

        Raises:
            TransportError: It does not reply.
        """
        _, _, (publishers, _, _) = self._ask("getSystemState", caller)
        return {topic: list(nodes) for topic, nodes in publishers}

    def _ask(self, method: str, caller: str) -> Any:
        try:
            return getattr(self._proxy, method)(caller)
        except (OSError, OverflowError, http.client.HTTPException, xmlrpc.client.Error) as error:
            reason = getattr(error, "strerror", None) or error
            refused = isinstance(error, ConnectionRefusedError) and _refuses_connections(self._uri)
            kind = MasterGone if refused else TransportError
            raise kind(
                f"no ROS master answers at {self._uri} ({reason}): start roscore, or set ROS_MASTER_URI"
            ) from None


class Lifeline:
    """An idle connection to the master, which the system closes when the master ends for any reason.

    So its end is detected at once, without requests to a busy master. A machine that is disconnected or loses its power
    closes nothing.
    """

    def __init__(self, uri: str) -> None:
        self._address = _address(uri)
        self._socket: socket.socket | None = None

    def wait(self, timeout_s: float) -> bool:
        """Wait for ``timeout_s`` seconds while the connection is open; return whether it still is.

        Connects if necessary; a failure to connect is reported like a connection that breaks at once.
        """
        try:
            if self._socket is None:
                self._socket = socket.create_connection(self._address, _TIMEOUT_S)
            poll = select.poll()  # select() fails for sockets of a process with many open files
            poll.register(self._socket, select.POLLIN)
            # The master sends nothing unrequested, so a readable socket means the end.
            broken = bool(poll.poll(timeout_s * 1000))
        except OSError:
            broken = True
        if broken:
            self.close()
        return not broken

    def close(self) -> None:
        """Close the connection; may be called twice."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _address(uri: str) -> tuple[str, int]:
    parts = urllib.parse.urlsplit(uri)
    return parts.hostname or "", parts.port or 80


def _refuses_connections(uri: str) -> bool:
    """Return whether all addresses of the master refuse: localhost has two, and one may only be busy."""
    try:
        found = socket.getaddrinfo(*_address(uri), type=socket.SOCK_STREAM)
        return not any(_may_listen(family, address) for family, *_, address in found)
    except (OSError, ValueError):
        return False


def _may_listen(family: int, address: Any) -> bool:
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(_TIMEOUT_S)
        return probe.connect_ex(address) in _LISTENS_OR_IS_BUSY


class _ImpatientTransport(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> Any:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT_S
        return connection


_PERIOD_S = 4.0

log = logging.getLogger(__name__)


class SystemState:
    """Polls the master every four seconds, on a thread that starts at the first query."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = threading.Event()
        self._publishers: dict[str, list[str]] = {}

    def publishers_before(self, topic: str) -> set[str] | None:
        """Ask the master which nodes publish the topic of this full name; None if it does not answer."""
        try:
            publishers = Master(rosgraph.get_master_uri()).publishers(rospy.get_name())
        except TransportError:
            return None
        self._keep(publishers)  # a node that starts need not wait for the first poll
        return set(publishers.get(topic, []))

    def publishers_of(self, topic: str) -> list[str]:
        """Return the nodes that publish the topic of this full name; empty until the master has replied."""
        with self._lock:
            if self._thread is None and not self._closed.is_set():
                self._thread = threading.Thread(target=self._run, name="ros1_system_state", daemon=True)
                self._thread.start()
            return sorted(self._publishers.get(topic, []))

    def close(self) -> None:
        """Stop polling; may be called twice."""
        self._closed.set()
        with self._lock:
            self._publishers = {}

    def _run(self) -> None:
        master = Master(rosgraph.get_master_uri())
        while not self._closed.is_set():
            try:
                publishers = master.publishers(rospy.get_name())
            except TransportError as error:
                log.debug("%s", error)  # the session reports it, and ends the node
            else:
                self._keep(publishers)
            self._closed.wait(_PERIOD_S)

    def _keep(self, publishers: dict[str, list[str]]) -> None:
        with self._lock:
            self._publishers = {} if self._closed.is_set() else publishers
