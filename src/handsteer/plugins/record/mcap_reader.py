"""Reads MCAP files, also those that were cut off or damaged: everything before the damage."""

import struct
import zlib
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, Any

from handsteer.errors import RecordingError, needing
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.regular_files import open_regular

with needing("reading MCAP files", "record", "mcap"):
    import lz4.frame
    import zstandard
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.opcode import Opcode
    from mcap.records import Channel, Chunk, Metadata, Schema
    from mcap.writer import MCAP0_MAGIC

_LARGEST_RECORD = 64 << 20
_LARGEST_CHUNK = 64 << 20
_MOST_CHANNELS = 10_000
_FAILURES = (McapError, struct.error, ValueError, IndexError, KeyError, MemoryError, OverflowError, EOFError)
_FAILURES_OF_CHUNKS = (*_FAILURES, zstandard.ZstdError, RuntimeError)


class McapFile(Recording):
    """An MCAP file.

    Args:
        path: The file.

    Raises:
        RecordingError: It cannot be read, or is not an MCAP file.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        for opcode, body in self._records():
            if opcode == Opcode.METADATA:
                metadata = self._parsed(Metadata, body)
                if metadata is not None and metadata.name == "handsteer":
                    self.about = metadata.metadata
            elif opcode != Opcode.HEADER:
                break

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield the messages of ``topics``, of all by default, in the order in which they were written."""
        schemas: dict[int, Schema] = {}
        channels: dict[int, tuple[str, str]] = {}
        for opcode, body in self._flat():
            if opcode == Opcode.MESSAGE:
                channel = channels.get(int.from_bytes(body[:2], "little"))
                if channel is not None and (topics is None or channel[0] in topics) and len(body) >= _MESSAGE.size:
                    _, number, time_ns, _ = _MESSAGE.unpack_from(body)
                    yield Recorded(*channel, time_ns, number, body[_MESSAGE.size :])
            elif opcode == Opcode.SCHEMA and len(schemas) < _MOST_CHANNELS:
                if (schema := self._parsed(Schema, body)) is not None:
                    schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL and len(channels) < _MOST_CHANNELS:
                known = self._parsed(Channel, body)
                if known is not None and known.message_encoding == "cdr":
                    kind = schemas.get(known.schema_id)
                    channels[known.id] = (known.topic, "" if kind is None else kind.name)

    def _flat(self) -> Iterator[tuple[int, bytes]]:
        """Yield all records, those of chunks instead of the chunks."""
        for opcode, body in self._records():
            if opcode != Opcode.CHUNK:
                yield opcode, body
                continue
            try:
                content = _unpacked(body)
            except _FAILURES_OF_CHUNKS as error:
                self._leave_out("part", error)
                continue
            yield from _split(BytesIO(content), len(content))

    def _records(self) -> Iterator[tuple[int, bytes]]:
        try:
            size = self.path.stat().st_size
            with open_regular(self.path) as file:
                if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                    raise RecordingError(f"{self.path} is not an MCAP file: it does not begin as one")
                at = file.tell()
                for opcode, body in _split(file, size):
                    at = file.tell()
                    if opcode == Opcode.FOOTER:
                        return
                    yield opcode, body
        except OSError as error:
            raise RecordingError(f"cannot read {self.path}: {error.strerror or error}") from None
        was_cut = f"it was cut off or damaged after {at} of {size} bytes"
        self.problem = was_cut if at < size else "it was not closed, as after kill -9; its last messages may be missing"

    def _parsed(self, kind: Any, body: bytes) -> Any:
        try:
            return kind.read(ReadDataStream(BytesIO(body)))
        except _FAILURES as error:
            self._leave_out("record", error)
            return None

    def _leave_out(self, what: str, error: Exception) -> None:
        self.is_damaged, self.problem = True, f"a damaged {what} was left out: {error}"


_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")


def _split(stream: IO[bytes], size: int) -> Iterator[tuple[int, bytes]]:
    """Yield the code and the content of each record of a stream of ``size`` bytes, up to the first incomplete one."""
    while len(start := stream.read(_RECORD.size)) == _RECORD.size:
        opcode, length = _RECORD.unpack(start)
        if opcode == 0 or length > min(_LARGEST_RECORD, size):
            return
        body = stream.read(length)
        if len(body) < length:
            return
        yield opcode, body


def _unpacked(body: bytes) -> bytes:
    """Return the records of a chunk.

    Raises:
        ValueError: It is damaged or too large.
        Exception: It is damaged; the type depends on where a library fails.
    """
    chunk = Chunk.read(ReadDataStream(BytesIO(body)))
    if chunk.uncompressed_size > _LARGEST_CHUNK:
        raise ValueError(f"a chunk of {chunk.uncompressed_size} bytes is larger than {_LARGEST_CHUNK}")
    if chunk.compression == "lz4":
        content = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size)
    elif chunk.compression == "zstd":
        reader = zstandard.ZstdDecompressor(max_window_size=_LARGEST_CHUNK).stream_reader(chunk.data)
        content = reader.read(chunk.uncompressed_size)
    elif not chunk.compression:
        content = chunk.data
    else:
        raise ValueError(f"a chunk is compressed by {chunk.compression[:20]!r}, which is neither lz4 nor zstd")
    if len(content) != chunk.uncompressed_size:
        raise ValueError(f"a chunk has {len(content)} of {chunk.uncompressed_size} bytes")
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise ValueError("the checksum of a chunk is wrong")
    return bytes(content)
