"""Sources of frames: webcam, video file, folder of photos, virtual hand, browser; and their interface.

A frame carries its capture time on the graph's monotonic clock. Frames are as the camera saw them; only pictures for
people are mirrored. ``choice`` changes the camera while nodes run: it publishes ``/camera_changed`` when another camera
is chosen and before its first frame, so recognition and control forget the one before.
"""

import os
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

# OpenCV's own messages about devices and files repeat our errors in other terms. It reads these variables once.
os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


VIRTUAL_HAND: Final = "virtual hand"
"""Name of the camera that draws a hand."""


@dataclass(frozen=True)
class Frame:
    """One camera image.

    Attributes:
        image: (height, width, 3) uint8, BGR, as the camera saw it (not mirrored).
        captured_s: Capture time, in seconds of the graph's monotonic clock.
        jpeg: The JPEG file that the image was decoded from, by :func:`handsteer.picture_files.decode`; None if there
            was none.
    """

    image: NDArray[np.uint8]
    captured_s: float
    jpeg: bytes | None = None


class Camera(Protocol):
    """A source of frames.

    Attributes:
        name: Name for people: ``webcam 0``, ``virtual hand``, a path.
        period_s: Time between two frames that the reader must keep, or None if :meth:`read` itself waits for the
            device.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def period_s(self) -> float | None: ...  # noqa: D102

    def read(self) -> Frame | None:
        """Return the newest frame, or None if there is none now (a file that ended and holds).

        Raises:
            CameraLost: The device stopped delivering frames; reading again may reopen it.
            EndOfStream: A file has ended and ends the run.
        """
        ...

    def close(self) -> None:
        """Release the device; may be called twice."""
        ...


class EndOfStream(Exception):  # noqa: N818 - not an error
    """The last frame of a file has been read."""
