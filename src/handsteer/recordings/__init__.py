"""Recordings of a graph's topics: MCAP files as ROS 2 writes them, and bags of ROS 1 and 2."""

from pathlib import Path
from typing import TYPE_CHECKING

from handsteer.errors import RecordingError

if TYPE_CHECKING:
    from handsteer.recordings.recorded import Recording

_BAGS = frozenset({".bag", ".db3"})


def is_recording(path: Path) -> bool:
    """Return whether ``path`` is named as a recording: ``.mcap``, ``.bag``, ``.db3``, or a folder with one of ROS 2."""
    return path.suffix.lower() in _BAGS | {".mcap"} or (path / "metadata.yaml").is_file()


def open_recording(path: Path) -> "Recording":
    """Return the recording ``path``: an MCAP file, a bag of ROS 1, or a bag of ROS 2, which is a folder.

    Raises:
        RecordingError: It cannot be read.
        PackageMissing: It is an MCAP file, and the package mcap is not installed.
    """
    if not path.exists():
        raise RecordingError(f"there is no recording {path}")
    # The readers load libraries that nodes do not need.
    if path.is_dir() or path.suffix.lower() in _BAGS:
        from handsteer.recordings.bags import Bag  # noqa: PLC0415

        return Bag(path)
    from handsteer.recordings.mcap_reader import McapFile  # noqa: PLC0415

    return McapFile(path)
