"""Messages and services over DDS, as one node of a ROS 2 graph.

A service has one topic for requests and one for replies, as in rmw_cyclonedds_cpp. The body of both follows a header of
16 bytes that identifies the request: eight bytes for the client, and its request number, int64. The header is not in
ROS 2's type definitions. A client's reader and writer have the same ``clientid=`` in their user data, a server's the
same ``serviceid=``. A client of Fast DDS identifies itself in the headers of RTPS instead, which Cyclone DDS does not
expose: such requests are ignored here, and need nodes by rclpy.
"""

import logging
import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from cyclonedds.core import DDSException
from cyclonedds.internal import InvalidSample

from handsteer.clock import Clock
from handsteer.messages import Topic
from handsteer.plugins.dds.addresses import AddressWatch
from handsteer.plugins.dds.network import network
from handsteer.plugins.dds.participant import Participant
from handsteer.plugins.dds.topics import user_data
from handsteer.plugins.ros2.base_transport import Other, Profile, Take, WireTransport
from handsteer.plugins.ros2.names import NodeName

_REQUESTS_AT_ONCE = 100
_WAIT_FOR_READER_S = 1.0
_CDR_HEADER, _REQUEST_HEADER = 4, 16

log = logging.getLogger(__name__)


class DdsTransport(WireTransport):
    """A :class:`~handsteer.transports.base.Transport` over DDS, which delivers on the DDS thread of this process."""

    errors = (DDSException,)

    def __init__(self, name: NodeName, clock: Clock) -> None:
        super().__init__(name, clock)
        self._participant = Participant(network(os.environ), name)
        self.is_one_machine = self._participant.is_local
        self.crosses_network = not self.is_one_machine
        self._addresses = AddressWatch() if self.crosses_network else None

    def check(self) -> None:
        """Hear the Stops that others have kept, and look at this machine's addresses; called regularly.

        Raises:
            TransportError: They have been replaced.
        """
        super().check()
        if self._addresses is not None:
            self._addresses.check()

    def close(self) -> None:
        """Leave the domain; may be called twice."""
        super().close()
        self._participant.close()

    def _open_writer(self, name: str, topic: Topic[Any]) -> "_Writer":
        return _Writer(self._participant, name, topic)

    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: Take) -> Callable[[], None]:
        reader = self._participant.reader(name, topic, profile)

        def serve() -> None:
            for sample in reader.take(topic.depth):
                # A writer that leaves sends a sample without a message.
                if not isinstance(sample, InvalidSample):
                    info = sample.sample_info
                    # RTPS allows a sender to omit its time.
                    sent_s = info.source_timestamp / 1e9 if info.source_timestamp > 0 else None
                    take(sample.raw, info.publication_handle.to_bytes(8, "big"), sent_s)

        self._participant.dispatcher.add(reader, serve)
        return partial(self._participant.release, reader)

    def _open_service(self, name: str, kind: str, respond: Callable[[bytes], bytes]) -> Callable[[], None]:
        return _Service(self._participant, name, kind, respond).close

    def _others(self, name: str) -> list[Other]:
        return self._participant.others_of(name)


class _Writer:
    def __init__(self, participant: Participant, name: str, topic: Topic[Any]) -> None:
        self._participant = participant
        self._name = name
        self._writer: Any = participant.writer(name, topic)
        self._is_slow = False

    @property
    def has_readers(self) -> bool:
        return bool(self._writer.get_publication_matched_status().current_count > 0)

    def write(self, raw: bytes) -> None:
        try:
            self._writer.write(self._writer.data_type(raw))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            if not self._is_slow:
                log.warning("%s: a subscriber is too slow, and messages are dropped", self._name)
            self._is_slow = True
        else:
            self._is_slow = False

    def flush(self, timeout_s: float) -> bool:
        try:
            self._writer.wait_for_acks(round(timeout_s * 1e9))
        except (DDSException, AttributeError):
            # At a timeout, cyclonedds 11.0.1 raises AttributeError for a wrong name of its own.
            return False
        return True

    def close(self) -> None:
        self._participant.release(self._writer)


class _Reply(NamedTuple):
    client: str
    raw: bytes
    due_s: float


class _Service:
    """Replies to the requests of a service, on the DDS thread."""

    def __init__(self, participant: Participant, name: str, kind: str, respond: Callable[[bytes], bytes]) -> None:
        self._participant = participant
        self._name = name
        self._respond = respond
        # A request may arrive before the client's reader is discovered, which would miss an immediate reply.
        self._waiting: list[_Reply] = []
        self._reader: Any
        self._writer: Any
        self._reader, self._writer = participant.service(name, kind)
        participant.dispatcher.add(self._reader, self._serve)
        participant.dispatcher.tick(self._send_waiting)

    def close(self) -> None:
        reader, writer, self._reader, self._writer = self._reader, self._writer, None, None
        self._participant.release(reader)
        self._participant.release(writer)

    def _serve(self) -> None:
        reader = self._reader
        for sample in reader.take(_REQUESTS_AT_ONCE) if reader is not None else []:
            if not isinstance(sample, InvalidSample):
                self._take(reader, sample)
        self._send_waiting()

    def _take(self, reader: Any, sample: Any) -> None:
        asker = reader.get_matched_publication_data(sample.sample_info.publication_handle)
        client = None if asker is None else user_data(asker.qos).get("clientid")  # None if it has left already
        if client is None:
            return
        begin, end = _CDR_HEADER, _CDR_HEADER + _REQUEST_HEADER
        try:
            # The body begins at a multiple of eight bytes, so its alignment is the same without the header.
            reply = self._respond(sample.raw[:begin] + sample.raw[end:])
        except Exception as error:
            # Invalid requests must not end the service.
            log.warning("%s: a request of %d bytes cannot be answered: %s", self._name, len(sample.raw), error)
            return
        header = _little_endian(sample.raw[begin:end], is_little=bool(sample.raw[1] & 1))
        raw = reply[:begin] + header + reply[begin:]
        self._waiting.append(_Reply(client, raw, time.monotonic() + _WAIT_FOR_READER_S))

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


def _little_endian(header: bytes, *, is_little: bool) -> bytes:
    """Return the two numbers of a request's header in the byte order of our replies."""
    return header if is_little else header[7::-1] + header[:7:-1]
