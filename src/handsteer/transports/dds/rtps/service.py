"""A service as clients on Fast DDS use it: who asks, and whom a reply is for, stands beside the sample.

A request says in its inline quality of service which reader its reply is for; the reply says the same, with the
request's sequence number. Sources: DDS-RPC 1.0, section 7.8.2; rmw_fastrtps_shared_cpp, ``rmw_request.cpp`` and
``rmw_response.cpp``. Fast DDS before 2.14 knows its own number of the parameter only.
"""

import logging
import struct
from collections.abc import Callable
from dataclasses import dataclass

from handsteer.transports.dds.rtps.discovery import EndpointData
from handsteer.transports.dds.rtps.reliable import Reader, Writer
from handsteer.transports.dds.rtps.wire import Data, Fragment, Parameters, Submessage

log = logging.getLogger(__name__)

_RELATED, _RELATED_OF_FAST_DDS = 0x83, 0x800F
_IDENTITY_BYTES, _GUID_BYTES = 24, 16
_NOBODY = bytes(_GUID_BYTES)
# Fast DDS repeats after three seconds what was lost of a reader's announcement.
_WAIT_FOR_READER_S = 10.0
_WAITING, _KEPT, _CLIENTS = 100, 128, 1000
_LARGEST = 60_000
"""What a datagram can carry, with room for what is said beside it."""


@dataclass(frozen=True)
class _Reply:
    reader: bytes
    payload: bytes
    inline: Parameters
    due_s: float


class Service:
    """The two ends of a service.

    Attributes:
        reader: What gets the requests.
        writer: What sends the replies.
        requests, replies: What others are told of the two.

    Args:
        name: Full name of the service, for the log.
        requests, replies: What others are told of its two ends.
        answer: Turns an encoded request into an encoded reply; returns at once, and may raise anything.
    """

    def __init__(
        self, name: str, requests: EndpointData, replies: EndpointData, answer: Callable[[bytes], bytes]
    ) -> None:
        self.requests = requests
        self.replies = replies
        self.reader = Reader(requests.guid[-4:], wants_all=False)
        self.writer = Writer(replies.guid[-4:], keeps=False, depth=_KEPT)
        self._name = name
        self._answer = answer
        self._waiting: list[_Reply] = []
        self._has_warned = False

    @property
    def is_full(self) -> bool:
        """Whether it has so many clients that no further one is taken."""
        return max(len(self.reader.writers), len(self.writer.readers)) >= _CLIENTS

    def serve(self, client: bytes, request: Data, now_s: float) -> None:
        """Make the reply to a request of the writer ``client``; it waits for :meth:`send`."""
        if request.payload is None:
            return  # a client that leaves
        reader, identity = _identity(client, request)
        try:
            payload = self._answer(request.payload)
        except Exception as error:
            # Whatever the network brings must not end the answering.
            log.warning("%s: a request of %d bytes cannot be answered: %s", self._name, len(request.payload), error)
            return
        if len(payload) > _LARGEST:
            log.warning("%s: a reply of %d bytes is too large for a client on Fast DDS", self._name, len(payload))
            return
        inline = Parameters({_RELATED: [identity], _RELATED_OF_FAST_DDS: [identity]})
        self._waiting.append(_Reply(reader, payload, inline, now_s + _WAIT_FOR_READER_S))
        del self._waiting[:-_WAITING]

    def send(self, now_s: float) -> dict[bytes, list[Submessage]]:
        """Return what the readers get whose replies are made; one whose reader is not known yet waits for it."""
        told: dict[bytes, list[Submessage]] = {}
        waiting, self._waiting = self._waiting, []
        for reply in waiting:
            if reply.reader in self.writer.readers:
                for reader, parts in self.writer.write(reply.payload, reply.inline, reply.reader).items():
                    told.setdefault(reader, []).extend(parts)
            elif now_s < reply.due_s:
                self._waiting.append(reply)
        return told

    def refuse(self, fragment: Fragment) -> None:
        """Say once that requests in parts are not put together."""
        if not self._has_warned:
            log.warning("%s: a request (number %d) is too large and gets no answer", self._name, fragment.number)
        self._has_warned = True


def _identity(client: bytes, request: Data) -> tuple[bytes, bytes]:
    """Return the reader that the reply is for, and what the reply says of its request."""
    said = request.inline.first(_RELATED) or request.inline.first(_RELATED_OF_FAST_DDS) or _NOBODY
    reader = said[:_GUID_BYTES] if len(said) == _IDENTITY_BYTES and said[:_GUID_BYTES] != _NOBODY else client
    return reader, reader + struct.pack("<II", request.number >> 32, request.number & 0xFFFFFFFF)
