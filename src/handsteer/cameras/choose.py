"""Finds this machine's cameras, opens the one that a source names, and reads its calibration."""

import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from handsteer import doors, plain_yaml
from handsteer.cameras import VIRTUAL_HAND, Camera
from handsteer.cameras.choice import OWN, CameraChoice, Size
from handsteer.cameras.files import PHOTO_SUFFIXES, PhotoFolder, VideoFile, is_recording
from handsteer.cameras.webcam import Webcam, device_path, is_address, is_device, name_of, webcams
from handsteer.clock import Clock
from handsteer.config import CameraConfig, Config
from handsteer.errors import CameraError, CameraNotFound, PluginError, quoted
from handsteer.messages import NO_STAMP, CameraInfo, Header, RegionOfInterest

log = logging.getLogger(__name__)

_RECORDED = "recorded-file"
_MATRICES = {"camera_matrix": 9, "rectification_matrix": 9, "projection_matrix": 12}
_WHOLE = RegionOfInterest(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
_NO_WEBCAM = (
    "no webcam delivers a picture: connect one, or name another camera, such as an address, or browser with handsteer "
    "run. Where the robot may be real, the virtual hand, which drives without a person, has to be named too: virtual"
)


def open_camera(config: Config, clock: Clock, *, may_be_real: bool = False) -> Camera:
    """Return the camera that ``config.camera.source`` names.

    ``auto`` is the first webcam that delivers a frame, else the virtual hand; the log reports which. The virtual hand
    shows what drives, and what engages, so ``auto`` does not fall back to it if the robot ``may_be_real``.

    Raises:
        CameraError: It cannot be used; the message suggests what to do.
        PluginError: It is a plug-in that cannot be loaded.
    """
    source = config.camera.source
    if source == "auto":
        webcam = _first_webcam(config.camera, clock)
        if webcam is not None:
            return webcam
        if may_be_real:
            raise CameraNotFound(_NO_WEBCAM)
        log.info("no webcam delivers a picture: using the virtual hand")
        return doors.CAMERAS.open(_VIRTUAL.source, config, clock)
    if source == "browser":
        raise CameraNotFound("the browser's camera needs the page: handsteer run --camera browser")
    if source in doors.CAMERAS.names():
        return _plug_in(source, config, clock)
    if is_device(source) or is_address(source):
        return _webcam(source, config.camera, clock)
    path = Path(source).expanduser()
    if is_recording(path) and path.exists():
        return doors.CAMERAS.open(_RECORDED, config, clock)
    return _file(path, config.camera, clock)


def _first_webcam(config: CameraConfig, clock: Clock) -> Camera | None:
    for source in webcams():
        try:
            camera = _webcam(source, config, clock)
        except CameraError as error:
            log.warning("%s", error)
        else:
            log.info("using %s", camera.name)
            return camera
    return None


def _webcam(source: str, config: CameraConfig, clock: Clock) -> Camera:
    return Webcam(source, clock, width=config.width, height=config.height, fps=config.fps)


def _plug_in(name: str, config: Config, clock: Clock) -> Camera:
    camera = doors.CAMERAS.open(name, config, clock)
    period_s: object = camera.period_s
    if period_s is None or (isinstance(period_s, int | float) and 0 < period_s < math.inf):
        return camera
    camera.close()
    reason = f"its period_s is {period_s!r}, not a number of seconds above 0 or None"
    raise PluginError(f"{doors.CAMERAS.described(name)} cannot be used: {reason}")


def _file(path: Path, config: CameraConfig, clock: Clock) -> Camera:
    if not path.exists() or not config.source.strip():  # an empty path is the working directory
        raise CameraNotFound(
            f"there is no camera {config.source or quoted('')}: give auto, virtual, browser, a webcam's number, an "
            "address, a video file or a folder"
        )
    if path.is_dir() or path.suffix.lower() in PHOTO_SUFFIXES:
        return PhotoFolder(path, clock, photo_duration_s=config.photo_duration, fps=config.fps, at_end=config.at_end)
    return VideoFile(path, clock, config.at_end)


class MachineCameras:
    """A :class:`~handsteer.cameras.choice.Machine`: the own camera, the virtual hand, other plug-ins, and the webcams.

    Args:
        config: Names the own camera, and the resolution and rate that webcams are asked for.
        clock: Stamps the frames.
        own: The camera that ``config`` names, opened.
    """

    def __init__(self, config: Config, clock: Clock, own: Camera) -> None:
        self.size: Size = (config.camera.width, config.camera.height)
        self._config, self._clock = config, clock
        self._source = own.source if isinstance(own, Webcam) else config.camera.source
        is_webcam = is_device(self._source)
        self.own = None if config.camera.source == "browser" else CameraChoice(OWN, _shown(own.name), is_webcam)

    def find(self) -> tuple[CameraChoice, ...]:
        """Return the cameras that can be chosen now, the own one first."""
        own = () if self.own is None else (self.own,)
        virtual = () if self.own is not None and self.own.name == VIRTUAL_HAND else (_VIRTUAL,)
        added = [name for name in doors.CAMERAS.names() if name not in (_VIRTUAL.source, _RECORDED, self._source)]
        plug_ins = (CameraChoice(name, name) for name in added)
        known = device_path(self._source) if is_device(self._source) else None
        others = [source for source in webcams() if device_path(source) != known]
        found = (CameraChoice(source, name_of(source), has_sizes=True) for source in others)
        return (*own, *virtual, *plug_ins, *found)

    def open(self, source: str, size: Size) -> Camera:
        """Open the camera of a choice."""
        source = self._source if source == OWN else source
        width, height = size if is_device(source) else self.size
        of = {"source": source, "width": width, "height": height}
        camera = self._config.camera.model_copy(update=of)
        return open_camera(self._config.model_copy(update={"camera": camera}), self._clock)


_VIRTUAL = CameraChoice("virtual", VIRTUAL_HAND)


def _shown(name: str) -> str:
    """Return the name of a camera without folders, and without what an address has besides the host."""
    if is_address(name):
        return f"{urlsplit(name).scheme}://{urlsplit(name).hostname or ''}"
    return name if is_device(name) else Path(name).name


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
    header = Header(stamp=NO_STAMP, frame_id="")
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
