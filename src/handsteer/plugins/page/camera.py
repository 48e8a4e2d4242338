"""The camera on the page: its pictures, those of a browser's own webcam, and the choice between them."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from nicegui import ui
from starlette.types import Message, Scope
from starlette.websockets import WebSocket, WebSocketDisconnect

from handsteer.cameras import VIRTUAL_HAND
from handsteer.cameras.choice import BROWSER
from handsteer.errors import CameraError, FrameError, HandsteerError
from handsteer.plugins.page.access import session_of
from handsteer.plugins.page.camera_choices import CameraChoices
from handsteer.plugins.page.elements import box, sentence, switch, text
from handsteer.plugins.page.first_visit import BetterRule, CameraOffer, Coach
from handsteer.plugins.page.page import PICTURE_PATH, Page
from handsteer.plugins.page.pictures import CameraPrivacy
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.sign_pictures import DRAWN
from handsteer.plugins.page.socket_events import is_page_of
from handsteer.plugins.page.state import PageState
from handsteer.transports.addresses import is_loopback
from handsteer.types import NONE, STOP

FRAMES_PER_S = 30.0
"""Maximum frame rate of a browser."""

NEXT = "next"
"""Sent to the browser to request another frame; at most one is in transit."""

_CHANGED = "changed"
"""Sent by the browser when its following frames are those of another camera of its device."""

_ALONE: Final = {"alone": True, "shared": False}
"""Sent by the browser when its pictures are for itself only, and when they no longer are."""

_LOOK_S = 0.5

_ANOTHER_CAMERA = 1000
_NOT_A_FRAME, _NOT_THE_DRIVER, _NO_CAMERA_HERE, _BUSY = 4400, 4403, 4404, 4409


class FrameSocket:
    """The websocket by which the driver's browser sends its webcam's frames; one at a time.

    Args:
        graph: Receives the frames; None if the camera cannot be accessed.
        drives: Returns whether the viewer with this id has the control lease; a free lease is given to it.
        privacy: Knows who may see them.
    """

    def __init__(self, graph: RemoteGraph | None, drives: Callable[[str], bool], privacy: CameraPrivacy) -> None:
        self._graph = graph
        self._drives = drives
        self._privacy = privacy
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
                alone = socket.query_params.get("seen") == "alone"
                self._privacy.begin(session_of(socket.scope), alone=alone)
                await self._receive(socket, self._graph, viewer)
            finally:
                self._graph.forget_browser()
                self._privacy.end()
                self._in_use.release()

    async def _receive(self, socket: WebSocket, graph: RemoteGraph, viewer: str) -> None:
        loop, changed, messages = asyncio.get_running_loop(), True, _Messages(socket)
        try:
            while self._drives(viewer):
                if changed:
                    await self._begin(graph, is_far=is_far(socket.scope))
                elif graph.state.camera_source != BROWSER:
                    await socket.close(_ANOTHER_CAMERA)
                    return
                began_s = loop.time()
                message = await messages.next()
                words = message.get("text")
                changed = words == _CHANGED
                if words in _ALONE:
                    self._privacy.set_alone(on=_ALONE[words])
                elif message and not changed:
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
        finally:
            messages.close()

    @staticmethod
    async def _begin(graph: RemoteGraph, *, is_far: bool) -> None:
        """Choose the browser's camera; a robot that the demo hand has driven somewhere starts again."""
        names = {each.source: each.name for each in graph.state.cameras}
        was_demo = names.get(graph.state.camera_source) == VIRTUAL_HAND
        await asyncio.wrap_future(graph.choose_camera(BROWSER, is_far=is_far))
        if was_demo and graph.state.world is not None:
            with suppress(HandsteerError):  # it then begins where it is
                await asyncio.wrap_future(graph.reset())


class _Messages:
    """What a browser sends, waited for no longer than a look at the driver may take.

    Else a browser that gives no pictures, as on a phone that sleeps, would keep a new driver from giving theirs.
    """

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket
        self._next: asyncio.Future[Message] | None = None

    async def next(self) -> Message:
        """Return the next message; an empty one if there is none within :data:`_LOOK_S`."""
        self._next = self._next or asyncio.ensure_future(self._socket.receive())
        done, _ = await asyncio.wait([self._next], timeout=_LOOK_S)
        if not done:
            return {}
        message, self._next = self._next.result(), None
        return message

    def close(self) -> None:
        """Wait no longer."""
        if self._next is not None:
            self._next.cancel()


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
                    self._better = BetterRule(page, settings) if coaches and settings is not None else None
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
            is_driver = can_show and self._page.lease(node).role == "driver"
            self._coach.update(state, is_driver=is_driver)
            if self._better is not None:
                self._better.update(state, is_driver=is_driver)


def _engage_ring() -> tuple[ui.element, ui.element, ui.label]:
    """Create the ring that shows how far the hand has engaged; return it, what to hide with it, and the words."""
    with box("engage hidden") as element:
        ring = box("ring").props('role="progressbar" aria-label="Engaged" aria-valuemax="100"')
        with ring:
            ui.html(DRAWN[STOP][1], sanitize=False)
        words = text("", "Open, close, open")
    return ring, element, words
