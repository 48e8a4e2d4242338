"""A service and its clients, as they exchange datagrams, without sockets: on good networks and on bad ones."""

import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handsteer.transports.dds.rtps import discovery
from handsteer.transports.dds.rtps.discovery import Address, EndpointData, ParticipantData
from handsteer.transports.dds.rtps.participant import Outgoing, RtpsParticipant
from handsteer.transports.dds.rtps.reliable import Reader, Writer
from handsteer.transports.dds.rtps.wire import (
    ANYBODY,
    VENDOR_FAST_DDS,
    AckNack,
    Data,
    Fragment,
    Heartbeat,
    Message,
    Parameters,
    Submessage,
    decode,
    encode,
)
from tests.transports.dds.rtps import recorded

SERVER, SERVER_AT, PLACE = b"\0\0" + b"s" * 10, ("10.0.0.1", 41000), ("10.0.0.2", 7410)
TYPES = ("pkg::srv::dds_::Echo_Request_", "pkg::srv::dds_::Echo_Response_")
HEADER = b"\0\1\0\0"
STEP_S = 0.05
OF_CYCLONE_DDS = b"\x01\x10"
(RECORDED_FOR,) = {to for to, _ in (decode(recorded.HEARTBEAT) or Message(b"", b"")).parts}
RELATED, RELATED_OF_FAST_DDS = 0x83, 0x800F


def server(answers: list[bytes] | None = None) -> RtpsParticipant:
    """Return a participant with one service, which gives back what it gets."""

    def answer(raw: bytes) -> bytes:
        if answers is not None:
            answers.append(raw.rstrip(b"\0"))
        if b"fail" in raw:
            raise ValueError("it has to fail")
        return raw

    participant = RtpsParticipant(SERVER, 7, (SERVER_AT,), [PLACE], lambda addresses: addresses)
    participant.add("/node/echo", TYPES, (b"", b""), answer)
    return participant


class Client:
    """A participant with a client, as Fast DDS has it; it says who made it by ``vendor``."""

    def __init__(self, number: int = 1, vendor: bytes = VENDOR_FAST_DDS, parameter: int | None = RELATED) -> None:
        self.prefix = vendor + bytes([number]) * 10
        self.address: Address = ("10.0.0.2", 7410 + 2 * number)
        self.vendor = vendor
        self.parameter = parameter
        self.requests = EndpointData(self.prefix + b"\0\0\1\3", "rq/node/echoRequest", TYPES[0])
        self.replies = EndpointData(self.prefix + b"\0\0\2\4", "rr/node/echoReply", TYPES[1])
        self.writers = {
            discovery.PUBLICATIONS_READER: Writer(discovery.PUBLICATIONS_WRITER, keeps=True, depth=10),
            discovery.SUBSCRIPTIONS_READER: Writer(discovery.SUBSCRIPTIONS_WRITER, keeps=True, depth=10),
        }
        self.readers = {
            discovery.PUBLICATIONS_WRITER: Reader(discovery.PUBLICATIONS_READER, wants_all=True),
            discovery.SUBSCRIPTIONS_WRITER: Reader(discovery.SUBSCRIPTIONS_READER, wants_all=True),
        }
        self.writers[discovery.PUBLICATIONS_READER].write(discovery.endpoint_payload(self.requests))
        self.writers[discovery.SUBSCRIPTIONS_READER].write(discovery.endpoint_payload(self.replies))
        self.request_writer = Writer(self.requests.guid[-4:], keeps=False, depth=100)
        self.reply_reader = Reader(self.replies.guid[-4:], wants_all=False)
        self.found: dict[str, bytes] = {}
        self.got: list[tuple[bytes, bytes | None]] = []
        self.is_gone = False
        self.out: list[bytes] = []

    def say(self, *parts: Submessage, to: bytes = SERVER) -> None:
        if parts:
            raw = encode(self.prefix, to, parts)
            self.out.append(raw[:6] + self.vendor + raw[8:])

    def greet(self) -> None:
        told = ParticipantData(self.prefix, (self.address,), (self.address,), 20.0)
        presence = discovery.participant_payload(told, 7)
        self.say(Data(discovery.SPDP_READER, discovery.SPDP_WRITER, 1, presence), to=ANYBODY)

    @property
    def is_ready(self) -> bool:
        """Whether it has found both ends of the service, as ``service_is_ready`` of ROS 2 asks."""
        return len(self.found) == 2

    def call(self, payload: bytes) -> None:
        unknown = struct.pack("<iI", -1, 0)
        inline = Parameters({self.parameter: [self.replies.guid + unknown]} if self.parameter else {})
        for parts in self.request_writer.write(HEADER + payload, inline).values():
            self.say(*parts)

    def receive(self, datagram: bytes) -> None:
        message = decode(datagram)
        assert message is not None
        for destination, part in message.parts:
            if destination in {self.prefix, ANYBODY}:
                self._take(message.prefix, part)

    def tick(self) -> None:
        for end in (*self.writers.values(), *self.readers.values(), self.request_writer, self.reply_reader):
            assert isinstance(end, Writer | Reader)
            for parts in end.pending().values():
                self.say(*parts)

    def _take(self, prefix: bytes, part: Submessage) -> None:
        if isinstance(part, Data) and part.writer == discovery.SPDP_WRITER:
            self.is_gone = discovery.is_gone(part)
            self._meet(prefix)
        elif isinstance(part, AckNack):
            reader = prefix + part.reader
            for writer in (*self.writers.values(), self.request_writer):
                if writer.entity == part.writer:
                    self.say(*writer.acknowledge(reader, part))
        else:
            self._hear(self.readers.get(part.writer, self.reply_reader), prefix + part.writer, part)

    def _meet(self, prefix: bytes) -> None:
        self.greet()
        for entity, writer in self.writers.items():
            self.say(*writer.match(prefix + entity))
        for entity, reader in self.readers.items():
            self.say(*reader.match(prefix + entity))

    def _hear(self, reader: Reader, guid: bytes, part: Submessage) -> None:
        due: list[Data] = []
        answer: list[Submessage] = []
        if isinstance(part, Data):
            due, answer = reader.take(guid, part)
        elif isinstance(part, Heartbeat):
            due, answer = reader.hear(guid, part)
        elif not isinstance(part, AckNack | Fragment):
            due = reader.skip(guid, part)
        self.say(*answer)
        for data in due:
            self._note(reader, data)

    def _note(self, reader: Reader, data: Data) -> None:
        if reader is self.reply_reader:
            related = data.inline.first(RELATED)
            assert related is not None
            assert data.inline.first(RELATED_OF_FAST_DDS) == related
            assert data.payload is not None
            self.got.append((related, data.payload[len(HEADER) :].rstrip(b"\0")))  # it is padded to four bytes
            return
        said = discovery.read_endpoint(data)
        assert said is not None
        self.found[said.topic] = said.guid
        if said.topic == self.requests.topic:
            self.say(*self.request_writer.match(said.guid))
        elif said.topic == self.replies.topic:
            self.say(*self.reply_reader.match(said.guid))


class World:
    """A server, clients, the time, and what is under way between them."""

    def __init__(self, participant: RtpsParticipant, *clients: Client, loses: float = 0.0, seed: int = 0) -> None:
        self.server = participant
        self.clients = clients
        self.now_s = 100.0
        self.loses = loses
        self.random = random.Random(seed)
        self.sent: list[tuple[bytes, Address]] = []

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self.now_s += STEP_S
            self.route(self.server.tick(self.now_s))
            for client in self.clients:
                client.tick()
            self.exchange()

    def exchange(self) -> None:
        for _ in range(100):
            said = [datagram for client in self.clients for datagram in client.out]
            for client in self.clients:
                client.out = []
            if not said:
                return
            for datagram in said:
                if self.random.random() >= self.loses:
                    self.route(self.server.receive(datagram, self.now_s))
        raise AssertionError("they talk without end")

    def route(self, out: Outgoing) -> None:
        for datagram, address in out:
            self.sent.append((datagram, address))
            for client in self.clients:
                if address in {client.address, PLACE} and self.random.random() >= self.loses:
                    client.receive(datagram)


def met(*clients: Client) -> World:
    """Return a world in which all know one another."""
    world = World(server(), *clients)
    world.server.seek([client.prefix for client in clients])
    world.run(20)
    return world


def test_nothing_is_said_before_a_client_is_there() -> None:
    world = World(server(), Client())
    world.run(200)
    assert world.sent == []


def test_it_is_looked_for_at_all_places_until_it_answers() -> None:
    places = [("10.0.0.2", 7410 + 2 * place) for place in range(33)]
    seeking = RtpsParticipant(SERVER, 7, (SERVER_AT,), places, lambda addresses: addresses[:1])
    seeking.seek([b"somebody....", b"another....."])
    assert [address for _, address in seeking.tick(100.0)] == places
    assert seeking.tick(100.01) == []
    assert 0 < seeking.pause_s(100.01) < 0.1
    assert [address for _, address in seeking.tick(100.1)] == places
    asked = [bool(seeking.tick(101.0 + second / 10)) for second in range(600)]
    assert 10 < sum(asked) < 25


def test_a_client_that_was_seen_finds_the_service_and_is_answered() -> None:
    client = Client()
    world = met(client)
    assert client.is_ready
    client.call(b"ping")
    world.run(3)
    assert client.got == [(client.replies.guid + struct.pack("<iI", 0, 1), b"ping")]


def test_an_older_fast_dds_says_it_by_its_own_parameter_and_is_answered() -> None:
    client = Client(parameter=RELATED_OF_FAST_DDS)
    world = met(client)
    client.call(b"ping")
    world.run(3)
    assert [payload for _, payload in client.got] == [b"ping"]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([0.1, 0.3, 0.5]))
def test_each_request_is_answered_once_whatever_gets_lost(seed: int, loses: float) -> None:
    answers: list[bytes] = []
    client = Client()
    world = World(server(answers), client, loses=loses, seed=seed)
    world.server.seek([client.prefix])
    for _ in range(100):
        world.run(20)
        if client.is_ready and client.request_writer.readers and client.reply_reader.writers:
            break
    for number in range(5):
        client.call(b"%d" % number)
    for _ in range(100):
        world.run(20)
        if len(client.got) == 5:
            break
    assert [payload for _, payload in client.got] == [b"0", b"1", b"2", b"3", b"4"]
    assert answers == [HEADER + b"%d" % number for number in range(5)]


def test_a_reply_is_for_the_client_that_asked() -> None:
    one, other = Client(1), Client(2)
    world = met(one, other)
    one.call(b"one")
    other.call(b"other")
    one.call(b"again")
    world.run(3)
    assert [payload for _, payload in one.got] == [b"one", b"again"]
    assert [payload for _, payload in other.got] == [b"other"]


def test_many_clients_one_after_the_other_are_answered_and_forgotten() -> None:
    participant = server()
    for number in range(1, 100):
        client = Client(number)
        world = World(participant, client)
        world.now_s += 30.0 * number
        participant.seek([client.prefix])
        world.run(20)
        client.call(b"%d" % number)
        world.run(3)
        assert [payload for _, payload in client.got] == [b"%d" % number]
        assert participant.clients == 1


def test_a_request_that_cannot_be_answered_does_not_end_the_answering(caplog: pytest.LogCaptureFixture) -> None:
    client = Client()
    world = met(client)
    client.call(b"fail")
    client.call(b"ping")
    world.run(3)
    assert [payload for _, payload in client.got] == [b"ping"]
    assert "/node/echo: a request of 8 bytes cannot be answered: it has to fail" in caplog.text


def test_a_request_in_parts_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    client = Client()
    world = met(client)
    body = struct.pack("<HH", 0, 28) + b"\0\0\1\4" + b"\0\0\1\3" + struct.pack("<iI", 0, 9) + bytes(12)
    datagram = b"RTPS\2\3" + client.vendor + client.prefix + struct.pack("<BBH", 0x16, 1, len(body)) + body
    for _ in range(3):
        world.server.receive(datagram, world.now_s)
    assert caplog.text.count("is too large") == 1


def test_who_is_not_on_fast_dds_is_told_of_no_service() -> None:
    ours, stranger = Client(1), Client(2, OF_CYCLONE_DDS)
    world = met(ours, stranger)
    world.run(20)
    assert ours.is_ready
    assert stranger.found == {}
    before = len(world.sent)
    world.run(10)
    assert all(address != stranger.address for _, address in world.sent[before:])


def test_who_has_gone_is_forgotten_at_once_and_who_is_silent_after_its_lease() -> None:
    one, other = Client(1), Client(2)
    world = met(one, other)
    assert world.server.clients == 2
    payload, inline = discovery.farewell(one.prefix + discovery.PARTICIPANT)
    one.say(Data(discovery.SPDP_READER, discovery.SPDP_WRITER, 2, payload, inline), to=ANYBODY)
    world.exchange()
    assert world.server.clients == 1
    world.server.tick(world.now_s + 21.0)
    assert world.server.clients == 0


def test_nobody_can_take_leave_for_another() -> None:
    one, other = Client(1), Client(2)
    world = met(one, other)
    payload, inline = discovery.farewell(one.prefix + discovery.PARTICIPANT)
    other.say(Data(discovery.SPDP_READER, discovery.SPDP_WRITER, 2, payload, inline), to=ANYBODY)
    world.exchange()
    one.call(b"ping")
    world.run(3)
    assert [payload for _, payload in one.got] == [b"ping"]


def test_all_are_told_of_the_end() -> None:
    one, other = Client(1), Client(2)
    world = met(one, other)
    world.route(world.server.leave())
    assert one.is_gone
    assert other.is_gone


def test_presence_is_told_again_before_it_expires() -> None:
    client = Client()
    world = met(client)
    before = len(world.sent)
    world.run(200)  # ten seconds
    assert len(world.sent) - before >= 3
    assert all(address == client.address for _, address in world.sent[before:])


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_damaged_datagrams_do_no_harm(data: st.DataObject) -> None:
    world = met(Client())
    for datagram in (recorded.PARTICIPANT, *data.draw(st.lists(st.sampled_from(recorded.ALL), max_size=12))):
        damaged = bytearray(datagram.replace(RECORDED_FOR, SERVER))
        for _ in range(data.draw(st.integers(0, 4))):
            damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
        assert len(world.server.receive(bytes(damaged), world.now_s)) < 50
    world.server.tick(world.now_s + 1.0)
    client = world.clients[0]
    client.call(b"ping")
    world.run(3)
    assert [payload for _, payload in client.got] == [b"ping"]
