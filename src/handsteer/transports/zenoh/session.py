"""This process as a node of a ROS 2 graph over Zenoh, and its services.

As in rmw_zenoh, a service is a queryable that receives CDR and an attachment, and replies with both. The attachment of
a reply has the number and the sender of its request, by which the client identifies it.
"""

import logging
import os
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh

from handsteer.clock import Clock
from handsteer.transports.ros2.base_session import Ros2Session
from handsteer.transports.ros2.encoding import decode, encode
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.profiles import Profile
from handsteer.transports.ros2.service_types import Service
from handsteer.transports.zenoh.keys import attachment, read_attachment
from handsteer.transports.zenoh.member import Member
from handsteer.transports.zenoh.network import network
from handsteer.transports.zenoh.transport import ZenohTransport

log = logging.getLogger(__name__)

_PROFILE = Profile(reliable=True, latched=False, depth=1000)
"""The profile of ROS 2's parameter services."""


class ServiceServer:
    """Replies to the requests of a service, on a thread of its own.

    Args:
        name: Full name of the service, such as ``/my_camera/list_parameters``.
        answer: Converts a request to a reply; returns at once.
    """

    def __init__(self, member: Member, name: str, service: Service, answer: Callable[[Any], Any]) -> None:
        self._name = name
        self._service = service
        self._answer = answer
        self._lock = threading.Lock()
        self._is_closed = False
        self._key = member.key(name, service.name)
        self._queryable = member.session.declare_queryable(self._key, self._serve, complete=True)
        self._token, _ = member.introduce("service", name, service.name, _PROFILE)

    def close(self) -> None:
        """Stop replying; may be called twice."""
        with self._lock:
            if self._is_closed:
                return
            self._is_closed = True
        self._token.undeclare()
        self._queryable.undeclare()

    def _serve(self, query: zenoh.Query) -> None:
        with query:
            raw = b"" if query.payload is None else query.payload.to_bytes()
            try:
                number, _, client = read_attachment(b"" if query.attachment is None else query.attachment.to_bytes())
                reply = encode(self._answer(decode(raw, self._service.request)))
                query.reply(self._key, reply, attachment=attachment(number, time.time_ns(), client))
            except Exception as error:
                # Invalid requests must not end the service.
                log.warning("%s: a request of %d bytes cannot be answered: %s", self._name, len(raw), error)


class ZenohSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over Zenoh."""

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether this session has been closed."""
        self._member.watch_router()
        return super().wait(timeout_s)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        super().close()
        self._member.close()

    def _connect(self, name: NodeName, clock: Clock) -> ZenohTransport:
        self._member = Member(network(os.environ), name)
        return ZenohTransport(self._member, clock)

    def _answer(self, name: str, service: Service, answer: Callable[[Any], Any]) -> ServiceServer:
        return ServiceServer(self._member, name, service, answer)
