"""Reads bags of ROS 1 and of ROS 2, by rosbags."""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from handsteer.errors import RecordingError
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.regular_files import open_regular
from handsteer.transports.encoding import types

_METADATA = "metadata.yaml"
"""In the folder of each bag of ROS 2."""


class Bag(Recording):
    """A bag: a file of ROS 1 (``.bag``), or a folder of ROS 2, or a file of one (``.db3``).

    Args:
        path: The file or folder.

    Raises:
        RecordingError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        if path.is_dir() and not (path / _METADATA).exists():
            raise RecordingError(f"{path} is a folder without {_METADATA}: give a recording (.mcap) or a bag")
        super().__init__(path)
        self._is_ros1 = path.suffix == ".bag"
        if not self.began_s and self.problem is not None:
            raise RecordingError(f"cannot read the bag {path}: {self.problem}")

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield the messages of ``topics``, of all by default, in the order of their times."""
        try:
            if not self.path.is_dir():
                open_regular(self.path).close()
            reader: Any = Ros1Reader(self.path) if self._is_ros1 else Ros2Reader(self.path)
            with reader:
                chosen = [known for known in reader.connections if topics is None or known.topic in topics]
                # Without connections, all messages would be read.
                for connection, time_ns, raw in reader.messages(connections=chosen) if chosen else ():
                    content = self._as_cdr(raw, connection.msgtype)
                    if content is not None:
                        yield Recorded(connection.topic, connection.msgtype, time_ns, 0, content)
        # The type depends on where rosbags fails.
        except Exception as error:
            self.problem = " ".join(f"{type(error).__name__}: {error}".split())[:300]

    def _as_cdr(self, raw: bytes, kind: str) -> bytes | None:
        """Return a message as CDR; None if its type is not known, or not the same in ROS 1."""
        if not self._is_ros1:
            return bytes(raw)
        if kind not in types().fielddefs:
            return None
        try:
            return bytes(types().ros1_to_cdr(raw, kind))
        except Exception:
            return None
