"""The camera of a browser that shows the page, which sends its frames."""

import math
import struct
import threading
import time
from typing import Literal

from handsteer.cameras import Camera, Frame
from handsteer.clock import Clock
from handsteer.errors import FrameError
from handsteer.picture_files import decode, size_of

Source = Literal["own", "browser"]

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


class ChoiceOfCameras:
    """A :class:`~handsteer.cameras.Camera` that reads from this machine's camera or from the browser's.

    When a browser leaves, there is no automatic change to the machine's own camera, because anything may be in front of
    it: there are no frames until a camera is selected again.

    Args:
        own: The machine's own camera; its device is closed while the browser's is selected, or it would keep old
            frames.
        browser: The browser's camera.
        source: The initial selection.
    """

    def __init__(self, own: Camera, browser: BrowserCamera, source: Source = "own") -> None:
        self._own = own
        self._source = source
        self._own_is_open = True
        self.browser = browser

    @property
    def source(self) -> Source:
        """The selected source."""
        return self._source

    @property
    def name(self) -> str:
        """Name of the selected camera."""
        return self.browser.name if self._source == "browser" else self._own.name

    @property
    def period_s(self) -> float | None:
        """Frame period of the machine's own camera."""
        return self._own.period_s

    def choose(self, source: Source) -> None:
        """Select ``source``; may be called from any thread."""
        self.browser.forget()
        self._source = source

    def read(self) -> Frame | None:
        """Return the newest frame of the selected camera, or None if there is none now.

        Raises:
            CameraLost: The machine's own camera stopped delivering frames.
            EndOfStream: Its file has ended and ends the run.
        """
        if self._source == "own":
            self._own_is_open = True
            return self._own.read()
        if self._own.period_s is not None:
            return self.browser.read(0.0)  # waiting would delay a reader that paces itself
        if self._own_is_open:
            self._own.close()
            self._own_is_open = False
        return self.browser.read()

    def close(self) -> None:
        """Release the devices; may be called twice."""
        self._own.close()


def check_frame(data: bytes) -> float:
    """Return the capture time of a frame, in seconds of the browser's clock."""
    if not HEADER_BYTES < len(data) <= LARGEST_BYTES:
        raise FrameError(f"a frame of {len(data)} bytes: it should have at most {LARGEST_BYTES}")
    (sent_ms,) = _HEADER.unpack_from(data)
    if not math.isfinite(sent_ms):
        raise FrameError("a frame without the time of its capture")
    kind, width, height = size_of(data[HEADER_BYTES:])
    if kind != "JPEG":
        raise FrameError("a frame that is no JPEG picture")
    if not 0 < width * height <= _MOST_PIXELS:
        raise FrameError(f"a frame of {width}x{height}: it should have at most 1920x1080 pixels")
    return float(sent_ms) / 1000
