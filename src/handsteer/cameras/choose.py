"""Opens the camera that a source names."""

import logging
from pathlib import Path

from handsteer.cameras.files import PHOTO_SUFFIXES, PhotoFolder, VideoFile
from handsteer.cameras.protocol import Camera
from handsteer.cameras.webcam import Webcam, is_address, is_device, webcams
from handsteer.clock import Clock
from handsteer.config import CameraConfig, VirtualHandConfig
from handsteer.errors import CameraError, CameraNotFound

log = logging.getLogger(__name__)


def open_camera(config: CameraConfig, virtual_hand: VirtualHandConfig, clock: Clock) -> Camera:
    """Return the camera that ``config.source`` names.

    ``auto`` is the first webcam that delivers a frame, else the virtual hand; the log reports which.

    Raises:
        CameraError: It cannot be used; the message suggests what to do.
    """
    source = config.source
    if source == "auto":
        return _first_webcam(config, clock) or _virtual(config, virtual_hand, clock)
    if source == "browser":
        raise CameraNotFound("the browser's camera needs the page: handsteer run --camera browser")
    if source == "virtual":
        return _virtual(config, virtual_hand, clock)
    if is_device(source) or is_address(source):
        return _webcam(source, config, clock)
    return _file(Path(source).expanduser(), config, clock)


def _first_webcam(config: CameraConfig, clock: Clock) -> Camera | None:
    for source in webcams():
        try:
            camera = _webcam(source, config, clock)
        except CameraError as error:
            log.warning("%s", error)
        else:
            log.info("using %s", camera.name)
            return camera
    log.info("no webcam delivers a picture: using the virtual hand")
    return None


def _webcam(source: str, config: CameraConfig, clock: Clock) -> Camera:
    return Webcam(source, clock, width=config.width, height=config.height, fps=config.fps)


def _virtual(config: CameraConfig, virtual_hand: VirtualHandConfig, clock: Clock) -> Camera:
    # All nodes import this module; only the process that shows the virtual hand loads what draws it.
    from handsteer.cameras.virtual import VirtualHandCamera  # noqa: PLC0415

    return VirtualHandCamera(virtual_hand, width=config.width, height=config.height, fps=config.fps, clock=clock)


def _file(path: Path, config: CameraConfig, clock: Clock) -> Camera:
    if not path.exists():
        raise CameraNotFound(
            f"there is no camera {path}: give auto, virtual, browser, a webcam's number, an address, a video file "
            "or a folder"
        )
    if path.is_dir() or path.suffix.lower() in PHOTO_SUFFIXES:
        return PhotoFolder(path, clock, photo_duration_s=config.photo_duration, fps=config.fps, at_end=config.at_end)
    return VideoFile(path, clock, config.at_end)
