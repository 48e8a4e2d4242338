"""The camera of whoever looks at the page: its browser sends the frames."""

import math
import struct
import threading
import time
from typing import Literal

from handsteer.cameras.protocol import Camera, Frame
from handsteer.clock import Clock
from handsteer.errors import FrameError
from handsteer.picture_files import decode, size_of

Source = Literal["own", "browser"]

LARGEST_BYTES = 1_000_000
"""Of one frame as it is sent."""

_MOST_PIXELS = 1920 * 1080
_HEADER = struct.Struct("<d")
_WAIT_S = 0.2
# How much later the quickest frame is taken to have been, in seconds a second: clocks of two machines drift apart.
_LEAK = 0.001


class BrowserCamera:
    """Keeps the newest frame that a browser has sent.

    A frame is :data:`HEADER_BYTES` with the browser's own time of its capture, in milliseconds as a little-endian
    64-bit number, and a JPEG file. The two clocks have nothing in common. The frame that was quickest tells how
    they differ, but for that way; a frame that was held up on its way is older by as much as it took longer.

    Args:
        clock: The graph's clock.
    """

    name = "browser's camera"

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._news = threading.Condition()
        self._newest: tuple[bytes, float] | None = None
        self._offset_s = math.inf
        self._heard_s = math.inf

    def offer(self, data: bytes) -> None:
        """Take a frame as it was sent; an older one that nobody has read is dropped.

        Raises:
            FrameError: It is no such frame, or too large.
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
        """Whether a browser has sent frames, and has not been forgotten since."""
        return math.isfinite(self._heard_s)

    def forget(self) -> None:
        """Drop the newest frame, and what is known of the browser's clock: another browser may follow."""
        with self._news:
            self._newest = None
            self._offset_s = self._heard_s = math.inf

    def read(self, wait_s: float = _WAIT_S) -> Frame | None:
        """Return the newest frame, or None when none comes within ``wait_s`` seconds."""
        with self._news:
            self._news.wait_for(lambda: self._newest is not None, wait_s)
            newest, self._newest = self._newest, None
        if newest is None:
            return None
        try:
            return Frame(decode(newest[0], _MOST_PIXELS), newest[1])
        except FrameError:  # damaged within
            return None


class NoCamera:
    """A :class:`~handsteer.cameras.protocol.Camera` without frames, for a machine that has only the browser's."""

    name = "no camera"
    period_s = None

    def read(self) -> Frame | None:
        """Return None, after a while."""
        time.sleep(_WAIT_S)
        return None

    def close(self) -> None:
        """Do nothing."""


class ChoiceOfCameras:
    """A :class:`~handsteer.cameras.protocol.Camera`: this machine's own, or the browser's while that is chosen.

    A browser that leaves does not give the robot back to the machine's own camera, before which anything may happen:
    there are no frames until somebody chooses again.

    Args:
        own: The machine's own camera; a device is closed while the browser's is chosen, or it would keep old frames.
        browser: The other one.
        source: Which one is chosen first.
    """

    def __init__(self, own: Camera, browser: BrowserCamera, source: Source = "own") -> None:
        self._own = own
        self._source = source
        self._own_is_open = True
        self.browser = browser

    @property
    def source(self) -> Source:
        """Which one is chosen."""
        return self._source

    @property
    def name(self) -> str:
        """Name of the one that is chosen."""
        return self.browser.name if self._source == "browser" else self._own.name

    @property
    def period_s(self) -> float | None:
        """The pace of the machine's own camera."""
        return self._own.period_s

    def choose(self, source: Source) -> None:
        """Read from ``source`` from now on; may be called from any thread."""
        self.browser.forget()
        self._source = source

    def read(self) -> Frame | None:
        """Return the newest frame of the one that is chosen, or None when there is none now.

        Raises:
            CameraLost: The machine's own stopped giving frames.
            EndOfStream: Its file has ended and shall end the run.
        """
        if self._source == "own":
            self._own_is_open = True
            return self._own.read()
        if self._own.period_s is not None:
            return self.browser.read(0.0)  # a paced reader must not be kept waiting, or it would fall behind its beat
        if self._own_is_open:
            self._own.close()
            self._own_is_open = False
        return self.browser.read()

    def close(self) -> None:
        """Release the devices; may be called twice."""
        self._own.close()


HEADER_BYTES = _HEADER.size


def check_frame(data: bytes) -> float:
    """Return when a frame was captured, in seconds of the browser's clock."""
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
