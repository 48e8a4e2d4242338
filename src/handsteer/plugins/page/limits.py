"""Connections to the page's server, by https too, and limits of what clients can cost: also pages, and log lines.

So strangers cannot lock out the user who stops the robot. A connection is known once a request on it has shown a
session (:mod:`handsteer.plugins.page.access`). Few unknown connections are kept open: a new one replaces the oldest
idle one. So viewers keep their page, and can reload it, regardless of what strangers do.
"""

import asyncio
import functools
import ipaddress
import logging
import ssl
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

from nicegui import Client
from uvicorn.protocols.http.auto import AutoHTTPProtocol

from handsteer.config import DashboardConfig
from handsteer.errors import DashboardError
from handsteer.regular_files import open_regular

MOST_UNKNOWN: Final = 128
MOST_OF_ONE_ADDRESS: Final = 32
"""A browser opens six connections until it has its session."""

MOST_KNOWN: Final = 256
"""Beyond this number, connections with a session count as unknown too."""

FIRST_REQUEST_S: Final = 5.0
"""A connection without a complete request within this time is closed."""


@dataclass(eq=False)
class Connection:
    """An open connection.

    Attributes:
        transport: The connection's transport.
        address: Of the other end; for IPv6, its network.
        has_requested: Whether it has sent a complete request.
        is_known: Whether a request on it has shown a session.
        answering: Number of requests being answered.
    """

    transport: asyncio.Transport
    address: str
    has_requested: bool = False
    is_known: bool = False
    answering: int = 0

    def close_if_silent(self) -> None:
        """Close it if it has not sent a complete request."""
        if not self.has_requested:
            self.transport.abort()


class Connections:
    """Accepts and limits connections, secure ones with a ``certificate``; runs on the front's thread only."""

    def __init__(self, certificate: ssl.SSLContext | None = None) -> None:
        self._certificate = certificate
        self._open: dict[object, Connection] = {}  # by address and port of the other end, in order of arrival

    @property
    def is_secure(self) -> bool:
        """Whether connections are secure; only asyncio's own loop can serve them then."""
        return self._certificate is not None

    def protocol(self, **uvicorns: Any) -> asyncio.Protocol:
        """Return the protocol for a new connection; takes the arguments of uvicorn's own protocols."""
        return _Accepting(self, lambda: AutoHTTPProtocol(**uvicorns), self._certificate)

    def add(self, transport: asyncio.Transport) -> None:
        """Register a connection; closes another one if there are too many unknown ones."""
        peer = _peer(transport)
        self._open = {key: each for key, each in self._open.items() if not each.transport.is_closing()}
        new = Connection(transport, _network(peer[0]))
        unknown = [each for each in self._open.values() if not each.is_known]
        of_address = [each for each in unknown if each.address == new.address]
        for group, most in ((of_address, MOST_OF_ONE_ADDRESS), (unknown, MOST_UNKNOWN)):
            present = [each for each in group if not each.transport.is_closing()]
            if len(present) >= most:
                min(present, key=lambda each: each.answering > 0).transport.abort()  # the oldest of equals
        self._open[peer] = new
        asyncio.get_running_loop().call_later(FIRST_REQUEST_S, new.close_if_silent)

    @contextmanager
    def serving(self, peer: Sequence[object] | None, *, is_known: bool) -> Iterator[None]:
        """Mark a request of ``peer`` (as in ASGI) as being answered, and whether it showed a session."""
        connection = self._open.get(tuple(peer)) if peer is not None else None
        if connection is None:
            yield
            return
        connection.has_requested = True
        if is_known and sum(each.is_known for each in self._open.values()) < MOST_KNOWN:
            connection.is_known = True
        connection.answering += 1
        try:
            yield
        finally:
            connection.answering -= 1


class _Accepting(asyncio.Protocol):
    """Hands a connection over to uvicorn's protocol; a secure one after its handshake, which has a time limit."""

    def __init__(
        self, connections: Connections, protocol: Callable[[], asyncio.Protocol], certificate: ssl.SSLContext | None
    ) -> None:
        self._connections = connections
        self._protocol = protocol
        self._certificate = certificate
        self._task: asyncio.Task[None] | None = None
        self._early: list[bytes] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        stream = cast(asyncio.Transport, transport)  # uvloop's has another type
        self._connections.add(stream)
        if self._certificate is None:
            self._hand_over(stream)
        else:
            stream.pause_reading()
            self._task = asyncio.create_task(self._secure(stream, self._certificate))

    def data_received(self, data: bytes) -> None:
        self._early.append(data)  # data received together with the end of the handshake

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
        except (OSError, TimeoutError):  # includes ssl's own errors
            transport.abort()


def _peer(transport: asyncio.Transport) -> tuple[str, int]:
    address = transport.get_extra_info("peername")
    return (str(address[0]), int(address[1])) if isinstance(address, tuple) else ("", id(transport))


def _network(host: str) -> str:
    """Return the address ``host``; for IPv6, where each user has many, its 64-bit network."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    return host if address.version == 4 else str(ipaddress.ip_network((address, 64), strict=False))


MOST_UNCONNECTED_PAGES: Final = 16
"""Each takes half a megabyte or more; NiceGUI keeps it for a minute."""


class UnconnectedPages:
    """Deletes the oldest page without a websocket if there are too many; runs on the pages' thread.

    A browser whose page is deleted before its websocket connects reloads it. Without this limit, clients that fetch
    pages but run no scripts or keep no cookies would fill the memory.
    """

    def __init__(self) -> None:
        self._pages: dict[str, Client] = {}  # in the order in which they were served

    def add(self, page: Client) -> None:
        """Register a page that is being served."""
        self._pages[page.id] = page
        page.on_connect(lambda: self._remove(page.id))
        page.on_delete(lambda: self._remove(page.id))
        if len(self._pages) > MOST_UNCONNECTED_PAGES:
            next(iter(self._pages.values())).delete()

    def _remove(self, page: str) -> None:
        self._pages.pop(page, None)


LOG_PERIOD_S: Final = 10.0

_LONGEST: Final = 300
FRONT_THREAD: Final = "dashboard_front"
PAGES_THREAD: Final = "dashboard"
_THREADS: Final = frozenset({FRONT_THREAD, PAGES_THREAD})
# Loggers of the server's libraries; a filter applies to its own logger only.
_LOGGERS: Final = (
    "asyncio",
    "engineio.server",
    "handsteer.plugins.page.socket_events",
    "nicegui",
    "socketio.server",
    "uvicorn.asgi",
    "uvicorn.error",
)


class LogLimit(logging.Filter):
    """Passes one record per kind every :data:`LOG_PERIOD_S`, as one line, with the number of suppressed ones.

    An exception is reduced to its last line. With ``logging.DEBUG``, all records pass unchanged.
    """

    def __init__(self) -> None:
        super().__init__()
        self._logged: dict[tuple[object, ...], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to log ``record``; shortens it."""
        if record.threadName not in _THREADS or logging.getLogger(record.name).isEnabledFor(logging.DEBUG):
            return True
        error = record.exc_info[1] if record.exc_info else None
        kind = (record.name, record.pathname, record.lineno, record.levelno, type(error))
        logged_s, left_out = self._logged.get(kind, (-float("inf"), 0))
        now_s = time.monotonic()
        if now_s - logged_s < LOG_PERIOD_S:
            self._logged[kind] = (logged_s, left_out + 1)
            return False
        self._logged[kind] = (now_s, 0)
        _shorten(record, error, left_out)
        return True


def _shorten(record: logging.LogRecord, error: BaseException | None, left_out: int) -> None:
    words = record.getMessage()
    if error is not None:
        words = f"{words}: {type(error).__name__}: {error}"
    printable = "".join(each if each.isprintable() else " " for each in words[:_LONGEST])
    record.msg = printable + (f" (and {left_out} times before)" if left_out else "")
    record.args = ()
    record.exc_info = record.exc_text = record.stack_info = None


@functools.cache
def limit_log() -> None:
    """Shorten the logs of the server's libraries that come from the page's threads."""
    limit = LogLimit()
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(limit)


_LARGEST_PEM_BYTES: Final = 1_000_000
"""Size of a certificate's file, or of a key's; a chain of certificates has some 10 kB."""


def load_certificate(config: DashboardConfig) -> ssl.SSLContext | None:
    """Return what https needs; None without a certificate.

    Raises:
        DashboardError: The certificate or its key cannot be used, is not a regular file, or is larger than 1 MB.
    """
    if config.certificate is None:
        if config.private_key is not None:
            raise DashboardError("dashboard.private_key is of no use without dashboard.certificate: give both")
        return None
    _check_file("certificate", config.certificate)
    if config.private_key is not None:
        _check_file("private key", config.private_key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(config.certificate, config.private_key)
    except OSError as error:  # includes ssl's own errors
        reason = error.strerror or error
        raise DashboardError(f"the certificate {config.certificate} cannot be used for https: {reason}") from None
    return context


def _check_file(what: str, path: Path) -> None:
    try:
        # ssl opens files by their paths only: it would wait at a pipe for a writer, and read any size.
        open_regular(path, _LARGEST_PEM_BYTES).close()
    except OSError as error:
        raise DashboardError(f"the {what} {path} cannot be used for https: {error.strerror}") from None
