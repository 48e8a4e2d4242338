from pathlib import Path

import numpy as np
import pytest

from handsteer.cameras.choose import read_calibration, uncalibrated
from handsteer.errors import CameraError

OST = """
image_width: 640
image_height: 480
camera_name: eye
camera_matrix: {rows: 3, cols: 3, data: [500.0, 0, 320.0, 0, 501.0, 240.0, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [480, 0, 320, 0, 0, 481, 240, 0, 0, 0, 1, 0]}
"""
"""As camera_calibration writes it."""


def test_what_ros_has_written_is_read(tmp_path: Path) -> None:
    file = tmp_path / "ost.yaml"
    file.write_text(OST)
    info = read_calibration(file)
    assert (info.width, info.height, info.distortion_model) == (640, 480, "plumb_bob")
    assert (info.k[0], info.k[4], info.p[5], len(info.d), len(info.r)) == (500.0, 501.0, 481.0, 5, 9)


def test_what_is_not_known_is_zero() -> None:
    info = uncalibrated(320, 240)
    assert (info.width, info.height) == (320, 240)
    assert not np.any(info.k)
    assert len(info.d) == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("image_width: 640", "image_width: wide", "image_width should be a whole number of pixels, not 'wide'"),
        ("camera_matrix", "matrix", "camera_matrix.data should be a list of 9 numbers"),
        ("0, 0, 1, 0]}", "0]}", "projection_matrix.data should be a list of 12 numbers"),
        ("data: [0.1, -0.2, 0, 0, 0]", "data: much", "distortion_coefficients.data should be a list of numbers"),
        (OST, "[1, 2]", "expected a calibration as camera_calibration writes it"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, words: str) -> None:
    file = tmp_path / "ost.yaml"
    file.write_text(OST.replace(old, new))
    with pytest.raises(CameraError, match=words):
        read_calibration(file)
    with pytest.raises(CameraError, match="cannot read the calibration"):
        read_calibration(tmp_path / "none.yaml")
