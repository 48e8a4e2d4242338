"""Who is in a domain and what they have, as RTPS participants tell one another (DDSI-RTPS 2.5, 8.5 and 9.6)."""

import socket
import struct
from dataclasses import dataclass

from handsteer.transports.dds.rtps.wire import PREFIX_BYTES, STATUS, VENDOR_UNKNOWN, Data, Parameters, decode_parameters
from handsteer.transports.dds.rtps.wire import encode_parameters as _encoded

Address = tuple[str, int]
"""IPv4 address and UDP port."""

PARTICIPANT = bytes.fromhex("000001c1")
SPDP_WRITER, SPDP_READER = bytes.fromhex("000100c2"), bytes.fromhex("000100c7")
"""Tell of participants."""
PUBLICATIONS_WRITER, PUBLICATIONS_READER = bytes.fromhex("000003c2"), bytes.fromhex("000003c7")
SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER = bytes.fromhex("000004c2"), bytes.fromhex("000004c7")
"""Tell of a participant's writers and readers."""

_ENCAPSULATION = bytes.fromhex("00030000")  # a list of parameters, little-endian
_LITTLE_LIST, _BIG_LIST = 0x03, 0x02
# Tells of itself, its writers and its readers, and listens to those of others.
_BUILTIN_ENDPOINTS = 0x3F
_LOCATORS_AT_MOST = 8
_UDPV4 = 1
_LOCATOR_BYTES, _GUID_BYTES = 24, 16
_RELIABLE, _VOLATILE = 2, 0
_REQUESTS = 1000

_LEASE, _TOPIC_NAME, _TYPE_NAME, _DOMAIN_ID, _VERSION, _VENDOR = 0x02, 0x05, 0x07, 0x0F, 0x15, 0x16
_RELIABILITY, _DURABILITY, _USER_DATA, _UNICAST, _DEFAULT_UNICAST = 0x1A, 0x1D, 0x2C, 0x2F, 0x31
_METATRAFFIC_UNICAST, _HISTORY, _PARTICIPANT_GUID, _ENDPOINT_SET, _ENDPOINT_GUID = 0x32, 0x40, 0x50, 0x58, 0x5A
KEY_HASH = 0x70
_GONE = bytes.fromhex("00000003")  # disposed and unregistered; big-endian in any message


@dataclass(frozen=True)
class ParticipantData:
    """What a participant tells of itself.

    Attributes:
        prefix: Its part of identifiers.
        metatraffic: Where it listens to what is told of others.
        default: Where its readers and writers listen, unless they say otherwise.
        lease_s: How long it is there without a word of it.
        user_data: What its maker wants to add.
    """

    prefix: bytes
    metatraffic: tuple[Address, ...]
    default: tuple[Address, ...]
    lease_s: float
    user_data: bytes = b""


@dataclass(frozen=True)
class EndpointData:
    """What a participant tells of a reader or a writer.

    Attributes:
        guid: Its identifier.
        topic: Name in DDS, as ``rq/node/list_parametersRequest``.
        type: Name in DDS.
        addresses: Where it listens; empty where its participant does.
        user_data: What its maker wants to add.
    """

    guid: bytes
    topic: str
    type: str
    addresses: tuple[Address, ...] = ()
    user_data: bytes = b""


def participant_payload(data: ParticipantData, domain: int) -> bytes:
    """Return what tells of a participant in a domain."""
    whole, fraction = divmod(data.lease_s, 1)
    return _ENCAPSULATION + _encoded(
        {
            _VERSION: [b"\x02\x03\0\0"],
            _VENDOR: [VENDOR_UNKNOWN + b"\0\0"],
            _PARTICIPANT_GUID: [data.prefix + PARTICIPANT],
            _DOMAIN_ID: [struct.pack("<I", domain)],
            _METATRAFFIC_UNICAST: [_locator(address) for address in data.metatraffic],
            _DEFAULT_UNICAST: [_locator(address) for address in data.default],
            _LEASE: [struct.pack("<iI", int(whole), int(fraction * (1 << 32)))],
            _ENDPOINT_SET: [struct.pack("<I", _BUILTIN_ENDPOINTS)],
            _USER_DATA: [_octets(data.user_data)],
        }
    )


def endpoint_payload(data: EndpointData) -> bytes:
    """Return what tells of a reliable, volatile reader or writer."""
    return _ENCAPSULATION + _encoded(
        {
            _ENDPOINT_GUID: [data.guid],
            _PARTICIPANT_GUID: [data.guid[:PREFIX_BYTES] + PARTICIPANT],
            _TOPIC_NAME: [_string(data.topic)],
            _TYPE_NAME: [_string(data.type)],
            _VERSION: [b"\x02\x03\0\0"],
            _VENDOR: [VENDOR_UNKNOWN + b"\0\0"],
            _UNICAST: [_locator(address) for address in data.addresses],
            _RELIABILITY: [struct.pack("<IiI", _RELIABLE, 0, 0)],
            _DURABILITY: [struct.pack("<I", _VOLATILE)],
            _HISTORY: [struct.pack("<II", 0, _REQUESTS)],
            _USER_DATA: [_octets(data.user_data)],
            KEY_HASH: [data.guid],
        }
    )


def farewell(guid: bytes, parameter: int = _PARTICIPANT_GUID) -> tuple[bytes, Parameters]:
    """Return the payload and what is said about it by which a participant takes its leave."""
    return _ENCAPSULATION + _encoded({parameter: [guid]}), Parameters({KEY_HASH: [guid], STATUS: [_GONE]})


def read_participant(data: Data) -> ParticipantData | None:
    """Return what a participant tells of itself; None when it cannot be read or it is a farewell."""
    found = _parameters(data)
    guid = found.first(_PARTICIPANT_GUID) if found else None
    if found is None or guid is None or len(guid) != _GUID_BYTES or is_gone(data):
        return None
    metatraffic, default = _addresses(found, _METATRAFFIC_UNICAST), _addresses(found, _DEFAULT_UNICAST)
    if not metatraffic:
        return None
    lease = found.first(_LEASE)
    seconds = struct.unpack(f"{found.order}iI", lease)[0] if lease is not None and len(lease) == 8 else 100
    return ParticipantData(guid[:PREFIX_BYTES], metatraffic, default or metatraffic, float(max(1, seconds)))


def read_endpoint(data: Data) -> EndpointData | None:
    """Return what is told of a reader or writer that is there; None when it cannot be read."""
    found = _parameters(data)
    guid = key(data)
    if found is None or guid is None:
        return None
    topic, kind = (_text(found.first(number), found.order) for number in (_TOPIC_NAME, _TYPE_NAME))
    if topic is None or kind is None:
        return None
    return EndpointData(guid, topic, kind, _addresses(found, _UNICAST))


def is_gone(data: Data) -> bool:
    """Return whether the sample says that what it tells of is gone."""
    status = data.inline.first(STATUS)
    return status is not None and len(status) == 4 and bool(status[3] & 3)


def key(data: Data) -> bytes | None:
    """Return the identifier of what the sample tells of, or of what is gone; None when it does not say."""
    found = _parameters(data) or Parameters()
    for guid in (data.inline.first(KEY_HASH), *(found.first(number) for number in (_ENDPOINT_GUID, _PARTICIPANT_GUID))):
        if guid is not None and len(guid) == _GUID_BYTES:
            return guid
    return None


def _parameters(data: Data) -> Parameters | None:
    raw = data.payload
    if raw is None or len(raw) < len(_ENCAPSULATION) or raw[1] not in {_LITTLE_LIST, _BIG_LIST}:
        return None
    try:
        return decode_parameters(raw[len(_ENCAPSULATION) :], "<" if raw[1] == _LITTLE_LIST else ">")[0]
    except ValueError:
        return None


def _addresses(found: Parameters, number: int) -> tuple[Address, ...]:
    addresses = (_address(value, found.order) for value in found.get(number, [])[:_LOCATORS_AT_MOST])
    return tuple(dict.fromkeys(address for address in addresses if address is not None))


def _address(locator: bytes, order: str) -> Address | None:
    if len(locator) != _LOCATOR_BYTES:
        return None
    kind, port = struct.unpack_from(f"{order}iI", locator)
    if kind != _UDPV4 or not 0 < port <= 0xFFFF:
        return None
    return socket.inet_ntoa(locator[20:]), port


def _locator(address: Address) -> bytes:
    host, port = address
    return struct.pack("<iI12x", _UDPV4, port) + socket.inet_aton(host)


def _string(text: str) -> bytes:
    raw = text.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw


def _octets(raw: bytes) -> bytes:
    return struct.pack("<I", len(raw)) + raw


def _text(raw: bytes | None, order: str) -> str | None:
    if raw is None or len(raw) < 5:
        return None
    (length,) = struct.unpack_from(f"{order}I", raw)
    return raw[4 : 4 + length].rstrip(b"\0").decode("utf-8", "replace") if length <= len(raw) - 4 else None
