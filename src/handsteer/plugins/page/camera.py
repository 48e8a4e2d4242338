"""The camera on the page: its pictures, those of a browser's own webcam, and the choice between them."""

import asyncio
import math
import threading
import uuid
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import suppress

import cv2
import numpy as np
from nicegui import ui
from numpy.typing import NDArray
from starlette.responses import StreamingResponse
from starlette.types import Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from handsteer.cameras import VIRTUAL_HAND
from handsteer.cameras.choice import BROWSER
from handsteer.clock import Clock
from handsteer.errors import CameraError, FrameError, HandsteerError
from handsteer.images import bgr_image, encode_jpeg
from handsteer.messages import IMAGE_ANNOTATED, Image
from handsteer.nodes.base import Node
from handsteer.plugins.page.camera_choices import CameraChoices
from handsteer.plugins.page.elements import box, sentence, switch, text
from handsteer.plugins.page.first_visit import CameraOffer, Coach
from handsteer.plugins.page.page import PICTURE_PATH, Page
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.sign_pictures import DRAWN
from handsteer.plugins.page.socket_events import is_page_of
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.viewers import OnDemandNode
from handsteer.transports.addresses import is_loopback
from handsteer.transports.base import Received, Transport
from handsteer.types import NONE, STOP

FRAMES_PER_S = 30.0
"""Maximum frame rate of a browser."""

NEXT = "next"
"""Sent to the browser to request another frame; at most one is in transit."""

_CHANGED = "changed"
"""Sent by the browser when its following frames are those of another camera of its device."""

_ANOTHER_CAMERA = 1000
_NOT_A_FRAME, _NOT_THE_DRIVER, _NO_CAMERA_HERE, _BUSY = 4400, 4403, 4404, 4409


class FrameSocket:
    """The websocket by which the driver's browser sends its webcam's frames; one at a time.

    Args:
        graph: Receives the frames; None if the camera cannot be accessed.
        drives: Returns whether the viewer with this id has the control lease; a free lease is given to it.
    """

    def __init__(self, graph: RemoteGraph | None, drives: Callable[[str], bool]) -> None:
        self._graph = graph
        self._drives = drives
        self._in_use = threading.Lock()

    async def serve(self, socket: WebSocket) -> None:
        """Receive frames until the browser leaves; close with a reason if it cannot be served."""
        await socket.accept()
        viewer = socket.query_params.get("viewer", "")
        if self._graph is None:
            await socket.close(_NO_CAMERA_HERE, "the camera is not where the page is")
        elif not (is_page_of(viewer, socket.scope) and self._drives(viewer)):
            await socket.close(_NOT_THE_DRIVER, "only the driver can share a camera: ask to drive first")
        elif not self._in_use.acquire(blocking=False):
            await socket.close(_BUSY, "another browser gives its camera already")
        else:
            try:
                await self._receive(socket, self._graph, viewer)
            finally:
                self._graph.forget_browser()
                self._in_use.release()

    async def _receive(self, socket: WebSocket, graph: RemoteGraph, viewer: str) -> None:
        loop, changed = asyncio.get_running_loop(), True
        try:
            while self._drives(viewer):
                if changed:
                    await self._begin(graph, is_far=is_far(socket.scope))
                elif graph.state.camera_source != BROWSER:
                    await socket.close(_ANOTHER_CAMERA)
                    return
                began_s = loop.time()
                message = await socket.receive()
                changed = message.get("text") == _CHANGED
                if not changed:
                    graph.offer_frame(_frame_of(message))
                    await asyncio.sleep(max(0.0, began_s + 1 / FRAMES_PER_S - loop.time()))
                    await socket.send_text(NEXT)
            await socket.close(_NOT_THE_DRIVER, "another viewer drives now")
        except CameraError:
            await socket.close(_ANOTHER_CAMERA)
        except FrameError as error:
            await socket.close(_NOT_A_FRAME, str(error))
        except WebSocketDisconnect:
            pass

    @staticmethod
    async def _begin(graph: RemoteGraph, *, is_far: bool) -> None:
        """Choose the browser's camera; a robot that the demo hand has driven somewhere starts again."""
        names = {each.source: each.name for each in graph.state.cameras}
        was_demo = names.get(graph.state.camera_source) == VIRTUAL_HAND
        await asyncio.wrap_future(graph.choose_camera(BROWSER, is_far=is_far))
        if was_demo and graph.state.world is not None:
            with suppress(HandsteerError):  # it then begins where it is
                await asyncio.wrap_future(graph.reset())


def _frame_of(message: Message) -> bytes:
    if message["type"] != "websocket.receive":
        raise WebSocketDisconnect
    frame = message.get("bytes")
    if not isinstance(frame, bytes):
        raise FrameError("text instead of a frame")
    return frame


def is_far(scope: Scope) -> bool:
    """Return whether the client of a connection is on another machine, as far as the addresses tell."""
    client, server = (scope.get(end) or ("",) for end in ("client", "server"))
    return not (is_loopback(client[0]) or client[0] == server[0])


BYTES_PER_S = 2_000_000
"""Maximum data rate to one viewer."""

_MAX_PIXELS = 640 * 480
_BEST_QUALITY, _WORST_QUALITY = 80, 40
# 60 kB leave room for 30 frames a second within BYTES_PER_S.
_TOO_LARGE, _SMALL = 60_000, 45_000

_BOUNDARY = b"frame"


class PictureNode(Node):
    """Encodes the newest picture once for all waiting viewers; drops pictures without waiting viewers."""

    def __init__(self, transport: Transport, clock: Clock) -> None:
        super().__init__("dashboard_picture", transport, clock)
        self._waiting: deque[asyncio.Future[bytes | None]] = deque()
        self._has_ended = False
        self._quality = _BEST_QUALITY
        self._not_before_s = -math.inf
        self.subscribe(IMAGE_ANNOTATED, self._on_image)

    async def next_jpeg(self) -> bytes | None:
        """Return the next picture as a JPEG file; None once the node has been stopped."""
        future: asyncio.Future[bytes | None] = asyncio.get_running_loop().create_future()
        self._waiting.append(future)
        return None if self._has_ended else await future

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
            future = self._waiting.popleft()
            with suppress(RuntimeError):  # the server has stopped
                future.get_loop().call_soon_threadsafe(_resolve, future, jpeg)


class PictureResponse(StreamingResponse):
    """Streams pictures to one viewer until it leaves; a slow reader gets fewer pictures, always the newest."""

    def __init__(self, pictures: OnDemandNode[PictureNode]) -> None:
        super().__init__(
            self._parts(),
            media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY.decode()}",
            headers={"Cache-Control": "no-store"},
        )
        self._pictures = pictures
        self._viewer = uuid.uuid4()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send pictures; return when the viewer has left or the pictures have ended."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._pictures.leave(self._viewer)

    async def _parts(self) -> AsyncIterator[bytes]:
        node = self._pictures.join(self._viewer)
        # The boundary directly follows each picture: browsers show a picture only when they see its end.
        yield b"--" + _BOUNDARY + b"\r\n"
        while node is not None and (jpeg := await node.next_jpeg()) is not None:
            header = b"Content-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg)
            yield header + jpeg + b"\r\n--" + _BOUNDARY + b"\r\n"


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


class CameraPanel:
    """The mirrored picture in its ``stage``, the recognised sign, and the choice of camera if there is a ``graph``.

    With ``settings``, these can be changed next to the picture; it ``coaches`` a new driver.
    """

    def __init__(
        self, page: Page, graph: RemoteGraph | None, *, settings: Settings | None = None, coaches: bool = False
    ) -> None:
        self._page, self._graph = page, graph
        with ui.element("section").classes("card viewer camera"):
            with box("stage") as self.stage:
                # Lazy, because otherwise the page would count as loaded only with its first picture.
                picture = ui.element("img").props('loading="lazy" alt="What the camera sees"')
                picture.props(f'src="{PICTURE_PATH}"')
                with box("veil") as self._veil:
                    self._no_picture = text("", "waiting for the first picture")
                self._caption = text("caption", "as in a mirror")
                with box("overlay"):
                    self._engaging, self._engage, self._how_to_engage = _engage_ring()
                    self._coach = Coach(page) if coaches else None
                    self._offer = CameraOffer(page, graph) if graph is not None else None
            with box("foot"):
                self._ring = box("ring").props('role="progressbar" aria-label="Confirmed" aria-valuemax="100"')
                self._sign = text("sign", "No sign")
                with box("meter"):
                    self._confidence = box("")
                self._percent = text("percent", "")
                self._hand = text("hand", "")
                self._choices = (
                    CameraChoices(page, graph, settings) if graph is not None and settings is not None else None
                )

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        # A confirmed sign stays active for a moment when it is not seen.
        shown = state.recognition.sign if state.seen == NONE else state.seen
        self._sign.set_text("No sign" if shown == NONE else shown)
        switch(self._sign, "pending", on=shown != state.recognition.sign)
        confirmed = round(100 * state.confirmed)
        self._ring.style(f"--confirmed: {confirmed}%").props(f"aria-valuenow={confirmed}")
        switch(self._ring, "whole", on=confirmed == 100)
        switch(self._engage, "hidden", on=state.engaging is None)
        self._how_to_engage.set_text("Open, close, open" if state.engages_by_gesture else "Hold an open palm")
        engaged = round(100 * (state.engaging or 0.0))
        self._engaging.style(f"--engaged: {engaged}%").props(f"aria-valuenow={engaged}")
        self._hand.set_text(f"{state.recognition.handedness} hand" if state.recognition.handedness else "No hand")
        percent = round(100 * state.recognition.confidence) if state.seen != NONE else 0
        self._percent.set_text(f"{percent} %" if percent else "")
        self._confidence.style(f"width: {percent}%")
        self._no_picture.set_text(sentence(state.no_picture))
        switch(self._veil, "off", on=not state.no_picture)
        view = "as the camera sees it" if state.sides_swapped else "as in a mirror"
        self._caption.set_text("demo hand" if state.camera == VIRTUAL_HAND else view)
        if self._choices is not None:
            self._choices.update(state)
        if self._offer is not None:
            self._offer.update()
        if self._coach is not None and (node := self._page.node):
            can_show = self._graph is None or not self._graph.lacks_browser
            self._coach.update(state, is_driver=can_show and self._page.lease(node).role == "driver")


def _engage_ring() -> tuple[ui.element, ui.element, ui.label]:
    """Create the ring that shows how far the hand has engaged; return it, what to hide with it, and the words."""
    with box("engage hidden") as element:
        ring = box("ring").props('role="progressbar" aria-label="Engaged" aria-valuemax="100"')
        with ring:
            ui.html(DRAWN[STOP][1], sanitize=False)
        words = text("", "Open, close, open")
    return ring, element, words
