"""A webcam, or any address that OpenCV can open."""

import os
import platform
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import cv2

from handsteer.cameras import Frame
from handsteer.clock import Clock
from handsteer.errors import (
    CameraError,
    CameraInUse,
    CameraLost,
    CameraNotFound,
    CameraUnreadable,
    without_passwords,
)
from handsteer.picture_files import MOST_PIXELS

_OPEN_TIMEOUT_MS = 5000
_READ_TIMEOUT_MS = 2000
_FIRST_FRAME_TRIES = 10

_DEVICES = Path("/dev")
# From linux/videodev2.h: VIDIOC_QUERYCAP, and the fields capabilities and device_caps of its struct.
_QUERY_CAPABILITY = 0x80685600
_CAPABILITY_BYTES = 104
_CAPABILITIES = struct.Struct("=84xII")
# V4L2_CAP_VIDEO_CAPTURE or _MPLANE; V4L2_CAP_DEVICE_CAPS
_CAPTURES, _HAS_OWN = 0x1001, 0x80000000


class Capture(Protocol):
    """The part of ``cv2.VideoCapture`` in use."""

    def isOpened(self) -> bool: ...  # noqa: D102, N802 - OpenCV's name
    def read(self) -> tuple[bool, Any]: ...  # noqa: D102
    def get(self, prop: int) -> float: ...  # noqa: D102
    def set(self, prop: int, value: float) -> bool: ...  # noqa: D102
    def release(self) -> None: ...  # noqa: D102


class Webcam:
    """A :class:`~handsteer.cameras.Camera` that waits for its device.

    A device that stops is closed; each further :meth:`read` tries once to open it again.

    Args:
        source: Index (``0``), device (``/dev/video0``) or address (``rtsp://…``, ``http://…``).
        clock: Stamps the frames.
        width: Requested width in pixels; the device may deliver another.
        height: Requested height in pixels.
        fps: Requested frames per second.
        open_capture: Opens the device; tests inject faults here.

    Raises:
        CameraNotFound: There is no such device, or the address does not respond.
        CameraInUse: Another program uses the device.
        CameraUnreadable: The device opens, but delivers no picture, or larger ones than any camera should.
    """

    period_s = None

    def __init__(
        self,
        source: str,
        clock: Clock,
        *,
        width: int = 640,
        height: int = 480,
        fps: float = 30.0,
        open_capture: Callable[[str], Capture] | None = None,
    ) -> None:
        self.name = name_of(source)
        self.source = source
        self._clock = clock
        self._settings = {
            cv2.CAP_PROP_FRAME_WIDTH: width,
            cv2.CAP_PROP_FRAME_HEIGHT: height,
            cv2.CAP_PROP_FPS: fps,
            # One buffer: a frame that waited in a queue is stale.
            cv2.CAP_PROP_BUFFERSIZE: 1,
        }
        self._open_capture = open_capture or _open_capture
        self._capture: Capture | None = None
        self._first: Frame | None = None
        self._first = self._open()

    def read(self) -> Frame | None:
        """Wait for the next frame and return it.

        Raises:
            CameraLost: The device delivers no frames.
        """
        if self._first is not None:
            first, self._first = self._first, None
            return first
        if self._capture is None:
            try:
                return self._open()
            except CameraError as error:
                raise CameraLost(str(error)) from None
        try:
            frame = self._grab()
        except CameraUnreadable as error:
            raise CameraLost(str(error)) from None
        if frame is None:
            self.close()
            raise CameraLost(f"{self.name} gives no more frames: is it still plugged in?")
        return frame

    def close(self) -> None:
        """Release the device; may be called twice."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _open(self) -> Frame:
        if self._open_capture is _open_capture:
            _check_device(self.source)
        capture = self._open_capture(self.source)
        if not capture.isOpened():
            capture.release()
            raise _why_closed(self.source)
        for prop, value in self._settings.items():
            capture.set(prop, value)
        self._capture = capture
        self._check_size(round(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), round(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
        for _ in range(_FIRST_FRAME_TRIES):  # some webcams deliver empty frames while they warm up
            frame = self._grab()
            if frame is not None:
                return frame
            time.sleep(0.02)
        self.close()
        raise _why_closed(self.source)

    def _grab(self) -> Frame | None:
        assert self._capture is not None
        try:
            done, image = self._capture.read()
        except cv2.error:
            return None
        if not done or image is None or not image.size:
            return None
        self._check_size(image.shape[1], image.shape[0])  # a network stream may change its size
        return Frame(image, self._clock.now())

    def _check_size(self, width: int, height: int) -> None:
        if width * height > MOST_PIXELS:
            self.close()
            raise CameraUnreadable(
                f"{self.name} gives pictures of {width}x{height}: they should have at most {MOST_PIXELS} pixels; "
                "configure smaller ones"
            )


def is_address(source: str) -> bool:
    """Return whether ``source`` is a network address such as ``rtsp://…``."""
    return "://" in source


def is_device(source: str) -> bool:
    """Return whether ``source`` names a webcam: an index or a device file."""
    return source.isdigit() or source.startswith("/dev/")


def webcams() -> list[str]:
    """Return the webcams that this machine seems to have, as sources; on other systems than Linux, the first two."""
    devices = sorted(_DEVICES.glob("video*"), key=lambda path: (len(path.name), path.name))
    if devices or platform.system() == "Linux":
        return [str(path) for path in devices if _may_capture(path)]
    return ["0", "1"]


def captures(capability: bytes) -> bool:
    """Return whether a ``struct v4l2_capability`` is of a device that captures pictures."""
    of_driver, of_device = _CAPABILITIES.unpack_from(capability)
    return bool((of_device if of_driver & _HAS_OWN else of_driver) & _CAPTURES)


def _may_capture(device: Path) -> bool:
    """Return False for the second device file of many webcams, which delivers only metadata."""
    try:
        import fcntl  # noqa: PLC0415 - not on Windows

        file = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        try:
            return captures(fcntl.ioctl(file, _QUERY_CAPABILITY, bytes(_CAPABILITY_BYTES)))
        finally:
            os.close(file)
    except (OSError, ImportError):
        return True  # opening it as a camera fails with the reason


def _open_capture(source: str) -> Capture:
    if is_address(source):
        timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_TIMEOUT_MS]
        return cv2.VideoCapture(source, cv2.CAP_FFMPEG, timeouts)
    return cv2.VideoCapture(int(source)) if source.isdigit() else cv2.VideoCapture(source)


def name_of(source: str) -> str:
    """Return the name for people of the webcam or address ``source``, without a password or a query."""
    return f"webcam {source}" if source.isdigit() else without_passwords(source).partition("?")[0]


def device_path(source: str) -> Path:
    """Return the device file of a webcam on Linux."""
    return Path(f"/dev/video{source}") if source.isdigit() else Path(source)


def _check_device(source: str) -> None:
    """Check a device before OpenCV opens it, because OpenCV reports only success or failure."""
    if is_address(source) or platform.system() != "Linux":
        return
    path = device_path(source)
    if not path.exists():
        found = ", ".join(webcams())
        there = f"there is {found}" if found else "this machine has no webcam; the camera 'virtual' needs none"
        raise CameraNotFound(f"there is no webcam {path}: {there}")
    if not os.access(path, os.R_OK | os.W_OK):
        raise CameraUnreadable(f"no permission to use {path}: add yourself to the group 'video' and log in again")


def _why_closed(source: str) -> CameraError:
    if is_address(source):
        return CameraNotFound(f"no picture comes from {name_of(source)}: check the address, and that the camera is on")
    path = device_path(source)
    holder = _holder(path)
    if holder:
        return CameraInUse(f"{path} is in use by {holder}: close that program, or choose another camera")
    return CameraUnreadable(f"{path} gives no picture: unplug it and plug it in again, or choose another camera")


def _holder(device: Path) -> str | None:
    """Return the name of another program that has ``device`` open, where the system provides it (Linux)."""
    for link in Path("/proc").glob("[0-9]*/fd/*"):
        process = link.parent.parent
        try:
            if process.name != str(os.getpid()) and link.readlink() == device:
                return f"{(process / 'comm').read_text().strip()} (process {process.name})"
        except OSError:
            continue  # the process has ended, or belongs to another user
    return None
