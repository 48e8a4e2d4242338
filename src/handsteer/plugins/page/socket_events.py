"""Validates the events of browsers on the page's websocket before NiceGUI handles them.

NiceGUI reads an event's page from the event itself. Here a websocket may only send events for a page that was served to
the same browser, and only in the format of its script.
"""

import itertools
import json
import logging
from collections.abc import Awaitable, Callable, Mapping
from inspect import isawaitable
from typing import Any, Final
from urllib.parse import parse_qs

from nicegui import Client
from socketio import AsyncServer
from socketio.exceptions import ConnectionRefusedError as Refused

from handsteer.errors import quoted
from handsteer.plugins.page.access import SESSION

Check = Callable[[Any], bool]
log = logging.getLogger(__name__)

_REFUSED: Final = "Implicit handshake failed"
"""With this message NiceGUI's script reloads the page, which gives it a session."""

_LONGEST_NAME: Final = 100
_LONGEST_LOG: Final = 300
_MOST_ARGUMENTS: Final = 20
_LONGEST_ARGUMENT: Final = 512 * 1024
"""Characters; the longest is a world file of 64 kB, some of whose characters take six in JSON."""

_DEEPEST: Final = 8
"""Nested lists and objects in an argument; the pages' own need three."""

_LEVELS: Final = ("debug", "info", "warning", "error")


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= _LONGEST_NAME


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**53


def _is_decimal(value: Any) -> bool:
    return _is_count(value) or (isinstance(value, str) and value.isdecimal() and len(value) <= 16)


def _are_arguments(values: Any) -> bool:
    return isinstance(values, list) and len(values) <= _MOST_ARGUMENTS and all(map(_is_argument, values))


def _is_argument(value: Any) -> bool:
    """Return whether it is JSON that is not too long and not too deep, so that others can copy and send it."""
    if value is None:
        return True
    if not isinstance(value, str) or len(value) > _LONGEST_ARGUMENT:
        return False
    try:
        return _is_flat(json.loads(value))
    except (ValueError, RecursionError):
        return False


def _is_flat(value: Any) -> bool:
    """Return whether lists and objects are nested :data:`_DEEPEST` deep at most."""
    level = [value]
    for _ in range(_DEEPEST + 1):
        inner = [each.values() if isinstance(each, dict) else each for each in level if isinstance(each, dict | list)]
        if not inner:
            return True
        level = list(itertools.chain.from_iterable(inner))
    return False


_HANDSHAKE: Final[dict[str, Check]] = {
    "client_id": _is_name,
    "tab_id": _is_name,
    "document_id": _is_name,
    "next_message_id": _is_decimal,
}
_SHAPES: Final[dict[str, dict[str, Check]]] = {
    "event": {"client_id": _is_name, "id": _is_count, "listener_id": _is_name, "args": _are_arguments},
    "javascript_response": {"client_id": _is_name, "request_id": _is_name},
    "ack": {"client_id": _is_name, "next_message_id": _is_count},
    "log": {
        "client_id": _is_name,
        "level": lambda level: level in _LEVELS,
        "message": lambda message: isinstance(message, str),
    },
}


class SocketEvents:
    """Replaces NiceGUI's handlers on its Socket.IO ``server`` with validating ones."""

    def __init__(self, server: AsyncServer) -> None:
        self._server = server
        self._handlers: dict[str, Callable[..., Any]] = dict(server.handlers["/"])
        self._pages: dict[str, str] = {}  # the page of each connected websocket after its handshake
        server.on("connect", self._connect)
        server.on("handshake", self._handshake)
        server.on("disconnect", self._disconnect)
        for name in _SHAPES:
            server.on(name, self._checked(name))

    async def _connect(self, socket: str, environ: dict[str, Any], _: Any = None) -> None:
        query = {name: values[0] for name, values in parse_qs(str(environ.get("QUERY_STRING", ""))).items()}
        if query.get("implicit_handshake") == "true" and not await self._shake_hands(socket, query, environ):
            raise Refused(_REFUSED)

    async def _handshake(self, socket: str, sent: Any = None, *_: Any) -> bool:
        return await self._shake_hands(socket, sent, self._server.get_environ(socket) or {})

    async def _shake_hands(self, socket: str, sent: Any, environ: dict[str, Any]) -> bool:
        if not _fits(sent, _HANDSHAKE) or not is_page_of(sent["client_id"], environ.get("asgi.scope", {})):
            _note("handshake")
            return False
        if not await self._handlers["handshake"](socket, {name: sent[name] for name in (*_HANDSHAKE,)} | _old(sent)):
            return False
        self._pages[socket] = sent["client_id"]
        return True

    def _disconnect(self, socket: str, *_: Any) -> None:
        self._pages.pop(socket, None)
        self._handlers["disconnect"](socket)

    def _checked(self, name: str) -> Callable[..., Awaitable[None]]:
        """Return the validating handler of the events ``name``."""

        async def take(socket: str, sent: Any = None, *_: Any) -> None:
            if not _fits(sent, _SHAPES[name]) or self._pages.get(socket) != sent["client_id"]:
                _note(name)
                return
            if name == "log":
                sent = {**sent, "message": f"the browser says: {quoted(sent['message'], _LONGEST_LOG)}"}
            try:
                answer = self._handlers[name](socket, sent)
                if isawaitable(answer):
                    await answer
            except Exception as error:  # NiceGUI does not validate its input
                _note(name, error)

        return take


def is_page_of(page: str, scope: Mapping[str, Any]) -> bool:
    """Return whether the request of ``scope`` comes from the browser to which ``page`` was served."""
    client = Client.instances.get(page)
    session = scope.get("state", {}).get(SESSION)
    return bool(client and session) and client.request.scope["state"].get(SESSION) == session  # type: ignore[union-attr]


def _fits(sent: Any, shape: dict[str, Check]) -> bool:
    return isinstance(sent, dict) and all(name in sent and check(sent[name]) for name, check in shape.items())


def _old(sent: dict[str, Any]) -> dict[str, Any]:
    return {"old_tab_id": sent["old_tab_id"]} if _is_name(sent.get("old_tab_id")) else {}


def _note(name: str, error: Exception | None = None) -> None:
    log.warning(
        "an event %r of a browser makes no sense, and was left out%s", name, f": {quoted(str(error))}" if error else ""
    )
