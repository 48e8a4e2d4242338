"""Recordings as files: which they are, how they are opened, and what a new one says of itself."""

import datetime
import hashlib
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from handsteer import __version__
from handsteer.cameras.files import BAGS
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import RecordingError, without_passwords
from handsteer.regular_files import read_regular

if TYPE_CHECKING:
    from handsteer.plugins.record.recorded import Recording

_PACKAGES = ("ai-edge-litert", "mujoco", "numpy", "opencv-python-headless")

_LARGEST_MODEL_BYTES = 300_000_000


def open_recording(path: Path) -> "Recording":
    """Return the recording ``path``: an MCAP file, a bag of ROS 1, or a bag of ROS 2, which is a folder.

    Raises:
        RecordingError: It cannot be read.
        PackageMissing: It is an MCAP file, and the package mcap is not installed.
    """
    if not path.exists():
        raise RecordingError(f"there is no recording {path}")
    # The readers load libraries that nodes do not need.
    if path.is_dir() or path.suffix.lower() in BAGS:
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
        camera = config.camera.model_copy(update={"source": without_passwords(config.camera.source)})
        about["config"] = config.model_copy(update={"camera": camera}).model_dump_json()
    return about | {
        f"model {path.name}": hashlib.sha256(read_regular(path, _LARGEST_MODEL_BYTES)).hexdigest() for path in models
    }
