"""Recordings of a graph's topics: MCAP files as ROS 2 writes them, and bags of ROS 1 and 2; run again, and reports.

``recorder`` writes the topics of a graph to an MCAP file while it runs, ``recorded`` reads such files, whole or cut
off. ``audit_log`` writes the audit to a rotating log file. :mod:`~handsteer.plugins.record.replay` runs a recording
again, and reports on it.

Imports the kernel only.
"""

import datetime
import hashlib
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from handsteer import __version__
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import RecordingError
from handsteer.regular_files import read_regular

if TYPE_CHECKING:
    from handsteer.plugins.record.recorded import Recording

_BAGS = frozenset({".bag", ".db3"})
_PACKAGES = ("ai-edge-litert", "mujoco", "numpy", "opencv-python-headless")

_LARGEST_MODEL_BYTES = 300_000_000


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
        from handsteer.plugins.record.bags import Bag  # noqa: PLC0415

        return Bag(path)
    from handsteer.plugins.record.mcap_reader import McapFile  # noqa: PLC0415

    return McapFile(path)


def describe(config: Config | None, clock: Clock, models: Sequence[Path]) -> dict[str, str]:
    """Return the metadata of a recording that begins now: parameters, versions, and hashes of the models.

    Args:
        config: The parameters of all nodes; None if they are not known.
        clock: The graph's clock.
        models: The model files of the recognition.
    """
    about = {
        "handsteer": __version__,
        "began": datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds"),
        "clock_offset_s": repr(clock.offset_s),
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }
    for package in _PACKAGES:
        try:
            about[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    if config is not None:
        about["config"] = config.model_dump_json()
    return about | {
        f"model {path.name}": hashlib.sha256(read_regular(path, _LARGEST_MODEL_BYTES)).hexdigest() for path in models
    }
