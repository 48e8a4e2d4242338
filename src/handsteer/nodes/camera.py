"""The node ``my_camera``, which publishes frames and recovers from failures of the camera."""

import logging
from dataclasses import replace

from handsteer.cameras import Camera, EndOfStream, Frame
from handsteer.cameras.choose import uncalibrated
from handsteer.cameras.freshness import Freshness
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import PLUGIN_FAILURES, CameraError, CameraLost
from handsteer.images import camera_jpeg_message, image_message, jpeg_message
from handsteer.messages import (
    CAMERA_INFO,
    IMAGE_COMPRESSED,
    IMAGE_RAW,
    CameraInfo,
    CompressedImage,
    Header,
    Image,
    Topic,
)
from handsteer.nodes.base import Node
from handsteer.nodes.status import CameraStatus
from handsteer.nodes.supervision import StopKeeper
from handsteer.timeouts import STALE_S
from handsteer.transports.base import Transport

_DIAGNOSE_PERIOD_S = 0.5
_SILENT_AFTER_S = 1.0
_NO_FRAME_S = 0.005
"""Pause after a camera that sets the pace has returned no frame: it may return at once."""

_FIRST_RETRY_S = 0.5
_LONGEST_RETRY_S = 8.0
_COMPARED_ROWS = 30
"""Enough to report a frozen camera; it is the recognition that keeps old pictures from moving a robot."""

log = logging.getLogger(__name__)


class CameraNode(Node):
    """Publishes each frame of a camera with its capture time, and reopens a camera that is lost.

    A picture that equals the previous one is not published.

    Args:
        camera: Delivers the frames; it may change its name and pace.
        frame_id: Coordinate frame of the images.
        calibration: Calibration of the camera that ``camera`` is at first, for pictures of its size; None if there is
            none.
        image, compressed: Topics of the frames, and on demand of the same as JPEG.

    Attributes:
        ended: Set when a file has ended and ends the run.
        frames: Number of frames published.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        camera: Camera,
        frame_id: str = "camera_optical_frame",
        calibration: CameraInfo | None = None,
        *,
        image: Topic[Image] = IMAGE_RAW,
        compressed: Topic[CompressedImage] = IMAGE_COMPRESSED,
    ) -> None:
        super().__init__("my_camera", transport, clock)
        self.frames = 0
        self._camera = camera
        self._frame_id = frame_id
        self._calibration = calibration
        self._calibrated = camera.name
        self._fits = True
        self._retry_s = _FIRST_RETRY_S
        self._status = CameraStatus(camera.name)
        self._freshness = Freshness(_COMPARED_ROWS)
        self._last_read_s = clock.now()
        self._is_frozen = False
        StopKeeper(self)
        self._image = self.publisher(image)
        self._compressed = self.publisher(compressed)
        self._info = self.publisher(CAMERA_INFO)
        self._reading = self.every(camera.period_s or 0.0, self._read)
        self.diagnose_every(_DIAGNOSE_PERIOD_S, self._report)

    @property
    def is_paced(self) -> bool:
        """Whether frames are read at a fixed period instead of when a device has them."""
        return self._camera.period_s is not None

    def on_reconfigure(self, config: Config) -> None:
        """Read a lost camera again at once: another one may have been chosen instead."""
        if self._status.state == "lost":
            self._reading.due_s = self.clock.now()

    def on_stop(self) -> None:
        """Release the device, unless a read is in progress: OpenCV would crash. The end of the process releases it."""
        if not self.stuck:
            self._camera.close()

    def _read(self) -> None:
        if self.ended.is_set():
            return
        try:
            self._take(self._camera.read())
        except EndOfStream:
            self.ended.set()
            self._reading.delay_until(self.clock.now() + _LONGEST_RETRY_S)
        except CameraError as error:
            self._lose(error)
        except PLUGIN_FAILURES as error:
            if self._retry_s == _FIRST_RETRY_S:
                log.exception("%s has failed", self._camera.name)
            self._lose(CameraLost(f"{self._camera.name} has failed: {type(error).__name__}: {error}"))

    def _take(self, frame: Frame | None) -> None:
        self._follow_choice()
        if frame is None and not self.is_paced:
            self._reading.delay_until(self.clock.now() + _NO_FRAME_S)
        elif frame is not None and self._is_new(frame):
            self._publish(frame)

    def _follow_choice(self) -> None:
        """Keep the pace of the selected camera, and report on it."""
        self._reading.period_s = self._camera.period_s or 0.0
        if self._camera.name != self._status.camera:
            self._status = CameraStatus(self._camera.name)
            self._retry_s = _FIRST_RETRY_S
            self._last_read_s = self.clock.now()

    def _publish(self, frame: Frame) -> None:
        header = Header(stamp=self.clock.stamp(frame.captured_s), frame_id=self._frame_id)
        self._image.publish(image_message(frame.image, header), frame.captured_s)
        if self._compressed.has_subscribers:
            self._compressed.publish(_compressed(frame, header), frame.captured_s)
        if self._info.has_subscribers:
            self._info.publish(replace(self._info_for(frame), header=header), frame.captured_s)
        # Last: a plug-in's frame may not be usable.
        if self._retry_s > _FIRST_RETRY_S or self._is_frozen:
            log.warning("%s is back", self._camera.name)
        self._retry_s = _FIRST_RETRY_S
        self._is_frozen = False
        self.frames += 1
        self._status = CameraStatus(self._camera.name, "delivers")

    def _info_for(self, frame: Frame) -> CameraInfo:
        """Return the calibration, or that of an uncalibrated camera if its camera or size is not the picture's."""
        height, width = frame.image.shape[:2]
        known = self._calibration if self._camera.name == self._calibrated else None
        fits = known is not None and (known.width, known.height) == (width, height)
        if known is not None and self._fits and not fits:
            log.warning(
                "the calibration is for pictures of %d x %d, and these have %d x %d: it is not used",
                *(known.width, known.height, width, height),
            )
        self._fits = known is None or fits
        return known if known is not None and fits else uncalibrated(width, height)

    def _is_new(self, frame: Frame) -> bool:
        elapsed_s, self._last_read_s = frame.captured_s - self._last_read_s, frame.captured_s
        self._freshness.why_refused(frame.image, max(0.0, elapsed_s))
        frozen_s = self._freshness.frozen_s
        if frozen_s > STALE_S:
            self._status = CameraStatus(self._camera.name, "frozen", round(frozen_s, 1))
            if not self._is_frozen:
                log.warning("%s is frozen: it delivers the same picture again and again", self._camera.name)
                self._is_frozen = True
        return frozen_s == 0.0

    def _lose(self, error: CameraError) -> None:
        log.warning("%s; trying again in %g s", error, self._retry_s)
        self._status = CameraStatus(self._camera.name, "lost", problem=str(error))
        self._reading.delay_until(self.clock.now() + self._retry_s)
        self._retry_s = min(2 * self._retry_s, _LONGEST_RETRY_S)

    def _report(self) -> CameraStatus:
        status = self._status
        silence_s = self.clock.now() - self._last_read_s
        if status.state != "lost" and silence_s > _SILENT_AFTER_S:
            status = CameraStatus(self._camera.name, "silent", round(silence_s, 1))
        return replace(status, frames=self.frames)


def _compressed(frame: Frame, header: Header) -> CompressedImage:
    if frame.jpeg is None:
        return jpeg_message(frame.image, header)
    return camera_jpeg_message(frame.jpeg, frame.image, header)
