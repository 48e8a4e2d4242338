"""The camera's pictures as the page's viewers get them: encoded once for all, and hidden from those not to see them."""

import asyncio
import math
import time
import uuid
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from handsteer.clock import Clock
from handsteer.images import bgr_image, encode_jpeg
from handsteer.messages import IMAGE_DRAWN, IMAGE_LANDMARKS, Image, Topic
from handsteer.nodes.base import Node
from handsteer.plugins.page.viewers import OnDemandNode
from handsteer.transports.base import Received, Transport

BYTES_PER_S: Final = 2_000_000
"""Maximum data rate to one viewer."""

_MAX_PIXELS = 640 * 480
_BEST_QUALITY, _WORST_QUALITY = 80, 40
# 60 kB leave room for 30 frames a second within BYTES_PER_S.
_TOO_LARGE, _SMALL = 60_000, 45_000

_BOUNDARY = b"frame"

_LOOK_PERIOD_S: Final = 0.2
_BLANK: Final = encode_jpeg(np.zeros((480, 640, 3), np.uint8), _WORST_QUALITY).tobytes()

_LATE_S: Final = 3.0
"""A busy computer may show a picture by so much after the browser has sent it."""


class PictureNode(Node):
    """Encodes the newest picture of ``topic`` once for all waiting viewers; drops pictures without waiting viewers."""

    def __init__(self, name: str, topic: Topic[Image], transport: Transport, clock: Clock) -> None:
        super().__init__(name, transport, clock)
        self._waiting: deque[asyncio.Future[bytes | None]] = deque()
        self._has_ended = False
        self._quality = _BEST_QUALITY
        self._not_before_s = -math.inf
        self.subscribe(topic, self._on_image)

    async def next_jpeg(self) -> bytes | None:
        """Return the next picture as a JPEG file; None once the node has been stopped."""
        future: asyncio.Future[bytes | None] = asyncio.get_running_loop().create_future()
        self._waiting.append(future)
        try:
            return None if self._has_ended else await future
        except asyncio.CancelledError:
            with suppress(ValueError, IndexError):  # its picture comes just now
                self._waiting.remove(future)
            raise

    def on_stop(self) -> None:
        """End the pictures of all viewers."""
        self._has_ended = True
        self._answer(None)

    def _on_image(self, received: Received[Image]) -> None:
        now = self.clock.now()
        if not self._waiting or now < self._not_before_s:
            return
        jpeg = encode_jpeg(shrink(bgr_image(received.message)), self._quality).tobytes()
        self._quality = next_quality(self._quality, len(jpeg))
        self._not_before_s = now + len(jpeg) / BYTES_PER_S
        self._answer(jpeg)

    def _answer(self, jpeg: bytes | None) -> None:
        # A deque, because the server's thread appends concurrently, also of a viewer that has this picture already.
        for _ in range(len(self._waiting)):
            # The viewer has left just now, or the server has stopped.
            with suppress(IndexError, RuntimeError):
                future = self._waiting.popleft()
                future.get_loop().call_soon_threadsafe(_resolve, future, jpeg)


class CameraPrivacy:
    """Whose browser gives its camera, and whether no other is to see its pictures.

    Args:
        now: Returns the time in seconds.

    Attributes:
        owner: Session of that browser; None while none gives its camera.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self.owner: str | None = None
        self._is_alone = False
        self._last_alone, self._until_s = "", -math.inf

    def begin(self, session: str, *, alone: bool) -> None:
        """Note that the browser of ``session`` gives its camera from now on."""
        self.owner, self._is_alone = session, alone

    def set_alone(self, *, on: bool) -> None:
        """Set whether only the browser that gives its camera sees it."""
        self._note_late()
        self._is_alone = on

    def end(self) -> None:
        """Note that it gives its camera no more; what is still on its way stays hidden."""
        self._note_late()
        self.owner, self._is_alone = None, False

    def hides_from(self, session: str) -> bool:
        """Return whether ``session`` sees drawings instead of the camera's pictures."""
        if self._is_alone and session != self.owner:
            return True
        return self._now() < self._until_s and session != self._last_alone

    def _note_late(self) -> None:
        if self._is_alone and self.owner is not None:
            self._last_alone, self._until_s = self.owner, self._now() + _LATE_S


class Pictures:
    """Serves the camera's pictures to all viewers, and a drawn hand to those that may not see them.

    Attributes:
        privacy: Knows which those are.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self.privacy = CameraPrivacy()
        self.seen = OnDemandNode(lambda: PictureNode("dashboard_picture", IMAGE_LANDMARKS, transport, clock))
        self.drawn = OnDemandNode(lambda: PictureNode("dashboard_drawing", IMAGE_DRAWN, transport, clock))

    def close(self) -> None:
        """End the pictures of all viewers permanently."""
        self.seen.close()
        self.drawn.close()


class PictureResponse(StreamingResponse):
    """Streams ``pictures`` to one viewer until it leaves; a slow reader gets fewer pictures, always the newest.

    ``session`` is that of the viewer's browser.
    """

    def __init__(self, pictures: Pictures, session: str) -> None:
        super().__init__(
            self._parts(),
            media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY.decode()}",
            headers={"Cache-Control": "no-store"},
        )
        self._pictures, self._session = pictures, session
        self._viewer = uuid.uuid4()
        self._was_hidden = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send pictures; return when the viewer has left or the pictures have ended."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._pictures.seen.leave(self._viewer)
            self._pictures.drawn.leave(self._viewer)

    async def _parts(self) -> AsyncIterator[bytes]:
        # The boundary directly follows each picture: browsers show a picture only when they see its end.
        yield b"--" + _BOUNDARY + b"\r\n"
        while (jpeg := await self._next_jpeg()) is not None:
            header = b"Content-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg)
            yield header + jpeg + b"\r\n--" + _BOUNDARY + b"\r\n"

    async def _next_jpeg(self) -> bytes | None:
        """Return the next picture that this viewer may see; None once there are no more."""
        while True:
            hidden, was_hidden = self._is_hidden(), self._was_hidden
            self._was_hidden = hidden
            if hidden and not was_hidden:
                return _BLANK  # or a viewer would see the last picture until another comes
            both = (self._pictures.drawn, self._pictures.seen)
            shown, other = both if hidden else both[::-1]
            node = shown.join(self._viewer)
            other.leave(self._viewer)
            if node is None:
                return None
            with suppress(TimeoutError):  # no new picture, but the last one may be private now
                jpeg = await asyncio.wait_for(node.next_jpeg(), _LOOK_PERIOD_S)
                if jpeg is None or hidden or not self._is_hidden():
                    return jpeg

    def _is_hidden(self) -> bool:
        return self._pictures.privacy.hides_from(self._session)


def shrink(bgr: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return ``bgr``, (height, width, 3) uint8, scaled down to at most as many pixels as 640x480."""
    height, width = bgr.shape[:2]
    scale = math.sqrt(_MAX_PIXELS / (height * width))
    if scale >= 1:
        return bgr
    size = (max(1, int(width * scale)), max(1, int(height * scale)))
    return np.asarray(cv2.resize(bgr, size, interpolation=cv2.INTER_AREA), np.uint8)


def next_quality(quality: int, size: int) -> int:
    """Return the JPEG quality (0 to 100) for the next picture after one of ``size`` bytes at ``quality``."""
    if size > _TOO_LARGE:
        return max(_WORST_QUALITY, quality - 10)
    return min(_BEST_QUALITY, quality + 1) if size < _SMALL else quality


def _resolve(future: "asyncio.Future[bytes | None]", jpeg: bytes | None) -> None:
    if not future.done():
        future.set_result(jpeg)
