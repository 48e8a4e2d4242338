"""Writes messages to an MCAP file with the profile ``ros2``, as ``ros2 bag record`` does."""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handsteer.errors import RecordingError, needing
from handsteer.messages import Topic, type_name
from handsteer.transports.encoding import message_definition, type_hash

with needing("recording", "record", "mcap"):
    from mcap.writer import CompressionType, Writer

_CHUNK_BYTES = 1 << 20

# As ROS 2 writes it, with the numbers of its enumerations, which all distributions read: keep last, reliable,
# automatic liveliness; the times are infinite.
_QOS = """- history: 1
  depth: {depth}
  reliability: 1
  durability: {durability}
  deadline: {{sec: 9223372036, nsec: 854775807}}
  lifespan: {{sec: 9223372036, nsec: 854775807}}
  liveliness: 1
  liveliness_lease_duration: {{sec: 9223372036, nsec: 854775807}}
  avoid_ros_namespace_conventions: false
"""
_TRANSIENT_LOCAL, _VOLATILE = 1, 2


class McapWriter:
    """Writes one MCAP file; not to be used by several threads at once.

    What was written before the last :meth:`cut` can be read even if the process is killed.

    Args:
        path: The file; it must not exist yet.

    Raises:
        RecordingError: The file exists or cannot be created.
        PackageMissing: The package mcap is not installed.
    """

    def __init__(self, path: Path) -> None:
        if path.suffix != ".mcap":
            raise RecordingError(f"{path} would be an MCAP file: give a name that ends with .mcap")
        try:
            self._file = path.open("xb")
        except FileExistsError:
            raise RecordingError(f"{path} exists already: give another name, nothing is overwritten") from None
        except OSError as error:
            raise RecordingError(f"cannot record to {path}: {error.strerror}") from None
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES, compression=CompressionType.LZ4)
        try:
            self._writer.start(profile="ros2", library="handsteer")
            self._file.flush()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.close()
            path.unlink(missing_ok=True)
            raise RecordingError(f"cannot record to {path}: {error.strerror}") from None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def write(self, topic: Topic[Any], name: str, raw: bytes, time_ns: int, number: int = 0) -> None:
        """Add a message.

        Args:
            topic: Its topic.
            name: Full name of the topic in the graph.
            raw: The message as little-endian CDR.
            time_ns: When it was received, in ns since the clock's epoch.
            number: Its number among the messages of the topic.

        Raises:
            OSError: The file cannot be written, for example because the disk is full.
        """
        kind = type_name(topic.type)
        channel = self._channels.get(name)
        if channel is None:
            # The registration would be lost with a chunk that has no message.
            channel = self._channels[name] = self._register(topic, name, kind)
        self._writer.add_message(channel, time_ns, raw, time_ns, number & 0xFFFFFFFF)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Add metadata to the file."""
        self._writer.add_metadata(name, dict(values))
        self._file.flush()

    def cut(self) -> None:
        """Write all messages so far to the file, so that they survive the process.

        Raises:
            OSError: The file cannot be written.
        """
        # The library has no public method for it: a chunk ends by its size only, however long that takes.
        self._writer._Writer__finalize_chunk()  # type: ignore[attr-defined]
        self._file.flush()

    def close(self) -> None:
        """Write the index and close the file.

        Raises:
            OSError: The file cannot be written; what was written before can be read.
        """
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._file.close()

    def _register(self, topic: Topic[Any], name: str, kind: str) -> int:
        if kind not in self._schemas:
            definition = message_definition(kind).encode()
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition)
        durability = _TRANSIENT_LOCAL if topic.latched else _VOLATILE
        qos = _QOS.format(depth=topic.depth, durability=durability)
        about = {"offered_qos_profiles": qos, "topic_type_hash": type_hash(kind)}
        return self._writer.register_channel(name, "cdr", self._schemas[kind], about)
