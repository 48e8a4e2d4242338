"""Messages of RTPS as bytes and back, by datagrams of a real Fast DDS, made ones and nonsense."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.transports.dds.rtps import discovery
from handsteer.transports.dds.rtps.wire import (
    ANYBODY,
    VENDOR_FAST_DDS,
    AckNack,
    Data,
    Fragment,
    Gap,
    Heartbeat,
    Message,
    Parameters,
    Submessage,
    decode,
    encode,
)
from tests.transports.dds.rtps import recorded

RELATED = 0x83
entities = st.binary(min_size=4, max_size=4)
prefixes = st.binary(min_size=12, max_size=12)
numbers = st.integers(1, 2**62)
counts = st.integers(-(2**31), 2**31 - 1)


@st.composite
def sets(draw: st.DrawFn) -> tuple[int, tuple[int, ...]]:
    base = draw(numbers)
    return base, tuple(sorted(base + offset for offset in draw(st.sets(st.integers(0, 255)))))


@st.composite
def parameters(draw: st.DrawFn) -> Parameters:
    values = st.lists(st.binary(max_size=40).map(lambda raw: raw + bytes(-len(raw) % 4)), min_size=1, max_size=3)
    return Parameters(draw(st.dictionaries(st.integers(2, 0x3FFF), values, max_size=4)))


payloads = st.none() | st.binary(max_size=200).map(lambda raw: b"\0\1\0\0" + raw + bytes(-len(raw) % 4))
submessages = st.one_of(
    st.builds(Data, entities, entities, numbers, payloads, parameters()),
    st.builds(Heartbeat, entities, entities, numbers, numbers, counts, st.booleans()),
    st.builds(
        lambda a, b, numbers, count, final: AckNack(a, b, *numbers, count, final),
        *(entities, entities, sets(), counts, st.booleans()),
    ),
    st.builds(lambda a, b, start, numbers: Gap(a, b, start, *numbers), entities, entities, numbers, sets()),
)


def only(datagram: bytes) -> tuple[Message, Submessage]:
    message = decode(datagram)
    assert message is not None
    (part,) = [part for _, part in message.parts]
    return message, part


@given(prefixes, prefixes, st.lists(submessages, max_size=5))
def test_what_is_written_is_read(prefix: bytes, to: bytes, parts: list[Submessage]) -> None:
    message = decode(encode(prefix, to, parts))
    assert message is not None
    assert message.prefix == prefix
    assert [part for _, part in message.parts] == parts
    assert {destination for destination, _ in message.parts} <= {to}


@given(st.lists(submessages, min_size=1, max_size=3), st.data())
def test_a_datagram_that_ends_early_gives_what_came_before(parts: list[Submessage], data: st.DataObject) -> None:
    datagram = encode(b"p" * 12, ANYBODY, parts)
    message = decode(datagram[: data.draw(st.integers(0, len(datagram)))])
    if message is not None:
        found = [part for _, part in message.parts]
        assert found == parts[: len(found)]


@given(st.binary(max_size=400))
def test_nonsense_is_nothing(raw: bytes) -> None:
    decode(raw)
    assert decode(b"RTPX" + raw) is None
    for _, part in (decode(b"RTPS\2\3" + bytes(14) + raw) or Message(b"", b"")).parts:
        if not isinstance(part, Fragment):
            encode(ANYBODY, ANYBODY, [part])


@given(st.sampled_from(recorded.ALL), st.data())
def test_a_real_datagram_that_is_damaged_does_no_harm(datagram: bytes, data: st.DataObject) -> None:
    damaged = bytearray(datagram)
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(20, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    for _, part in (decode(bytes(damaged)) or Message(b"", b"")).parts:
        if isinstance(part, Data):
            discovery.read_participant(part)
            discovery.read_endpoint(part)


def test_a_participant_on_fast_dds_tells_where_it_listens() -> None:
    message, part = only(recorded.PARTICIPANT)
    assert message.vendor == VENDOR_FAST_DDS
    assert isinstance(part, Data)
    said = discovery.read_participant(part)
    assert said is not None
    assert said.prefix == message.prefix
    assert said.lease_s == 20.0
    assert [host for host, _ in (*said.metatraffic, *said.default)]
    assert all(7400 < port < 65536 for _, port in (*said.metatraffic, *said.default))


@pytest.mark.parametrize(
    ("datagram", "topic", "kind"),
    [
        (recorded.READER, "rr/a/hand_sign_control/list_parametersReply", "Response_"),
        (recorded.WRITER, "rq/a/hand_sign_control/list_parametersRequest", "Request_"),
    ],
)
def test_the_ends_of_a_client_on_fast_dds_are_known(datagram: bytes, topic: str, kind: str) -> None:
    message, part = only(datagram)
    assert isinstance(part, Data)
    said = discovery.read_endpoint(part)
    assert said is not None
    assert (said.topic, said.type) == (topic, f"rcl_interfaces::srv::dds_::ListParameters_{kind}")
    assert said.guid.startswith(message.prefix)
    assert not discovery.is_gone(part)


def test_a_request_says_which_reader_the_reply_is_for() -> None:
    _, part = only(recorded.REQUEST)
    _, reader = only(recorded.READER)
    assert isinstance(part, Data)
    assert isinstance(reader, Data)
    related = part.inline.first(RELATED)
    assert related is not None
    assert related[:16] == discovery.key(reader)
    assert part.number == 1
    assert part.payload == bytes.fromhex("00010000") + bytes(16)


def test_a_heartbeat_and_an_acknowledgement_are_read() -> None:
    _, heartbeat = only(recorded.HEARTBEAT)
    assert isinstance(heartbeat, Heartbeat)
    assert (heartbeat.first, heartbeat.last) == (1, 0)
    _, acknowledged = only(recorded.ACKNACK)
    assert isinstance(acknowledged, AckNack)
    assert acknowledged.missing == ()


def test_big_endian_messages_are_read() -> None:
    body = b"rrrr" + b"wwww" + struct.pack(">iIiIi", 0, 3, 0, 9, 7)
    _, part = only(b"RTPS\2\1\1\2" + bytes(12) + struct.pack(">BBH", 0x07, 0x02, len(body)) + body)
    assert part == Heartbeat(b"rrrr", b"wwww", 3, 9, 7, final=True)


def test_a_sample_too_long_for_the_length_field_is_the_last_and_read_whole() -> None:
    data = Data(b"rrrr", b"wwww", 1, b"\0\1\0\0" + bytes(65_600))
    assert only(encode(b"p" * 12, ANYBODY, [data]))[1] == data


@given(prefixes, st.floats(1, 1000).map(int), st.integers(1, 65535))
def test_what_we_tell_of_ourselves_is_read(prefix: bytes, lease_s: int, port: int) -> None:
    told = discovery.ParticipantData(prefix, (("127.0.0.1", port),), (("10.0.0.7", port),), float(lease_s))
    payload = discovery.participant_payload(told, domain=3)
    assert discovery.read_participant(Data(b"", b"", 1, payload)) == told
    end = discovery.EndpointData(prefix + b"\0\0\1\4", "rq/nöde/xRequest", "a::b_", (("127.0.0.1", port),))
    assert discovery.read_endpoint(Data(b"", b"", 1, discovery.endpoint_payload(end))) == end
    payload, inline = discovery.farewell(prefix + discovery.PARTICIPANT)
    gone = Data(b"", b"", 2, payload, inline)
    assert discovery.is_gone(gone)
    assert discovery.read_participant(gone) is None
    assert discovery.key(gone) == prefix + discovery.PARTICIPANT
