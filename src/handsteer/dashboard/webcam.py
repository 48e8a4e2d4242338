"""Takes the frames that a browser's webcam gives, over a websocket: one at a time, the newest only."""

import asyncio
import threading
from collections.abc import Callable

from starlette.websockets import WebSocket, WebSocketDisconnect

from handsteer.dashboard.joined import Cameras
from handsteer.dashboard.socket_events import is_page_of
from handsteer.errors import FrameError

FRAMES_PER_S = 30.0
"""No browser may send more."""

NEXT = "next"
"""What the browser hears when it may send another frame: there is never more than one on its way."""

_NOT_A_FRAME, _NOT_THE_DRIVER, _NO_CAMERA_HERE, _BUSY = 4400, 4403, 4404, 4409


class FrameSocket:
    """The websocket by which the browser of who drives gives its webcam; one at a time.

    Args:
        camera: Takes the frames; None where the camera cannot be reached from here.
        drives: Tells whether the viewer of this id has the driver's seat, which it is given if it is free.
    """

    def __init__(self, camera: Cameras | None, drives: Callable[[str], bool]) -> None:
        self._camera = camera
        self._drives = drives
        self._in_use = threading.Lock()

    async def serve(self, socket: WebSocket) -> None:
        """Take frames until the browser leaves; close with a reason when it cannot be served."""
        await socket.accept()
        viewer = socket.query_params.get("viewer", "")
        if self._camera is None:
            await socket.close(_NO_CAMERA_HERE, "the camera is not where the page is")
        elif not (is_page_of(viewer, socket.scope) and self._drives(viewer)):
            await socket.close(_NOT_THE_DRIVER, "only who drives may give a camera: ask to drive first")
        elif not self._in_use.acquire(blocking=False):
            await socket.close(_BUSY, "another browser gives its camera already")
        else:
            try:
                await self._take(socket, self._camera, viewer)
            finally:
                self._camera.browser.forget()
                self._in_use.release()

    async def _take(self, socket: WebSocket, camera: Cameras, viewer: str) -> None:
        camera.choose("browser")
        loop = asyncio.get_running_loop()
        try:
            while self._drives(viewer):
                began_s = loop.time()
                camera.browser.offer(await socket.receive_bytes())
                await asyncio.sleep(max(0.0, began_s + 1 / FRAMES_PER_S - loop.time()))
                await socket.send_text(NEXT)
            await socket.close(_NOT_THE_DRIVER, "somebody else drives now")
        except FrameError as error:
            await socket.close(_NOT_A_FRAME, str(error))
        except (WebSocketDisconnect, KeyError):  # it has left, or sent words instead of a frame
            pass
