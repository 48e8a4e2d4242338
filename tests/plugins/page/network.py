"""What is between a browser and the page: a relay that can go silent, and viewers who never read."""

import base64
import html as markup
import json
import os
import re
import socket
import struct
import threading
from typing import Any, Self

_CHUNK = 65536
_LOOK_PERIOD_S = 0.05


class Relay:
    """A TCP relay to a port of this machine: what it carries can stop, with no word to either end.

    That is how a lost network looks: nothing arrives, nothing is closed.

    Args:
        port: Where it leads to.

    Attributes:
        port: Where it listens.
        to_browser: Bytes that came from the server.
    """

    def __init__(self, port: int) -> None:
        self._target = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(_LOOK_PERIOD_S)
        self._sockets: list[socket.socket] = []
        self._flows = threading.Event()
        self._flows.set()
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self.port: int = self._listener.getsockname()[1]
        self.to_browser = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def freeze(self) -> None:
        """Carry nothing any more, either way."""
        self._flows.clear()

    def thaw(self) -> None:
        """Carry on, with what has waited."""
        self._flows.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._listener.close()
        for each in self._sockets:
            each.close()
        self._flows.set()  # what has waited finds no way any more

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                browser, _ = self._listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            server = socket.create_connection(("127.0.0.1", self._target))
            self._sockets += [browser, server]
            for pair in ((browser, server), (server, browser)):
                pair[0].settimeout(None)
                pair[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                threading.Thread(target=self._carry, args=(*pair, pair[0] is server), daemon=True).start()

    def _carry(self, source: socket.socket, target: socket.socket, is_down: bool) -> None:
        try:
            while data := source.recv(_CHUNK):
                self._flows.wait()
                target.sendall(data)
                if is_down:
                    with self._lock:
                        self.to_browser += len(data)
            target.shutdown(socket.SHUT_WR)
        except OSError:
            pass


def deaf(port: int, path: str, headers: str = "") -> socket.socket:
    """Return a connection that has asked for ``path``, and reads nothing; little waits for it on its side."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect(("127.0.0.1", port))
    connection.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{headers}\r\n".encode())
    return connection


def cookies_of(answer: Any) -> str:
    """Return the cookies that ``answer``, of the server, gives to a browser, as it sends them back."""
    return "; ".join(cookie.partition(";")[0] for cookie in answer.headers.get_all("Set-Cookie", []))


def deaf_page(port: int, html: str, cookies: str) -> socket.socket:
    """Return the websocket of a page that was served on ``port``: it joins the page, and reads nothing.

    Args:
        port: Where it was served.
        html: What was served.
        cookies: Those that came with it.
    """
    client = client_of(html)
    query = f"EIO=4&transport=websocket&{join_query(client)}"
    key = base64.b64encode(os.urandom(16)).decode()
    upgrade = f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
    upgrade += f"Cookie: {cookies}\r\n"
    connection = deaf(port, f"/_nicegui_ws/socket.io/?{query}", upgrade)
    connection.settimeout(20.0)
    assert connection.recv(12) == b"HTTP/1.1 101"
    send_frame(connection, b"40")  # Socket.IO: connect
    for event in drawn(html):
        send_frame(connection, b"42" + json.dumps(["event", event]).encode())
    return connection


def send_frame(connection: socket.socket, text: bytes) -> None:
    """Send a text of at most 65535 bytes by a websocket, masked by zeros."""
    length = bytes((0x80 | len(text),)) if len(text) < 126 else struct.pack("!BH", 0x80 | 126, len(text))
    connection.sendall(b"\x81" + length + bytes(4) + text)


def client_of(html: str) -> str:
    """Return what the server calls the browser to which it has served ``html``."""
    found = re.search(r"client_id\W+([0-9a-f-]{36})", html)
    assert found, "the page names no client"
    return found.group(1)


def drawn(html: str) -> list[dict[str, Any]]:
    """Return what a browser says of the page ``html`` once its 3D view and its plots are there to be drawn in."""
    found = re.search(r"parseElements\(String\.raw`(.*?)`", html, re.DOTALL)
    assert found, "the page names no elements"
    elements = json.loads(markup.unescape(found.group(1)))
    return [
        {"id": int(element), "client_id": client_of(html), "listener_id": event["listener_id"], "args": ["{}"]}
        for element, facts in elements.items()
        for event in facts.get("events", ())
        if event["type"] in {"init", "begin"}
    ]


def join_query(client: str, tab: str = "tab") -> str:
    """Return the words by which a page's websocket says whose it is; a browser has another ``tab`` for each page."""
    return f"client_id={client}&tab_id={tab}&document_id=document&next_message_id=0&implicit_handshake=true"
