"""What a recording says about the software that made it."""

import datetime
import hashlib
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from handsteer import __version__
from handsteer.clock import Clock
from handsteer.config import Config

_PACKAGES = ("ai-edge-litert", "mujoco", "numpy", "opencv-python-headless")


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
    return about | hashes_of(models)


def hashes_of(models: Sequence[Path]) -> dict[str, str]:
    """Return the SHA-256 of each file, as ``{"model hand_landmark_fast.tflite": "3f…"}``."""
    return {f"model {path.name}": hashlib.sha256(path.read_bytes()).hexdigest() for path in models}
