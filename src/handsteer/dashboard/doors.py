"""How many connections the page's server keeps, so that a crowd of strangers leaves room for who stops the robot.

A connection is known once a request on it has shown a session (:mod:`handsteer.dashboard.access`). The others are
few: where one more comes, the oldest that does nothing has to go. So whoever looks at a page already keeps it, and may
load it anew, whatever strangers do.
"""

import asyncio
import ipaddress
import ssl
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, cast

from nicegui import Client
from uvicorn.protocols.http.auto import AutoHTTPProtocol

MOST_STRANGERS: Final = 128
MOST_OF_ONE_ADDRESS: Final = 32
"""A browser opens six connections until it has its session."""

MOST_KNOWN: Final = 256
"""Beyond these, who shows a session is a stranger as well."""

FIRST_REQUEST_S: Final = 5.0
"""A connection on which there is no whole request within so many seconds is closed."""


@dataclass(eq=False)
class Connection:
    """One that is open.

    Attributes:
        transport: Carries it.
        address: Who it is from: an address, of IPv6 the network.
        heard: Whether there was a whole request on it.
        is_known: Whether one of them has shown a session.
        served: How many requests are being answered.
    """

    transport: asyncio.Transport
    address: str
    heard: bool = False
    is_known: bool = False
    served: int = 0


class Doors:
    """Lets connections in; all of it runs on the server's thread.

    Args:
        certificate: Makes the connections secure; None for plain ones.
        first_request_s: How long a connection may say nothing.
    """

    def __init__(self, certificate: ssl.SSLContext | None = None, first_request_s: float = FIRST_REQUEST_S) -> None:
        self._certificate = certificate
        self._first_request_s = first_request_s
        self._open: dict[object, Connection] = {}  # by the address and port of the other end, in order of their coming

    @property
    def is_secure(self) -> bool:
        """Whether the connections are secure; only asyncio's own loop can serve them then."""
        return self._certificate is not None

    def protocol(self, **uvicorns: Any) -> asyncio.Protocol:
        """Return what serves a new connection; takes what uvicorn gives to its own protocols."""
        return _Lobby(self, lambda: AutoHTTPProtocol(**uvicorns), self._certificate)

    def enter(self, transport: asyncio.Transport) -> None:
        """Take in a connection; one of too many strangers has to go for it."""
        peer = _peer(transport)
        self._open = {key: each for key, each in self._open.items() if not each.transport.is_closing()}
        newcomer = Connection(transport, _network(peer[0]))
        strangers = [each for each in self._open.values() if not each.is_known]
        for crowd, most in (
            ([each for each in strangers if each.address == newcomer.address], MOST_OF_ONE_ADDRESS),
            (strangers, MOST_STRANGERS),
        ):
            present = [each for each in crowd if not each.transport.is_closing()]
            if len(present) >= most:
                min(present, key=_is_busy).transport.abort()  # of those that are alike, the first is the oldest
        self._open[peer] = newcomer
        asyncio.get_running_loop().call_later(self._first_request_s, _close_if_silent, newcomer)

    @contextmanager
    def serving(self, peer: Sequence[object] | None, *, is_known: bool) -> Iterator[None]:
        """Note that a request of ``peer``, as ASGI calls it, is being answered, and whether it showed a session."""
        connection = self._open.get(tuple(peer)) if peer is not None else None
        if connection is None:
            yield
            return
        connection.heard = True
        if is_known and sum(each.is_known for each in self._open.values()) < MOST_KNOWN:
            connection.is_known = True
        connection.served += 1
        try:
            yield
        finally:
            connection.served -= 1


class _Lobby(asyncio.Protocol):
    """Hands a connection over to uvicorn's protocol; a secure one after the handshake, which has to come soon."""

    def __init__(
        self, doors: Doors, protocol: Callable[[], asyncio.Protocol], certificate: ssl.SSLContext | None
    ) -> None:
        self._doors = doors
        self._protocol = protocol
        self._certificate = certificate
        self._task: asyncio.Task[None] | None = None
        self._early: list[bytes] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        stream = cast(asyncio.Transport, transport)  # uvloop's is none by its type
        self._doors.enter(stream)
        if self._certificate is None:
            self._hand_over(stream)
        else:
            stream.pause_reading()
            self._task = asyncio.create_task(self._secure(stream, self._certificate))

    def data_received(self, data: bytes) -> None:
        self._early.append(data)  # what came with the end of the handshake

    def _hand_over(self, transport: asyncio.Transport) -> None:
        protocol = self._protocol()
        transport.set_protocol(protocol)
        protocol.connection_made(transport)
        for data in self._early:
            protocol.data_received(data)

    async def _secure(self, transport: asyncio.Transport, certificate: ssl.SSLContext) -> None:
        loop = asyncio.get_running_loop()
        try:
            secure = await loop.start_tls(
                transport, self, certificate, server_side=True, ssl_handshake_timeout=FIRST_REQUEST_S
            )
            if secure is not None and not secure.is_closing():
                self._hand_over(secure)
        except (OSError, TimeoutError):  # ssl's own errors are of this kind, too
            transport.abort()


def _is_busy(connection: Connection) -> bool:
    return connection.served > 0


def _close_if_silent(connection: Connection) -> None:
    if not connection.heard:
        connection.transport.abort()


def _peer(transport: asyncio.Transport) -> tuple[str, int]:
    address = transport.get_extra_info("peername")
    return (str(address[0]), int(address[1])) if isinstance(address, tuple) else ("", id(transport))


def _network(host: str) -> str:
    """Return the address ``host``; of IPv6, where everybody has many, the network of 64 bits."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    return host if address.version == 4 else str(ipaddress.ip_network((address, 64), strict=False))


MOST_UNJOINED: Final = 64
"""Each takes half a megabyte or more, and NiceGUI keeps it for a minute."""


class Unjoined:
    """Deletes the oldest page that nobody has joined when there are too many; runs on the server's thread.

    A browser whose page is gone before it joins loads it anew by itself. Without this, whatever fetches pages and runs
    no script, or has no cookies, fills the memory.

    Args:
        most: How many are kept.
    """

    def __init__(self, most: int = MOST_UNJOINED) -> None:
        self._most = most
        self._pages: dict[str, Client] = {}  # in the order in which they were served

    def add(self, page: Client) -> None:
        """Take a page that is being served."""
        self._pages[page.id] = page
        page.on_connect(lambda: self._forget(page.id))
        page.on_delete(lambda: self._forget(page.id))
        if len(self._pages) > self._most:
            next(iter(self._pages.values())).delete()

    def _forget(self, page: str) -> None:
        self._pages.pop(page, None)
