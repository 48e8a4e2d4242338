"""Services over Zenoh as rmw_zenoh has them: a queryable that takes CDR and an attachment, and replies with both.

The attachment of a reply has the number and the sender of its request, by which the client finds it again.
"""

import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh

from handsteer.transports.ros2.encoding import decode, encode
from handsteer.transports.ros2.profiles import Profile
from handsteer.transports.ros2.service_types import Service
from handsteer.transports.zenoh.keys import attachment, read_attachment
from handsteer.transports.zenoh.member import Member

log = logging.getLogger(__name__)

_PROFILE = Profile(reliable=True, latched=False, depth=1000)
"""As ROS 2 has it for parameter services."""


class ServiceServer:
    """Answers the requests of a service, on a thread of its own.

    Args:
        member: This process in its Zenoh network.
        name: Full name of the service, as ``/my_camera/list_parameters``.
        service: Its type.
        answer: Turns a request into a reply; returns at once.
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
        """Answer no more; may be called twice."""
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
                # Whatever the network brings must not end the answering.
                log.warning("%s: a request of %d bytes cannot be answered: %s", self._name, len(raw), error)
