"""Reads a camera's lens calibration, as ``CameraInfo``, from a file of ROS's ``camera_calibration``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handsteer import plain_yaml
from handsteer.errors import CameraError
from handsteer.messages import CameraInfo, Header, RegionOfInterest, Time

_MATRICES = {"camera_matrix": 9, "rectification_matrix": 9, "projection_matrix": 12}
_NO_TIME = Time(sec=0, nanosec=0)
_WHOLE = RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)


def uncalibrated(width: int, height: int) -> CameraInfo:
    """Return the ``CameraInfo`` of an uncalibrated camera: its size in pixels, and zeros."""
    return _info((width, height), "", np.zeros(0), [np.zeros(count) for count in _MATRICES.values()])


def read_calibration(path: Path) -> CameraInfo:
    """Return the calibration in a YAML file written by ``camera_calibration``, such as ``ost.yaml``.

    Raises:
        CameraError: It cannot be read, or is not such a file; the message names the field.
    """
    values = plain_yaml.read(path, str(path), CameraError, f"cannot read the calibration {path}")
    if not isinstance(values, dict):
        raise CameraError(
            f"{path}: expected a calibration as camera_calibration writes it, with image_width at the top"
        )
    width, height = (_size(path, values, name) for name in ("image_width", "image_height"))
    matrices = [_numbers(path, values, name, count) for name, count in _MATRICES.items()]
    distortion = _numbers(path, values, "distortion_coefficients", None)
    return _info((width, height), str(values.get("distortion_model", "plumb_bob")), distortion, matrices)


def _info(
    size: tuple[int, int], model: str, distortion: NDArray[np.float64], matrices: Sequence[NDArray[np.float64]]
) -> CameraInfo:
    (width, height), (k, r, p) = size, matrices
    header = Header(stamp=_NO_TIME, frame_id="")
    return CameraInfo(header, height, width, model, distortion, k, r, p, binning_x=0, binning_y=0, roi=_WHOLE)


def _size(path: Path, values: dict[str, Any], name: str) -> int:
    size = values.get(name)
    if not isinstance(size, int) or isinstance(size, bool) or size <= 0:
        raise CameraError(f"{path}: {name} should be a whole number of pixels, not {size!r}")
    return size


def _numbers(path: Path, values: dict[str, Any], name: str, count: int | None) -> NDArray[np.float64]:
    table = values.get(name)
    data = table.get("data") if isinstance(table, dict) else None
    is_list = isinstance(data, list) and all(isinstance(one, int | float) for one in data)
    if not is_list or (count is not None and len(data or ()) != count):
        wanted = "numbers" if count is None else f"{count} numbers"
        raise CameraError(f"{path}: {name}.data should be a list of {wanted}")
    return np.array(data, dtype=np.float64)
