"""A page's websocket as a stranger's script may use it."""

import html as markup
import json
import re
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

from websockets.sync.client import connect

from tests.plugins.page.network import client_of, join_query
from tests.plugins.page.served import PATIENCE_S, Site


class PageSocket:
    """The websocket of a page that was served; leaves what it is sent unread but for answers.

    Args:
        site: Who serves it.
        html: The page.
        cookies: What the browser sends.
        query: What it says of the page, instead of what its script says.
    """

    def __init__(self, site: Site, html: str, cookies: str, query: str | None = None) -> None:
        self.client = client_of(html)
        self._site = site
        said = join_query(self.client) if query is None else query
        self._stack = ExitStack()
        opening = connect(
            f"ws://127.0.0.1:{site.port}/_nicegui_ws/socket.io/?EIO=4&transport=websocket&{said}",
            additional_headers={"Cookie": cookies} if cookies else {},
            open_timeout=PATIENCE_S,
            max_size=None,
        )
        self._socket = self._stack.enter_context(opening)
        self._socket.send("40")
        self.joined = self._await("40", "44").startswith("40")

    def _await(self, *beginnings: str) -> str:
        """Return the next message that begins so."""
        while True:
            message = str(self._socket.recv(PATIENCE_S))
            if message == "2":
                self._socket.send("3")
            if message.startswith(beginnings):
                return message

    def say(self, event: str, *said: Any) -> None:
        """Send an event as NiceGUI's script does."""
        self._socket.send("42" + json.dumps([event, *said]))

    def say_raw(self, text: str | bytes) -> None:
        """Send anything."""
        self._socket.send(text)

    def answered(self, event: str, *said: Any) -> Any:
        """Send an event, and wait until the server has come to it; return its answer."""
        self._socket.send("421" + json.dumps([event, *said]))
        return json.loads(self._await("431")[3:])

    def read_on(self) -> None:
        """Read, and answer pings, until the connection ends or nothing has come for long."""
        self._await("41")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._stack.close()


def events_of(html: str) -> dict[str, list[tuple[int, str]]]:
    """Return what a page listens to: for each kind of event, its elements and listeners."""
    found: dict[str, list[tuple[int, str]]] = {}
    for element, facts in elements_of(html).items():
        for event in facts.get("events", ()):
            found.setdefault(event["type"], []).append((int(element), event["listener_id"]))
    return found


def elements_of(html: str) -> dict[str, Any]:
    """Return the elements of a page as they are served."""
    found = re.search(r"parseElements\(String\.raw`(.*?)`", html, re.DOTALL)
    assert found
    return dict(json.loads(markup.unescape(found.group(1))))
