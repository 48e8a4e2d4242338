"""The ROS 1 master, asked with little patience."""

import xmlrpc.client
from typing import Any

from handsteer.errors import TransportError

_TIMEOUT_S = 2.0


class Master:
    """The ROS master at an address; knows whether it answers. Not for two threads at once."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        try:
            self._proxy = xmlrpc.client.ServerProxy(uri, transport=_ImpatientTransport())
        except OSError:
            raise TransportError(f"ROS_MASTER_URI is {uri!r}: it should be as http://localhost:11311") from None

    def ping(self) -> None:
        """Raise TransportError unless it answers."""
        self._ask("getPid", "/handsteer")

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
        except (OSError, xmlrpc.client.Error) as error:
            reason = getattr(error, "strerror", None) or error
            raise TransportError(
                f"no ROS master answers at {self._uri} ({reason}): start roscore, or set ROS_MASTER_URI"
            ) from None


class _ImpatientTransport(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> Any:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT_S
        return connection
