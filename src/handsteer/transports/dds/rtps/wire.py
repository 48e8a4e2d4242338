"""Messages of RTPS as bytes, and back (DDSI-RTPS 2.5, sections 8.3 and 9.4).

We write little-endian and read both. Whatever is malformed is left out; nothing is raised for what the network brings.
"""

import struct
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

PREFIX_BYTES = 12
ENTITY_UNKNOWN = bytes(4)
ANYBODY = bytes(PREFIX_BYTES)
"""The prefix that stands for whoever gets the message."""
WIDEST_SET = 256
"""How many numbers a set of sequence numbers can span."""

_HEADER = struct.Struct("4s2s2s12s")
_MAGIC = b"RTPS"
# One of its own for each maker of DDS; zeros are for those who have none.
VENDOR_UNKNOWN = b"\0\0"
VENDOR_FAST_DDS = b"\x01\x0f"
_VERSION = b"\x02\x03"
_ACKNACK, _HEARTBEAT, _GAP, _INFO_TS, _INFO_SRC, _INFO_DST = 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0E
_DATA, _DATA_FRAG = 0x15, 0x16
_WITHOUT_LENGTH = frozenset({0x01, _INFO_TS})
_LITTLE = 0x01
_SENTINEL, _PAD = 0x01, 0x00
STATUS = 0x71
"""Parameter that says of a sample that what it tells of is gone."""
_MUST_UNDERSTAND = 0x4000
# Before its flags for the set's extent, that of DATA says how far its quality of service is from here.
_TO_INLINE_QOS = 16
_NTP_FRACTIONS = 1 << 32


class Parameters(dict[int, list[bytes]]):
    """Values by the number of their parameter; each may be there several times.

    Attributes:
        order: Byte order of the numbers in the values, as :mod:`struct` has it.
    """

    order: str = "<"

    def first(self, number: int) -> bytes | None:
        """Return the first value of a parameter; None when it is not there."""
        found = self.get(number)
        return found[0] if found else None


@dataclass(frozen=True)
class Data:
    """A sample, or the end of one.

    Attributes:
        reader: Entity that it is for; zeros for all of the topic.
        writer: Entity that it is from.
        number: Its sequence number, from 1.
        payload: The sample with its header of four bytes; None when there is none.
        inline: What is said about the sample.
    """

    reader: bytes
    writer: bytes
    number: int
    payload: bytes | None
    inline: Parameters = field(default_factory=Parameters)


@dataclass(frozen=True)
class Fragment:
    """A part of a sample that was too large for one message, which we do not put together."""

    reader: bytes
    writer: bytes
    number: int


@dataclass(frozen=True)
class Heartbeat:
    """What a writer has: the samples from ``first`` to ``last``; none when ``last`` is ``first - 1``."""

    reader: bytes
    writer: bytes
    first: int
    last: int
    count: int
    final: bool


@dataclass(frozen=True)
class AckNack:
    """What a reader has: all samples before ``base``; those in ``missing`` it asks for."""

    reader: bytes
    writer: bytes
    base: int
    missing: tuple[int, ...]
    count: int
    final: bool


@dataclass(frozen=True)
class Gap:
    """Which samples a reader need not wait for: from ``start`` to ``base - 1``, and ``numbers``."""

    reader: bytes
    writer: bytes
    start: int
    base: int
    numbers: tuple[int, ...]


Submessage = Data | Fragment | Heartbeat | AckNack | Gap


@dataclass(frozen=True)
class Message:
    """A datagram.

    Attributes:
        prefix: Whose it is.
        vendor: Who made its DDS.
        parts: Prefix of whom each part is for, and the part.
    """

    prefix: bytes
    vendor: bytes
    parts: tuple[tuple[bytes, Submessage], ...]


def decode(datagram: bytes) -> Message | None:
    """Return what the datagram says, up to where it is malformed; None when it is none of RTPS 2."""
    if len(datagram) < _HEADER.size:
        return None
    magic, version, vendor, prefix = _HEADER.unpack_from(datagram)
    if magic != _MAGIC or version[0] != _VERSION[0]:
        return None
    parts: list[tuple[bytes, Submessage]] = []
    destination = ANYBODY
    for kind, flags, body in _submessages(datagram):
        order = "<" if flags & _LITTLE else ">"
        try:
            if kind == _INFO_SRC:
                break  # forwarded for somebody else, which nobody does whom we know
            if kind == _INFO_DST:
                (destination,) = struct.unpack_from("12s", body)
            elif kind in _READ:
                parts.append((destination, _READ[kind](body, flags, order)))
        except (struct.error, ValueError):
            break
    return Message(prefix, vendor, tuple(parts))


def encode(prefix: bytes, destination: bytes, parts: Iterable[Submessage]) -> bytes:
    """Return the datagram that says ``parts`` to the participant ``destination``, or to anybody."""
    found = [_HEADER.pack(_MAGIC, _VERSION, VENDOR_UNKNOWN, prefix)]
    if destination != ANYBODY:
        found.append(_framed(_INFO_DST, 0, destination))
    has_data = False
    for part in parts:
        if isinstance(part, Data) and not has_data:
            has_data = True
            found.append(_framed(_INFO_TS, 0, _now()))
        found.append(_written(part))
    return b"".join(found)


def decode_parameters(raw: bytes, order: str) -> tuple[Parameters, int]:
    """Return the list of parameters at the beginning of ``raw``, and how many bytes it has.

    Raises:
        ValueError: It has no end.
    """
    found = Parameters()
    found.order = order
    at = 0
    while at + 4 <= len(raw):
        number, length = struct.unpack_from(f"{order}HH", raw, at)
        at += 4
        if number == _SENTINEL:
            return found, at
        if at + length > len(raw):
            break
        if number != _PAD:
            found.setdefault(number & ~_MUST_UNDERSTAND, []).append(raw[at : at + length])
        at += length
    raise ValueError("a list of parameters has no end")


def encode_parameters(parameters: Mapping[int, Iterable[bytes]]) -> bytes:
    """Return ``parameters``, whose numbers are little-endian, as bytes."""
    found = b""
    for number, values in parameters.items():
        for value in values:
            padded = value + bytes(-len(value) % 4)
            found += struct.pack("<HH", number, len(padded)) + padded
    return found + struct.pack("<HH", _SENTINEL, 0)


def _submessages(datagram: bytes) -> Iterator[tuple[int, int, bytes]]:
    at = _HEADER.size
    while at + 4 <= len(datagram):
        kind, flags = datagram[at], datagram[at + 1]
        (length,) = struct.unpack_from("<H" if flags & _LITTLE else ">H", datagram, at + 2)
        at += 4
        if length == 0 and kind not in _WITHOUT_LENGTH:
            length = len(datagram) - at  # the last one may leave it out
        if at + length > len(datagram):
            return
        yield kind, flags, datagram[at : at + length]
        at += length


def _number(body: bytes, order: str, at: int) -> int:
    high, low = struct.unpack_from(f"{order}iI", body, at)
    return int(high << 32 | low)


def _set(body: bytes, order: str, at: int) -> tuple[int, tuple[int, ...], int]:
    """Return the base and the numbers of the set at ``at``, and where it ends."""
    base = _number(body, order, at)
    (bits,) = struct.unpack_from(f"{order}I", body, at + 8)
    if bits > WIDEST_SET or base < 0:
        raise ValueError("a set of sequence numbers is too wide")
    words = struct.unpack_from(f"{order}{(bits + 31) // 32}I", body, at + 12)
    numbers = tuple(base + bit for bit in range(bits) if words[bit // 32] >> (31 - bit % 32) & 1)
    return base, numbers, at + 12 + 4 * len(words)


def _read_data(body: bytes, flags: int, order: str) -> Data:
    _, to_qos, reader, writer = struct.unpack_from(f"{order}HH4s4s", body)
    number = _number(body, order, 12)
    at = 4 + to_qos
    inline = Parameters()
    if flags & 0x02:
        if to_qos < _TO_INLINE_QOS:
            raise ValueError("the header of a sample is too short")
        inline, length = decode_parameters(body[at:], order)
        at += length
    has_payload = flags & 0x0C
    return Data(reader, writer, number, body[at:] if has_payload else None, inline)


def _read_fragment(body: bytes, flags: int, order: str) -> Fragment:
    del flags
    reader, writer = struct.unpack_from("4x4s4s", body)
    return Fragment(reader, writer, _number(body, order, 12))


def _read_heartbeat(body: bytes, flags: int, order: str) -> Heartbeat:
    reader, writer = struct.unpack_from("4s4s", body)
    (count,) = struct.unpack_from(f"{order}i", body, 24)
    return Heartbeat(reader, writer, _number(body, order, 8), _number(body, order, 16), count, bool(flags & 0x02))


def _read_acknack(body: bytes, flags: int, order: str) -> AckNack:
    reader, writer = struct.unpack_from("4s4s", body)
    base, missing, end = _set(body, order, 8)
    (count,) = struct.unpack_from(f"{order}i", body, end)
    return AckNack(reader, writer, base, missing, count, bool(flags & 0x02))


def _read_gap(body: bytes, flags: int, order: str) -> Gap:
    del flags
    reader, writer = struct.unpack_from("4s4s", body)
    base, numbers, _ = _set(body, order, 16)
    return Gap(reader, writer, _number(body, order, 8), base, numbers)


_READ: dict[int, Callable[[bytes, int, str], Submessage]] = {
    _DATA: _read_data,
    _DATA_FRAG: _read_fragment,
    _HEARTBEAT: _read_heartbeat,
    _ACKNACK: _read_acknack,
    _GAP: _read_gap,
}


def _framed(kind: int, flags: int, body: bytes) -> bytes:
    # One that is too long for the field can only be the last, which may leave its length out.
    length = len(body) if len(body) <= 0xFFFF else 0
    return struct.pack("<BBH", kind, flags | _LITTLE, length) + body


def _written(part: Submessage) -> bytes:
    match part:
        case Data():
            return _written_data(part)
        case Heartbeat():
            numbers = _packed(part.first) + _packed(part.last)
            body = part.reader + part.writer + numbers + struct.pack("<i", part.count)
            return _framed(_HEARTBEAT, 0x02 if part.final else 0, body)
        case AckNack():
            body = part.reader + part.writer + _packed_set(part.base, part.missing) + struct.pack("<i", part.count)
            return _framed(_ACKNACK, 0x02 if part.final else 0, body)
        case Gap():
            body = part.reader + part.writer + _packed(part.start) + _packed_set(part.base, part.numbers)
            return _framed(_GAP, 0, body)
        case Fragment():
            raise TypeError("fragments are never sent")


def _written_data(part: Data) -> bytes:
    # Beside a status, the payload is no sample but the key of what the status is of.
    kind = 0x08 if STATUS in part.inline else 0x04
    flags = (0x02 if part.inline else 0) | (kind if part.payload is not None else 0)
    body = struct.pack("<HH", 0, _TO_INLINE_QOS) + part.reader + part.writer + _packed(part.number)
    body += encode_parameters(part.inline) if part.inline else b""
    body += part.payload or b""
    return _framed(_DATA, flags, body + bytes(-len(body) % 4))


def _packed(number: int) -> bytes:
    return struct.pack("<II", number >> 32 & 0xFFFFFFFF, number & 0xFFFFFFFF)


def _packed_set(base: int, numbers: tuple[int, ...]) -> bytes:
    bits = max(numbers) - base + 1 if numbers else 0
    words = [0] * ((bits + 31) // 32)
    for number in numbers:
        bit = number - base
        words[bit // 32] |= 1 << (31 - bit % 32)
    return _packed(base) + struct.pack(f"<I{len(words)}I", bits, *words)


def _now() -> bytes:
    seconds = time.time()
    return struct.pack("<II", int(seconds) & 0xFFFFFFFF, int(seconds % 1 * _NTP_FRACTIONS))
