"""Frames from a video file or a folder of photos."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import EndOfStream, Frame
from handsteer.clock import Clock, SteppedClock
from handsteer.errors import CameraNotFound, CameraUnreadable, FrameError
from handsteer.picture_files import MOST_PIXELS, decode
from handsteer.regular_files import open_regular

log = logging.getLogger(__name__)

AtEnd = Literal["loop", "hold", "end"]
PHOTO_SUFFIXES = frozenset({".jpg", ".jpeg", ".png"})
_OTHER_PICTURES = frozenset({".webp", ".bmp", ".tif", ".tiff", ".avif", ".heic", ".heif"})
BAGS = frozenset({".bag", ".db3"})

LARGEST_PHOTO_BYTES = 100_000_000
MOST_PHOTO_PIXELS = 8192 * 8192
"""A photo from a phone with 50 megapixels may be larger than any camera's frame."""

_DEFAULT_FPS = 30.0
_HIGHEST_FPS = 240.0

_SHIFTS = 256
_TICKS_PER_S = 10_000


def is_recording(path: Path) -> bool:
    """Return whether ``path`` is named as a recording: ``.mcap``, ``.bag``, ``.db3``, or a folder with one of ROS 2."""
    return path.suffix.lower() in BAGS | {".mcap"} or (path / "metadata.yaml").is_file()


class VideoFile:
    """Plays a video file at its own frame rate.

    Args:
        clock: Stamps the frames.
        at_end: What happens after the last frame.
        noise: Whether to add sensor noise: files may repeat a picture exactly, which no camera does.

    Attributes:
        period_s: Time between two frames, from the file, or 1/30 s if it does not contain it.

    Raises:
        CameraNotFound: There is no such file.
        CameraUnreadable: It is not a video that can be decoded.
    """

    def __init__(self, path: Path, clock: Clock, at_end: AtEnd = "loop", *, noise: bool = True) -> None:
        self.name = str(path)
        self._noise = SensorNoise() if noise else None
        self._path = path
        self._clock = clock
        self._at_end = at_end
        if not path.is_file():
            raise CameraNotFound(f"there is no video file {path}")
        if path.suffix.lower() in _OTHER_PICTURES:  # OpenCV would play it as a video of one frame
            raise CameraUnreadable(f"{path} is a picture that is neither a JPEG nor a PNG file: convert it")
        try:
            path.open("rb").close()
        except OSError as error:
            raise CameraUnreadable(f"cannot read the video {path}: {error.strerror}") from None
        self._capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        width, height = (int(self._capture.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > MOST_PIXELS:
            self._capture.release()
            raise CameraUnreadable(
                f"{path} is a video of {width}x{height}: it should have at most {MOST_PIXELS} pixels"
            )
        fps = self._capture.get(cv2.CAP_PROP_FPS)
        self.period_s = 1.0 / (fps if 0 < fps <= _HIGHEST_FPS else _DEFAULT_FPS)
        self._next = self._decode()
        if self._next is None:
            raise CameraUnreadable(f"{path} is not a video that can be decoded: try an mp4, avi or webm file")

    def read(self) -> Frame | None:
        """Return the next frame; None after the last one if the end holds."""
        if self._next is None:
            if self._at_end == "end":
                raise EndOfStream
            if self._at_end == "hold":
                return None
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, 0)
            self._next = self._decode()
        image, self._next = self._next, self._decode()
        if image is None:
            return None
        captured_s = self._clock.now()
        return Frame(self._noise.on(image, captured_s) if self._noise else image, captured_s)

    def close(self) -> None:
        """Release the file; may be called twice."""
        self._capture.release()

    def _decode(self) -> NDArray[np.uint8] | None:
        done, image = self._capture.read()
        return np.asarray(image, np.uint8) if done else None


class PhotoFolder:
    """Shows one photo, or those of a folder and its subfolders sorted by name, each for a fixed time.

    Args:
        path: The folder, or a photo.
        clock: Stamps the frames.
        photo_duration_s: How long each photo is shown, in seconds.
        fps: Frames per second: a photo is repeated with sensor noise, as a camera would see it.
        at_end: What happens after the last photo.

    Raises:
        CameraNotFound: There is no such folder, or it contains no photos.
        CameraUnreadable: A photo cannot be decoded.
    """

    def __init__(
        self, path: Path, clock: Clock, *, photo_duration_s: float = 1.0, fps: float = 30.0, at_end: AtEnd = "loop"
    ) -> None:
        self.name = str(path)
        self.period_s = 1.0 / fps
        self._clock = clock
        self._at_end = at_end
        self._noise = SensorNoise()
        self._photos = find_photos(path)
        self._repeats = max(1, round(photo_duration_s * fps))
        self._shown = 0
        self._image = read_photo(self._photos[0])

    def read(self) -> Frame | None:
        """Return the next frame; None after the last one if the end holds.

        Raises:
            CameraUnreadable: The next photo cannot be decoded; reading again continues with the one after it.
        """
        index, repeat = divmod(self._shown, self._repeats)
        if index == len(self._photos):
            if self._at_end == "end":
                raise EndOfStream
            if self._at_end == "hold":
                return None
            self._shown = index = repeat = 0
        if repeat == 0:
            self._load(index)
        self._shown += 1
        captured_s = self._clock.now()
        return Frame(self._noise.on(self._image, captured_s), captured_s)

    def close(self) -> None:
        """Do nothing: no resource is held."""

    def _load(self, index: int) -> None:
        try:
            self._image = read_photo(self._photos[index])
        except CameraUnreadable:
            self._shown = (index + 1) * self._repeats
            raise


def video_frames(path: Path) -> Iterator[Frame]:
    """Yield the frames of a video as fast as they are decoded; each is stamped with its time in the video, from 0 s.

    Raises:
        CameraNotFound: There is no such file.
        CameraUnreadable: It is not a video that can be decoded.
    """
    clock = SteppedClock()
    video = VideoFile(path, clock, at_end="end", noise=False)
    try:
        while frame := video.read():
            yield frame
            clock.advance(video.period_s)
    except EndOfStream:
        return
    finally:
        video.close()


def find_photos(path: Path) -> list[Path]:
    """Return the photo ``path``, or the photos in folder ``path`` and below, sorted.

    Raises:
        CameraNotFound: There is none.
    """
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise CameraNotFound(f"there is no photo or folder {path}")
    files = sorted(path.rglob("*"))
    photos = [file for file in files if file.suffix.lower() in PHOTO_SUFFIXES]
    others = [file for file in files if file.suffix.lower() in _OTHER_PICTURES]
    if others:
        number = f"{len(others)} picture{'s' if len(others) > 1 else ''}"
        log.warning("%s, such as %s, left out: convert what is neither JPEG nor PNG", number, others[0])
    if not photos:
        raise CameraNotFound(f"there are no photos in {path}: expected files such as .jpg or .png")
    return photos


def read_photo(path: Path) -> NDArray[np.uint8]:
    """Return a photo as (height, width, 3) uint8, BGR.

    Raises:
        CameraUnreadable: The file cannot be read or decoded, is truncated, or has more than :data:`MOST_PHOTO_PIXELS`.
    """
    try:
        with open_regular(path) as file:
            data = file.read(LARGEST_PHOTO_BYTES + 1)
    except OSError as error:
        raise CameraUnreadable(f"cannot read the photo {path}: {error.strerror}") from None
    if len(data) > LARGEST_PHOTO_BYTES:
        raise CameraUnreadable(f"{path}: a photo should have at most {LARGEST_PHOTO_BYTES // 1_000_000} MB")
    try:
        return decode(data, MOST_PHOTO_PIXELS)
    except FrameError as error:
        raise CameraUnreadable(
            f"{path} is not a photo that can be decoded ({error}): try another jpg or png file"
        ) from None


class SensorNoise:
    """Adds 0 to 2 grey levels to each pixel; the noise depends on the seed and the time only."""

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed
        self._grain = np.zeros((0, 0, 3), np.uint8)

    def on(self, image: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Return a copy of ``image``, (height, width, 3) uint8, with the noise of ``time_s``; white stays white."""
        height, width = image.shape[:2]
        if self._grain.shape[:2] != (height + _SHIFTS, width + _SHIFTS):
            shape = (height + _SHIFTS, width + _SHIFTS, 3)
            self._grain = np.random.default_rng(self._seed).integers(0, 3, shape, dtype=np.uint8)
        # Each half has a place of its own in the grain, or of two thousand pictures of a photo some would be equal.
        random = np.random.default_rng(round(time_s * _TICKS_PER_S))
        noisy = np.empty_like(image)
        for rows in (slice(0, height // 2), slice(height // 2, height)):
            top, left = random.integers(0, _SHIFTS, 2)
            grain = self._grain[top : top + height, left : left + width]
            if rows.start < rows.stop:
                noisy[rows] = cv2.add(image[rows], grain[rows])
        return noisy
