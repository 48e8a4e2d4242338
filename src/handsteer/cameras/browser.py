"""The camera of a browser that shows the page, which sends its frames."""

import math
import struct
import threading
import time

from handsteer.cameras import Frame
from handsteer.clock import Clock
from handsteer.errors import FrameError
from handsteer.picture_files import decode, size_of

LARGEST_BYTES = 1_000_000
"""Limit for one encoded frame."""

_MOST_PIXELS = 1920 * 1080
_HEADER = struct.Struct("<d")
_WAIT_S = 0.2
# Assumed clock drift between two machines, in seconds per second.
_LEAK = 0.001

HEADER_BYTES = _HEADER.size


class BrowserCamera:
    """Keeps the newest frame that a browser has sent.

    A frame is :data:`HEADER_BYTES` with its capture time on the browser's clock, in milliseconds as a little-endian
    64-bit number, and a JPEG file. The clocks are not synchronized: the frame with the shortest delay gives their
    offset, except for that delay. The age of a later frame is its additional delay.
    """

    name = "browser's camera"

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._news = threading.Condition()
        self._newest: tuple[bytes, float] | None = None
        self._offset_s = math.inf
        self._heard_s = math.inf

    def offer(self, data: bytes) -> None:
        """Store a frame in the format above; an older unread frame is dropped.

        Raises:
            FrameError: It is not such a frame, or too large.
        """
        now = self._clock.now()
        sent_s = check_frame(data)
        with self._news:
            leaked_s = _LEAK * max(0.0, now - self._heard_s)
            self._offset_s, self._heard_s = min(self._offset_s + leaked_s, now - sent_s), now
            self._newest = (data[HEADER_BYTES:], sent_s + self._offset_s)
            self._news.notify()

    @property
    def is_given(self) -> bool:
        """Whether a browser has sent frames since the last :meth:`forget`."""
        return math.isfinite(self._heard_s)

    def forget(self) -> None:
        """Drop the newest frame and the clock offset, because another browser may follow."""
        with self._news:
            self._newest = None
            self._offset_s = self._heard_s = math.inf

    def read(self, wait_s: float = _WAIT_S) -> Frame | None:
        """Return the newest frame, or None if none arrives within ``wait_s`` seconds."""
        with self._news:
            self._news.wait_for(lambda: self._newest is not None, wait_s)
            newest, self._newest = self._newest, None
        if newest is None:
            return None
        try:
            return Frame(decode(newest[0], _MOST_PIXELS), newest[1], newest[0])
        except FrameError:  # damaged image data
            return None


class NoCamera:
    """A :class:`~handsteer.cameras.Camera` without frames, for a machine without a camera of its own."""

    name = "no camera"
    period_s = None

    def read(self) -> Frame | None:
        """Return None after a short wait."""
        time.sleep(_WAIT_S)
        return None

    def close(self) -> None:
        """Do nothing."""


def check_frame(data: bytes) -> float:
    """Return the capture time of a frame, in seconds of the browser's clock."""
    if not HEADER_BYTES < len(data) <= LARGEST_BYTES:
        raise FrameError(f"a frame of {len(data)} bytes: it should have at most {LARGEST_BYTES}")
    (sent_ms,) = _HEADER.unpack_from(data)
    if not math.isfinite(sent_ms):
        raise FrameError("a frame without the time of its capture")
    kind, width, height = size_of(data[HEADER_BYTES:])
    if kind != "JPEG":
        raise FrameError("a frame that is not a JPEG picture")
    if not 0 < width * height <= _MOST_PIXELS:
        raise FrameError(f"a frame of {width}x{height}: it should have at most 1920x1080 pixels")
    return float(sent_ms) / 1000
