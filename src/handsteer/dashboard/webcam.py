"""Takes the frames that a browser's webcam gives, over a websocket: one at a time, the newest only."""

import asyncio
import threading

from starlette.websockets import WebSocket, WebSocketDisconnect

from handsteer.cameras.browser import ChoiceOfCameras
from handsteer.errors import FrameError

FRAMES_PER_S = 30.0
"""No browser may send more."""

NEXT = "next"
"""What the browser hears when it may send another frame: there is never more than one on its way."""

_BUSY, _NOT_A_FRAME, _NO_CAMERA_HERE = 4409, 4400, 4404


class FrameSocket:
    """The websocket by which one browser at a time gives its webcam.

    Args:
        camera: Takes the frames; None where the camera is not in this process.
    """

    def __init__(self, camera: ChoiceOfCameras | None) -> None:
        self._camera = camera
        self._in_use = threading.Lock()

    async def serve(self, socket: WebSocket) -> None:
        """Take frames until the browser leaves; close with a reason when it cannot be served."""
        await socket.accept()
        if self._camera is None:
            await socket.close(_NO_CAMERA_HERE, "the camera is not where the page is")
        elif not self._in_use.acquire(blocking=False):
            await socket.close(_BUSY, "another browser gives its camera already")
        else:
            try:
                await self._take(socket, self._camera)
            finally:
                self._camera.browser.forget()
                self._in_use.release()

    async def _take(self, socket: WebSocket, camera: ChoiceOfCameras) -> None:
        camera.choose("browser")
        loop = asyncio.get_running_loop()
        try:
            while True:
                began_s = loop.time()
                camera.browser.offer(await socket.receive_bytes())
                await asyncio.sleep(max(0.0, began_s + 1 / FRAMES_PER_S - loop.time()))
                await socket.send_text(NEXT)
        except FrameError as error:
            await socket.close(_NOT_A_FRAME, str(error))
        except (WebSocketDisconnect, KeyError):  # it has left, or sent words instead of a frame
            pass
