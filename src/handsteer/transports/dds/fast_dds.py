"""Services for clients on Fast DDS, beside those of Cyclone DDS: see :mod:`handsteer.transports.dds.rtps`.

They are started for the same node, and belong to it in ROS 2's graph. Nothing is sent until Cyclone DDS has found a
participant on Fast DDS in the domain.
"""

import logging
from collections.abc import Callable
from typing import Any

from cyclonedds.internal import InvalidSample

from handsteer.transports.dds.network import PLACES, Network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.rtps.responder import Responder, Surroundings
from handsteer.transports.dds.rtps.wire import PREFIX_BYTES, VENDOR_FAST_DDS
from handsteer.transports.ros2.encoding import dds_type_name, decode, encode, type_hash
from handsteer.transports.ros2.service_types import Service

log = logging.getLogger(__name__)

_AT_ONCE = 64


class FastDdsServices:
    """Answers clients on Fast DDS; where it cannot, it says so in the log, and the node goes on without.

    Args:
        participant: This process in its DDS domain.
        network: The domain, and where to look for others.
    """

    def __init__(self, participant: Participant, network: Network) -> None:
        self._participant = participant
        self._found: set[bytes] = set()
        self._responder = _started(network)
        self._reader: Any = None
        if self._responder is not None:
            self._reader = participant.participants()
            participant.serve(self._reader, self._look)

    def add(self, name: str, service: Service, answer: Callable[[Any], Any]) -> None:
        """Answer the requests of the service of this full name by what ``answer`` makes of them."""
        if self._responder is None:
            return
        guids = self._responder.add(
            name,
            (dds_type_name(service.request), dds_type_name(service.reply)),
            (_user_data(service.request), _user_data(service.reply)),
            lambda raw: encode(answer(decode(raw, service.request))),
        )
        for guid, writes in zip(guids, (False, True), strict=True):
            self._participant.tell_of(guid, writes=writes)

    def close(self) -> None:
        """Answer no more; may be called twice."""
        responder, self._responder = self._responder, None
        if responder is not None:
            self._participant.leave_unserved(self._reader)
            self._reader = None
            responder.close()

    def _look(self) -> None:
        reader, responder = self._reader, self._responder
        if reader is None or responder is None:
            return
        for seen in reader.take(_AT_ONCE):
            if isinstance(seen, InvalidSample) or not seen.key.bytes.startswith(VENDOR_FAST_DDS):
                continue
            prefix = seen.key.bytes[:PREFIX_BYTES]
            if seen.sample_info.valid_data:
                self._found.add(prefix)
            else:
                self._found.discard(prefix)
        responder.seek(self._found)


def _started(network: Network) -> Responder | None:
    if network.asked == "OFF":
        return None
    try:
        return Responder(
            Surroundings(
                network.domain,
                # What CYCLONEDDS_URI says is not for us to read: there, too, no further than ROS 2's variables say.
                is_local=network.asked == "LOCALHOST" and not network.peers,
                uses_multicast=network.asked in {"SUBNET", "SYSTEM_DEFAULT"},
                peers=network.peers,
                places=PLACES,
            )
        )
    except OSError as error:
        log.warning("ros2 param on Fast DDS gets no answers, there is no UDP socket for it: %s", error.strerror)
        return None


def _user_data(kind: str) -> bytes:
    return f"typehash={type_hash(kind)};".encode()
