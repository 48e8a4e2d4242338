"""The ROS 1 master: asked with little patience, held by a connection that ends with it, and what it knows of topics."""

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
    """There is no master at the address: the machine itself refuses to connect."""


class Master:
    """The ROS master at an address; knows whether it answers. Not for two threads at once."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        try:
            self._proxy = xmlrpc.client.ServerProxy(uri, transport=_ImpatientTransport())
        except OSError:
            raise TransportError(f"ROS_MASTER_URI is {uri!r}: it should be as http://localhost:11311") from None

    def ping(self) -> int:
        """Return the number of its process.

        Raises:
            MasterGone: Nobody listens at its address.
            TransportError: It does not answer in time; it may be busy.
        """
        return int(self._ask("getPid", "/handsteer")[2])

    def publishers(self, caller: str) -> dict[str, list[str]]:
        """Return the nodes that publish each topic, by full names.

        Args:
            caller: Full name of the node that asks.

        Raises:
            TransportError: It does not answer.
        """
        _, _, (publishers, _, _) = self._ask("getSystemState", caller)
        return {topic: list(nodes) for topic, nodes in publishers}

    def _ask(self, method: str, caller: str) -> Any:
        try:
            return getattr(self._proxy, method)(caller)
        except (OSError, OverflowError, http.client.HTTPException, xmlrpc.client.Error) as error:
            reason = getattr(error, "strerror", None) or error
            refused = isinstance(error, ConnectionRefusedError) and _nobody_listens(self._uri)
            kind = MasterGone if refused else TransportError
            raise kind(
                f"no ROS master answers at {self._uri} ({reason}): start roscore, or set ROS_MASTER_URI"
            ) from None


class Lifeline:
    """An idle connection to the master: the system closes it when the master dies, however that dies.

    So its death is known at once, and nothing is asked of a master that is busy. A machine that is cut off or loses
    its power closes nothing.

    Args:
        uri: Address of the master.
    """

    def __init__(self, uri: str) -> None:
        self._address = _address(uri)
        self._socket: socket.socket | None = None

    def wait(self, timeout_s: float) -> bool:
        """Wait for ``timeout_s`` seconds while the connection holds; return whether it does.

        It is made where there is none; that it cannot be made is said as late as that it breaks at once.
        """
        try:
            if self._socket is None:
                self._socket = socket.create_connection(self._address, _TIMEOUT_S)
            poll = select.poll()  # select() cannot take the sockets of a process that has many files open
            poll.register(self._socket, select.POLLIN)
            # The master says nothing unasked, so what can be read is the end.
            broken = bool(poll.poll(timeout_s * 1000))
        except OSError:
            broken = True
        if broken:
            self.close()
        return not broken

    def close(self) -> None:
        """Let go; may be called twice."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _address(uri: str) -> tuple[str, int]:
    parts = urllib.parse.urlsplit(uri)
    return parts.hostname or "", parts.port or 80


def _nobody_listens(uri: str) -> bool:
    """Return whether each address of the master refuses at once: localhost has two, and one may only be busy."""
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
    """Asks the master every four seconds, on a thread of its own, from the first question on."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = threading.Event()
        self._publishers: dict[str, list[str]] = {}

    def publishers_of(self, topic: str) -> list[str]:
        """Return the nodes that publish the topic of this full name; none before the master has answered."""
        with self._lock:
            if self._thread is None and not self._closed.is_set():
                self._thread = threading.Thread(target=self._run, name="ros1_system_state", daemon=True)
                self._thread.start()
            return sorted(self._publishers.get(topic, []))

    def close(self) -> None:
        """Ask no more; may be called twice."""
        self._closed.set()
        with self._lock:
            self._publishers = {}

    def _run(self) -> None:
        master = Master(rosgraph.get_master_uri())
        while not self._closed.is_set():
            try:
                publishers = master.publishers(rospy.get_name())
            except TransportError as error:
                log.debug("%s", error)  # the session says it, and ends the node
            else:
                with self._lock:
                    self._publishers = {} if self._closed.is_set() else publishers
            self._closed.wait(_PERIOD_S)
