"""The front of the page's server: a loop of its own, which answers Stop and hands everything else to the pages' loop.

Building a page takes the pages' loop half a second or more. On this one nothing takes long, so Stop is answered at
once, with the same access rules as any other request.
"""

import asyncio
import threading
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Final, TypeVar
from urllib.parse import parse_qsl

from nicegui import Client
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from handsteer.plugins.page.access import HAD_SESSION
from handsteer.plugins.page.limits import PAGES_THREAD
from handsteer.plugins.page.socket_events import is_page_of

STOP_PATH: Final = "/stop"

_MOST_PAGES: Final = 1000
_LARGEST_PRESS: Final = 2**53
_LONGEST_QUERY: Final = 300
_STOP_TIMEOUT_S: Final = 3.0

T = TypeVar("T")


class Presses:
    """Recognises the repetitions of a press of Stop, which a page sends in two ways until it is confirmed.

    May be used on any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._last: OrderedDict[str, int] = OrderedDict()

    def __len__(self) -> int:
        """Number of pages whose last press is known."""
        return len(self._last)

    def obey(self, page: str, press: object, halt: Callable[[], object]) -> None:
        """Call ``halt`` unless this press of ``page`` has been obeyed; in any case if ``press`` is not a number."""
        is_number = isinstance(press, int) and not isinstance(press, bool) and 0 < press < _LARGEST_PRESS
        number = press if isinstance(press, int) and is_number else 0
        with self._lock:
            if number and number <= self._last.get(page, 0):
                return
        halt()
        with self._lock:
            last = self._last.pop(page, 0)
            self._last[page] = max(number, last)
            if len(self._last) > _MOST_PAGES:
                self._last.popitem(last=False)


class StopPath:
    """Answers ``POST /stop?page=PAGE&press=NUMBER`` once the robot is stopped, for a page of the browser's own session.

    The page need not exist any more on the server, which deletes one whose websocket is gone for some seconds.

    Args:
        app: Answers all other requests.
        halt: Stops the robot for a page, on any thread.
        presses: Shared with the websockets of pages.
    """

    def __init__(self, app: ASGIApp, halt: Callable[[str], None], presses: Presses) -> None:
        self._app = app
        self._halt = halt
        self._presses = presses

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer Stop, or pass the request on."""
        if scope["type"] == "http" and scope["path"] == STOP_PATH:
            await self._answer(scope)(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    def _answer(self, scope: Scope) -> Response:
        if scope["method"] != "POST":
            return Response(status_code=405, headers={"Allow": "POST"})
        query = scope.get("query_string", b"")
        sent = dict(parse_qsl(query.decode("latin-1"))) if len(query) <= _LONGEST_QUERY else {}
        page, press = sent.get("page", ""), sent.get("press", "")
        if not (is_page_of(page, scope) or _is_forgotten(page, scope)):
            return JSONResponse({"stopped": False}, 403)
        number = int(press) if press.isascii() and press.isdecimal() and len(press) <= 16 else None
        self._presses.obey(page, number, lambda: self._halt(page))
        return JSONResponse({"stopped": True}, headers={"Cache-Control": "no-store"})


def _is_forgotten(page: str, scope: Scope) -> bool:
    """Return whether ``page`` may be one that was deleted, as when its websocket is lost: it is still on a screen."""
    return bool(page) and page not in Client.instances and bool(scope.get("state", {}).get(HAD_SESSION))


class PagesLoop:
    """A loop on a thread of its own that an application runs on, called from another loop.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name=PAGES_THREAD, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; what still runs is cancelled."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(_STOP_TIMEOUT_S)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application for a connection of the calling loop."""
        here = asyncio.get_running_loop()

        async def receive_from_here() -> Message:
            return await _run_on(here, _result_of(receive))

        async def send_from_here(message: Message) -> None:
            await _run_on(here, _result_of(send, message))

        try:
            await _run_on(self._loop, _result_of(self._app, scope, receive_from_here, send_from_here))
        except asyncio.CancelledError:
            if scope["type"] != "lifespan":  # the server does not wait for the end of one that has shut down
                raise

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_forever()
        finally:
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.run_until_complete(asyncio.sleep(0))
            self._loop.close()


async def _result_of(call: Callable[..., Awaitable[T]], *arguments: Any) -> T:
    return await call(*arguments)


async def _run_on(loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, T]) -> T:
    """Wait for ``work`` on the loop of another thread; cancelled together with it.

    Raises:
        ConnectionError: That loop has ended.
    """
    try:
        future = asyncio.run_coroutine_threadsafe(work, loop)
    except RuntimeError:
        work.close()
        raise ConnectionError("the server has ended") from None
    return await asyncio.wrap_future(future)
