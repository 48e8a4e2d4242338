"""Services over DDS as in rmw_cyclonedds_cpp: one topic for requests, one for replies.

The body of both follows a header of 16 bytes that identifies the request: eight bytes for the client, and its request
number, int64. The header is not in ROS 2's type definitions. A client's reader and writer have the same ``clientid=``
in their user data, a server's the same ``serviceid=``. A client of Fast DDS identifies itself in the headers of RTPS
instead, which Cyclone DDS does not expose: such requests are ignored here, and need nodes by rclpy.
"""

import logging
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.internal import InvalidSample

from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.qos import user_data
from handsteer.transports.ros2.encoding import decode, encode
from handsteer.transports.ros2.service_types import Service

log = logging.getLogger(__name__)

_AT_ONCE = 100
_WAIT_FOR_READER_S = 1.0
_CDR_HEADER, _REQUEST_HEADER = 4, 16


@dataclass(frozen=True)
class _Reply:
    client: str
    raw: bytes
    due_s: float


class ServiceServer:
    """Replies to the requests of a service, on the DDS thread.

    Args:
        name: Full name of the service, such as ``/my_camera/list_parameters``.
        answer: Converts a request to a reply; returns at once.
    """

    def __init__(self, participant: Participant, name: str, service: Service, answer: Callable[[Any], Any]) -> None:
        self._participant = participant
        self._name = name
        self._service = service
        self._answer = answer
        # A request may arrive before the client's reader is discovered, which would miss an immediate reply.
        self._waiting: list[_Reply] = []
        self._reader: Any
        self._writer: Any
        self._reader, self._writer = participant.service(name, service)
        participant.serve(self._reader, self._serve)
        participant.tick(self._send_waiting)

    def close(self) -> None:
        """Stop replying; may be called twice."""
        reader, writer, self._reader, self._writer = self._reader, self._writer, None, None
        if reader is not None:
            self._participant.release(reader)
            self._participant.release(writer)

    def _serve(self) -> None:
        reader = self._reader
        for sample in reader.take(_AT_ONCE) if reader is not None else []:
            if not isinstance(sample, InvalidSample):
                self._take(reader, sample)
        self._send_waiting()

    def _take(self, reader: Any, sample: Any) -> None:
        asker = reader.get_matched_publication_data(sample.sample_info.publication_handle)
        if asker is None:
            return  # it has left already
        client = user_data(asker.qos).get("clientid")
        if client is None:
            return
        try:
            header, request = _open(sample.raw, self._service.request)
            reply = _close(header, self._answer(request))
        except Exception as error:
            # Invalid requests must not end the service.
            log.warning("%s: a request of %d bytes cannot be answered: %s", self._name, len(sample.raw), error)
            return
        self._waiting.append(_Reply(client, reply, time.monotonic() + _WAIT_FOR_READER_S))

    def _send_waiting(self) -> None:
        writer = self._writer
        if not self._waiting or writer is None:
            return
        found = [writer.get_matched_subscription_data(handle) for handle in writer.get_matched_subscriptions()]
        present = {user_data(one.qos).get("clientid") for one in found if one is not None}
        waiting, self._waiting = self._waiting, []
        for reply in waiting:
            if reply.client in present:
                self._send(writer, reply.raw)
            elif time.monotonic() < reply.due_s:
                self._waiting.append(reply)

    def _send(self, writer: Any, raw: bytes) -> None:
        try:
            writer.write(writer.data_type(raw))
        except DDSException as error:
            log.warning("%s: a reply could not be sent: %s", self._name, error)


def _open(raw: bytes, kind: str) -> tuple[tuple[int, int], Any]:
    """Return the header, as two numbers, and the request."""
    little = raw[1] & 1
    start = _CDR_HEADER + _REQUEST_HEADER
    client, number = struct.unpack("<Qq" if little else ">Qq", raw[_CDR_HEADER:start])
    # The body begins at a multiple of eight bytes, so its alignment is the same without the header.
    return (client, number), decode(raw[:_CDR_HEADER] + raw[start:], kind)


def _close(header: tuple[int, int], reply: Any) -> bytes:
    body = encode(reply)
    return body[:_CDR_HEADER] + struct.pack("<Qq", *header) + body[_CDR_HEADER:]
