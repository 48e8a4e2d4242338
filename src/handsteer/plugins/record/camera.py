"""Plays the pictures of a recording as a camera."""

import itertools
import logging
import math
import statistics
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras import EndOfStream, Frame
from handsteer.cameras.files import AtEnd
from handsteer.clock import Clock, SteppedClock
from handsteer.errors import CameraUnreadable, FrameError, RecordingError
from handsteer.images import bgr_image, jpeg_picture
from handsteer.messages import IMAGE_COMPRESSED, IMAGE_RAW, CompressedImage, Image, type_name
from handsteer.picture_files import is_jpeg
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.recorded import Recorded

_DEFAULT_PERIOD_S = 1 / 30
_SHORTEST_PERIOD_S, _LONGEST_PERIOD_S = 1 / 240, 1.0
_TIMED = 60
_LOOKED_AT = 5000
_JPEG, _RAW = type_name(CompressedImage), type_name(Image)

log = logging.getLogger(__name__)


class RecordingCamera:
    """A :class:`~handsteer.cameras.Camera` that plays the pictures of a recording, at their median rate.

    It plays ``/image_raw/compressed`` or ``/image_raw`` if the recording has them, else the first topic with pictures.

    Args:
        path: The recording: an MCAP file, or a bag of ROS 1 or 2.
        clock: Stamps the frames.
        at_end: What happens after the last frame.

    Attributes:
        name: The path.
        period_s: Time between two frames.

    Raises:
        CameraUnreadable: It cannot be read, or contains no pictures.
    """

    def __init__(self, path: Path, clock: Clock, at_end: AtEnd = "loop") -> None:
        self.name = str(path)
        self._clock = clock
        self._at_end = at_end
        try:
            self._recording = open_recording(path)
        except RecordingError as error:
            raise CameraUnreadable(str(error)) from None
        self._topic = self._find_topic()
        times_s = [recorded.time_s for recorded in itertools.islice(self.pictures(), _TIMED)]
        gaps_s = [after - before for before, after in itertools.pairwise(times_s) if after > before]
        period_s = statistics.median(gaps_s) if gaps_s else _DEFAULT_PERIOD_S
        self.period_s = min(max(period_s, _SHORTEST_PERIOD_S), _LONGEST_PERIOD_S)
        self._frames = self.pictures()

    def read(self) -> Frame | None:
        """Return the next frame; None after the last one if the end holds, and for a damaged one.

        Raises:
            EndOfStream: After the last frame, if it ends the run.
        """
        recorded = next(self._frames, None)
        if recorded is None and self._at_end == "loop":
            self._frames = self.pictures()
            recorded = next(self._frames, None)
        if recorded is None:
            if self._at_end == "end":
                raise EndOfStream
            return None
        try:
            return Frame(picture_of(recorded), self._clock.now(), _jpeg_of(recorded.message))
        except (FrameError, RecordingError):
            return None

    def close(self) -> None:
        """Stop reading; may be called twice."""
        self._frames = iter(())

    @property
    def began_s(self) -> float:
        """When the recording began, in seconds since the epoch of its stamps."""
        return self._recording.began_s

    def pictures(self) -> Iterator[Recorded]:
        """Yield the messages with pictures, from the first one on."""
        return self._recording.messages({self._topic})

    def _find_topic(self) -> str:
        # A bag may begin with anything, but a camera publishes many times a second.
        first = itertools.islice(self._recording.messages(), _LOOKED_AT)
        found = list(dict.fromkeys(recorded.topic for recorded in first if recorded.type in (_JPEG, _RAW)))
        if not found:
            why = f": {self._recording.problem}" if self._recording.problem else ""
            raise CameraUnreadable(f"{self.name} contains no pictures (sensor_msgs Image or CompressedImage){why}")
        ours = [topic for topic in (IMAGE_COMPRESSED.name, IMAGE_RAW.name) if topic in found]
        topic = (ours or found)[0]
        if len(found) > 1 and not ours:
            log.warning("%s: playing %s; it also has pictures on %s", self.name, topic, ", ".join(found[1:]))
        return topic


def recorded_frames(path: Path, begin_s: float = 0.0, end_s: float = math.inf) -> Iterator[Frame]:
    """Yield the pictures of a recording from ``begin_s`` to ``end_s``, with their times, without damaged ones.

    Times are in seconds since the recording began.

    Raises:
        CameraUnreadable: It cannot be read, or contains no pictures.
    """
    camera = RecordingCamera(path, SteppedClock(), at_end="end")
    for recorded in camera.pictures():
        time_s = recorded.time_s - camera.began_s
        if time_s > end_s:
            return
        if time_s >= begin_s:
            try:
                yield Frame(picture_of(recorded), time_s)
            except (FrameError, RecordingError):
                continue


def _jpeg_of(message: CompressedImage | Image) -> bytes | None:
    data = message.data.tobytes() if isinstance(message, CompressedImage) else b""
    return data if is_jpeg(data) else None


def picture_of(recorded: Recorded) -> NDArray[np.uint8]:
    """Return the picture in a recorded Image or CompressedImage as (height, width, 3) uint8, BGR.

    Raises:
        RecordingError: The message is damaged, or has another type.
        FrameError: The picture is damaged, or of a kind that is not supported.
    """
    message = recorded.message
    if isinstance(message, CompressedImage):
        return jpeg_picture(message)
    if isinstance(message, Image):
        return bgr_image(message)
    raise RecordingError(f"{recorded.topic} has {recorded.type}, not pictures")
