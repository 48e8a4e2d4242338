"""A participant of RTPS that has services and nothing else, as what follows from what comes, without sockets.

It speaks only to those who are on Fast DDS: all others are told that it is there, and that it has nothing, so that
nobody sees a service twice who is answered by Cyclone DDS.
"""

from collections.abc import Callable, Iterable

from handsteer.transports.dds.rtps import discovery as told
from handsteer.transports.dds.rtps.discovery import Address, EndpointData, ParticipantData
from handsteer.transports.dds.rtps.presence import LEASE_S, Presence
from handsteer.transports.dds.rtps.reliable import Reader, Writer
from handsteer.transports.dds.rtps.service import Service
from handsteer.transports.dds.rtps.wire import (
    ANYBODY,
    ENTITY_UNKNOWN,
    PREFIX_BYTES,
    VENDOR_FAST_DDS,
    AckNack,
    Data,
    Fragment,
    Gap,
    Heartbeat,
    Parameters,
    Submessage,
    decode,
    encode,
)

Outgoing = list[tuple[bytes, Address]]
"""Datagrams, and where to send them."""

_REPEAT_S, _REPEAT_AT_LAST_S = 0.1, 2.0
_PACKED = 1400
_ENDS = 1000
_BUILTIN_READERS = {
    told.PUBLICATIONS_WRITER: [told.PUBLICATIONS_READER],
    told.SUBSCRIPTIONS_WRITER: [told.SUBSCRIPTIONS_READER],
}
_READER_KIND, _WRITER_KIND = b"\x04", b"\x03"  # of a topic without a key


class RtpsParticipant:
    """Answers clients on Fast DDS.

    Args:
        prefix: Its part of identifiers, 12 bytes.
        domain: Number of the domain.
        addresses: Where others reach it.
        seeking: Where to look for those whose address is not known.
        reach: Turns where another says it listens into where to send.
    """

    def __init__(
        self,
        prefix: bytes,
        domain: int,
        addresses: tuple[Address, ...],
        seeking: Iterable[Address],
        reach: Callable[[tuple[Address, ...]], tuple[Address, ...]],
    ) -> None:
        self._prefix = prefix
        self._reach = reach
        self._addresses = addresses
        data = ParticipantData(prefix, addresses, addresses, LEASE_S, b"enclave=/;")
        self._presence = Presence(prefix, told.participant_payload(data, domain), seeking, self._say)
        self._ends: dict[bytes, tuple[Address, ...]] = {}
        self._services: list[Service] = []
        self._publications = Writer(told.PUBLICATIONS_WRITER, keeps=True, depth=_ENDS)
        self._subscriptions = Writer(told.SUBSCRIPTIONS_WRITER, keeps=True, depth=_ENDS)
        self._their_publications = Reader(told.PUBLICATIONS_READER, wants_all=True)
        self._their_subscriptions = Reader(told.SUBSCRIPTIONS_READER, wants_all=True)
        self._out: Outgoing = []
        self._repeat_at_s, self._repeat_pause_s = 0.0, _REPEAT_S

    @property
    def clients(self) -> int:
        """How many participants on Fast DDS are known."""
        return len(self._presence.served)

    def add(
        self,
        name: str,
        types: tuple[str, str],
        user_data: tuple[bytes, bytes],
        answer: Callable[[bytes], bytes],
    ) -> tuple[bytes, bytes]:
        """Add a service; return the identifiers of the end that gets requests and of the one that sends replies.

        Args:
            name: Its full name.
            types: Names in DDS of its request and its reply.
            user_data: What others are told beside, of each.
            answer: Turns an encoded request into an encoded reply.
        """
        number = (len(self._services) + 1).to_bytes(3, "big")
        requests = EndpointData(
            self._prefix + number + _READER_KIND, f"rq{name}Request", types[0], self._addresses, user_data[0]
        )
        replies = EndpointData(
            self._prefix + number + _WRITER_KIND, f"rr{name}Reply", types[1], self._addresses, user_data[1]
        )
        self._services.append(Service(name, requests, replies, answer))
        for writer, data in ((self._subscriptions, requests), (self._publications, replies)):
            inline = Parameters({told.KEY_HASH: [data.guid]})
            self._tell_all(writer.write(told.endpoint_payload(data), inline))
        return requests.guid, replies.guid

    def seek(self, prefixes: Iterable[bytes]) -> None:
        """Look for the participants of these prefixes, which are there, until they answer."""
        self._presence.seek(prefixes)

    def receive(self, datagram: bytes, now_s: float) -> Outgoing:
        """Take a datagram; return what to send."""
        message = decode(datagram)
        if message is None or message.prefix == self._prefix:
            return []
        self._presence.heard(message.prefix, now_s)
        for destination, part in message.parts:
            if destination not in {self._prefix, ANYBODY}:
                continue
            if isinstance(part, Data) and part.writer == told.SPDP_WRITER:
                self._meet(message.prefix, part, message.vendor == VENDOR_FAST_DDS, now_s)
            elif message.prefix in self._presence.others:
                self._hear(message.prefix, part, now_s)
        self._answer(now_s)
        return self._taken()

    def tick(self, now_s: float) -> Outgoing:
        """Return what is to be sent by now: presence, and what others have not confirmed."""
        for prefix in self._presence.overdue(now_s):
            self._forget(prefix)
        self._answer(now_s)
        self._presence.tick(now_s)
        if now_s >= self._repeat_at_s:
            self._repeat(now_s)
        return self._taken()

    def pause_s(self, now_s: float) -> float:
        """Return after how many seconds :meth:`tick` has something to do, if nothing comes."""
        return max(0.0, min([self._repeat_at_s, *self._presence.next_s()]) - now_s)

    def leave(self) -> Outgoing:
        """Return what tells all others that it is gone."""
        self._presence.leave()
        return self._taken()

    @property
    def _writers(self) -> list[Writer]:
        return [self._publications, self._subscriptions, *(service.writer for service in self._services)]

    @property
    def _readers(self) -> list[Reader]:
        return [self._their_publications, self._their_subscriptions, *(service.reader for service in self._services)]

    def _repeat(self, now_s: float) -> None:
        ends: list[Writer | Reader] = [*self._writers, *self._readers]
        pending = [(guid, parts) for end in ends for guid, parts in end.pending().items()]
        for guid, parts in pending:
            self._say(guid[:PREFIX_BYTES], self._addresses_of(guid), parts)
        pause_s = self._repeat_pause_s if pending else _REPEAT_AT_LAST_S
        self._repeat_at_s = now_s + pause_s
        self._repeat_pause_s = min(2 * pause_s, _REPEAT_AT_LAST_S)

    def _repeat_soon(self, now_s: float) -> None:
        self._repeat_pause_s = _REPEAT_S
        self._repeat_at_s = min(self._repeat_at_s, now_s + _REPEAT_S)

    def _meet(self, prefix: bytes, data: Data, is_served: bool, now_s: float) -> None:
        if told.is_gone(data):
            self._forget(prefix)
            return
        said = self._presence.meet(prefix, data, now_s, is_served=is_served)
        if said is not None:
            self._introduce(said, now_s)

    def _introduce(self, said: ParticipantData, now_s: float) -> None:
        ours = ((self._publications, told.PUBLICATIONS_READER), (self._subscriptions, told.SUBSCRIPTIONS_READER))
        theirs = (
            (self._their_publications, told.PUBLICATIONS_WRITER),
            (self._their_subscriptions, told.SUBSCRIPTIONS_WRITER),
        )
        parts: list[Submessage] = [self._presence.told]
        for writer, entity in ours:
            parts += writer.match(said.prefix + entity)
        for reader, entity in theirs:
            parts += reader.match(said.prefix + entity)
        self._say(said.prefix, said.metatraffic, parts)
        self._repeat_soon(now_s)

    def _forget(self, prefix: bytes) -> None:
        if self._presence.others.pop(prefix, None) is None:
            return
        for writer in self._writers:
            for guid in writer.readers:
                if guid.startswith(prefix):
                    writer.unmatch(guid)
        for reader in self._readers:
            for guid in reader.writers:
                if guid.startswith(prefix):
                    reader.unmatch(guid)
        self._ends = {guid: addresses for guid, addresses in self._ends.items() if not guid.startswith(prefix)}

    def _hear(self, prefix: bytes, part: Submessage, now_s: float) -> None:
        if not self._presence.others[prefix].is_served:
            self._excuse(prefix, part)
        elif isinstance(part, AckNack):
            for writer in self._writers:
                if writer.entity == part.writer:
                    self._tell(prefix + part.reader, writer.acknowledge(prefix + part.reader, part))
        else:
            for reader in self._readers:
                if part.reader in {reader.entity, ENTITY_UNKNOWN}:
                    self._take(reader, prefix + part.writer, part, now_s)

    def _excuse(self, prefix: bytes, part: Submessage) -> None:
        """Tell somebody who is not served that there is nothing, and that nothing is wanted."""
        parts: list[Submessage] = []
        if isinstance(part, AckNack) and not part.final:
            parts = [Heartbeat(part.reader, part.writer, 1, 0, 1, final=True)]
        elif isinstance(part, Heartbeat) and part.last >= part.first - 1 >= 0 and not part.final:
            readers = [part.reader] if part.reader != ENTITY_UNKNOWN else _BUILTIN_READERS.get(part.writer, [])
            parts = [AckNack(reader, part.writer, part.last + 1, (), part.count, final=True) for reader in readers]
        if parts:
            self._say(prefix, self._presence.others[prefix].data.metatraffic, parts)

    def _take(self, reader: Reader, guid: bytes, part: Submessage, now_s: float) -> None:
        due: list[Data] = []
        match part:
            case Data():
                due, parts = reader.take(guid, part)
                self._tell(guid, parts)
            case Gap():
                due = reader.skip(guid, part)
            case Heartbeat():
                due, parts = reader.hear(guid, part)
                self._tell(guid, parts)
            case Fragment():
                for service in self._services:
                    if service.reader is reader and guid in reader.writers:
                        service.refuse(part)
        for data in due:
            self._serve(reader, guid, data, now_s)

    def _serve(self, reader: Reader, guid: bytes, data: Data, now_s: float) -> None:
        if reader is self._their_publications:
            self._learn(guid[:PREFIX_BYTES], data, now_s, publishes=True)
        elif reader is self._their_subscriptions:
            self._learn(guid[:PREFIX_BYTES], data, now_s, publishes=False)
        else:
            for service in self._services:
                if service.reader is reader:
                    service.serve(guid, data, now_s)

    def _learn(self, prefix: bytes, data: Data, now_s: float, *, publishes: bool) -> None:
        guid = told.key(data)
        if guid is None or guid[:PREFIX_BYTES] != prefix:
            return
        said = None if told.is_gone(data) else told.read_endpoint(data)
        for service in self._services:
            ours, end = (service.requests, service.reader) if publishes else (service.replies, service.writer)
            if said is None:
                end.unmatch(guid)
                self._ends.pop(guid, None)
            elif (said.topic, said.type) == (ours.topic, ours.type) and not service.is_full:
                self._ends[guid] = said.addresses or self._presence.others[prefix].data.default
                self._tell(guid, end.match(guid))
                self._repeat_soon(now_s)

    def _answer(self, now_s: float) -> None:
        for service in self._services:
            replies = service.send(now_s)
            if replies:
                self._tell_all(replies)
                self._repeat_soon(now_s)

    def _tell_all(self, parts: dict[bytes, list[Submessage]]) -> None:
        for guid, said in parts.items():
            self._tell(guid, said)

    def _tell(self, guid: bytes, parts: list[Submessage]) -> None:
        self._say(guid[:PREFIX_BYTES], self._addresses_of(guid), parts)

    def _addresses_of(self, guid: bytes) -> tuple[Address, ...]:
        other = self._presence.others.get(guid[:PREFIX_BYTES])
        return self._ends.get(guid) or (other.data.metatraffic if other else ())

    def _say(self, prefix: bytes, addresses: tuple[Address, ...], parts: list[Submessage]) -> None:
        reached = addresses if prefix == ANYBODY else self._reach(addresses)
        for datagram in _packed(self._prefix, prefix, parts):
            self._out += [(datagram, address) for address in reached]

    def _taken(self) -> Outgoing:
        out, self._out = self._out, []
        return out


def _packed(prefix: bytes, destination: bytes, parts: list[Submessage]) -> list[bytes]:
    """Return datagrams that are not too large, but for single parts that are."""
    datagrams: list[bytes] = []
    batch: list[Submessage] = []
    size = 0
    for part in parts:
        length = 64 + (len(part.payload or b"") if isinstance(part, Data) else 0)
        if batch and size + length > _PACKED:
            datagrams.append(encode(prefix, destination, batch))
            batch, size = [], 0
        batch.append(part)
        size += length
    return [*datagrams, encode(prefix, destination, batch)] if batch else datagrams
