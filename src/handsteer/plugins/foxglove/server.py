"""The server of topics, by the Foxglove WebSocket protocol; read-only unless clients may drive."""

import asyncio
import contextlib
import http
import itertools
import logging
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future
from socket import socket
from typing import Any, Final

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from handsteer.clock import Clock
from handsteer.config import FoxgloveConfig
from handsteer.errors import LiveError
from handsteer.messages import Topic
from handsteer.plugins.foxglove.access import Access
from handsteer.plugins.foxglove.driving import Driving
from handsteer.plugins.foxglove.feeds import Feeds, Outbox
from handsteer.plugins.foxglove.protocol import (
    LARGEST_REQUEST_BYTES,
    SUBPROTOCOLS,
    Advertise,
    ClientChannel,
    Published,
    Subscribe,
    Unadvertise,
    Unsubscribe,
    advertise,
    message_data,
    read_command,
    read_request,
    server_info,
    status,
)
from handsteer.timeouts import HOLD_TIMEOUT_S
from handsteer.transports.addresses import host_for_others, listen
from handsteer.transports.base import Transport

_MOST_CLIENTS: Final = 16
_MOST_CHANNELS: Final = 100
_REQUEST_PERIOD_S: Final = 0.01
"""A client that sends more often than this waits, so that it cannot take all of this thread."""

_SILENT_S: Final = HOLD_TIMEOUT_S + 0.05
"""After so long without a command, it has ended, also for the thread that drives."""

_AT_ONCE_S: Final = 0.001
_MOST_WAITING: Final = 5
"""A command is late if so many messages before it had waited too: a network has held them back."""

_CLOSE_TIMEOUT_S: Final = 0.3
_START_TIMEOUT_S: Final = 20.0
_STOP_TIMEOUT_S: Final = 3.0
_REFUSALS_LOGGED_EVERY_S: Final = 10.0
# Limits what the system buffers for a slow client; more would only be older messages.
_SEND_BUFFER_BYTES: Final = 256 * 1024

log = logging.getLogger(__name__)

# Whatever others send does not matter for our log.
_silent = logging.getLogger(f"{__name__}.connections")
_silent.setLevel(logging.CRITICAL)


class Client:
    """A connected program.

    Args:
        name: Its name, for viewers of the page and the audit.
        feeds: The topics.
        driving: Takes its commands; None if clients may not drive.

    Attributes:
        outbox: What waits for it.
        is_read: Whether all that has come from it is executed.
    """

    def __init__(self, name: str, feeds: Feeds, driving: Driving | None) -> None:
        self.outbox = Outbox()
        self.is_read = False
        self._name = name
        self._feeds = feeds
        self._driving = driving
        self._drives = True
        self._commanded = asyncio.Event()
        self._channels: dict[int, int] = {}
        self._own: dict[int, ClientChannel] = {}

    def obey(self, data: str | bytes, *, is_late: bool = False) -> None:
        """Execute a request; a wrong one is answered by an error status.

        Args:
            data: The request.
            is_late: Whether it has waited for many others.
        """
        try:
            request = read_request(data)
            if isinstance(request, Subscribe):
                self._subscribe(request)
            elif isinstance(request, Unsubscribe):
                for subscription in request.subscriptions:
                    self._unsubscribe(subscription)
            elif isinstance(request, Advertise):
                self._own = dict(itertools.islice((self._own | dict(request.channels)).items(), _MOST_CHANNELS))
            elif isinstance(request, Unadvertise):
                self._unadvertise(request)
            elif isinstance(request, Published):
                self._take(request, is_late=is_late)
        except LiveError as error:
            self.outbox.reply(status(str(error)))

    async def confirm_silences(self, connection: ServerConnection) -> None:
        """Whenever its commands end, find out whether it is still connected, so that this is a release.

        A network that holds back commands also holds back the answer to a ping, which comes after them.
        """
        while self._driving is not None:
            await self._commanded.wait()
            while self._commanded.is_set():
                self._commanded.clear()
                await asyncio.sleep(_SILENT_S)
            await (await connection.ping())
            while not self.is_read:
                await asyncio.sleep(_REQUEST_PERIOD_S)
            if not self._commanded.is_set():
                self._driving.note_silence(self._name)

    def leave(self) -> None:
        """End all its subscriptions, and its driving."""
        for subscription in list(self._channels):
            self._unsubscribe(subscription)
        self._unadvertise(Unadvertise(list(self._own)))

    def _take(self, published: Published, *, is_late: bool) -> None:
        if self._driving is None:
            raise LiveError("this server is read-only: to drive from here, run handsteer with --foxglove.drive true")
        channel = self._own.get(published.channel)
        if channel is None or not channel.has_commands:
            raise LiveError("only commands are taken: geometry_msgs/Twist on /cmd_vel, as JSON or CDR")
        velocity = read_command(published.content, channel.encoding)
        self._commanded.set()
        drove, self._drives = self._drives, self._driving.command(self._name, velocity, is_late=is_late)
        if drove and not self._drives:
            self.outbox.reply(status("another one drives the robot, and has been asked to hand over"))

    def _unadvertise(self, request: Unadvertise) -> None:
        ended = [channel for number in request.channels if (channel := self._own.pop(number, None)) is not None]
        if self._driving is not None and any(channel.has_commands for channel in ended):
            self._driving.leave(self._name)

    def _subscribe(self, request: Subscribe) -> None:
        for subscription, channel in request.channels.items():
            if channel not in self._feeds.channels:
                raise LiveError(f"there is no channel {channel}")
            if subscription in self._channels or channel in self._channels.values():
                raise LiveError(f"subscription {subscription} to channel {channel}: each may be used once")
            self._channels[subscription] = channel
            self._feeds.join(channel, self.outbox, subscription)

    def _unsubscribe(self, subscription: int) -> None:
        channel = self._channels.pop(subscription, None)
        if channel is not None:
            self._feeds.leave(channel, self.outbox)
            self.outbox.forget(subscription)


class LiveServer:
    """Serves topics on a thread of its own; what no client has subscribed to costs nothing.

    A client gets the newest messages of each topic that its connection can carry.

    Args:
        transport: Carries the messages.
        clock: The graph's clock.
        topics: What to offer.
        config: Address and token.
        driving: Takes the commands of clients, which all need the token then; without it, the server is read-only.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        topics: Sequence[Topic[Any]],
        config: FoxgloveConfig,
        driving: Driving | None = None,
    ) -> None:
        self._transport = transport
        self._driving = driving
        self._numbers = itertools.count(1)
        self._clock = clock
        self._topics = topics
        self._config = config
        # Watching is free for programs of this machine; a robot that moves is not.
        self._access = Access.to(config.host, "always" if driving is not None else config.token)
        self._clients: set[Client] = set()
        self._session = str(time.time_ns())
        self._logged_s = 0.0
        self._running: Future[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = Future()
        self._thread: threading.Thread | None = None

    def start(self) -> str:
        """Serve the topics and return the address, with the token if one is needed.

        Raises:
            LiveError: The address or the port cannot be used.
        """
        host, port = self._config.host, max(0, self._config.port)
        listener = listen(host, port, _SEND_BUFFER_BYTES, options=("--foxglove.host", "--foxglove"), error=LiveError)
        self._thread = threading.Thread(target=asyncio.run, args=(self._serve(listener),), name="foxglove", daemon=True)
        self._thread.start()
        self._running.result(_START_TIMEOUT_S)
        address = f"ws://{host_for_others(host)}:{listener.getsockname()[1]}"
        return f"{address}/?token={self._access.token}" if self._access.token else address

    def stop(self) -> None:
        """Disconnect all clients and end; may be called more than once."""
        if self._thread is None:
            return
        loop, end = self._running.result(_START_TIMEOUT_S)
        with contextlib.suppress(RuntimeError):  # it has ended already
            loop.call_soon_threadsafe(end.set)
        self._thread.join(_STOP_TIMEOUT_S)

    async def _serve(self, listener: socket) -> None:
        feeds, end = Feeds(self._transport, self._clock, self._topics), asyncio.Event()

        async def converse(connection: ServerConnection) -> None:
            await self._converse(connection, feeds)

        subscribing = asyncio.create_task(feeds.keep_subscribed())
        async with serve(
            converse,
            sock=listener,
            process_request=self._check,
            subprotocols=[Subprotocol(name) for name in SUBPROTOCOLS],
            compression=None,  # pictures are compressed already
            max_size=LARGEST_REQUEST_BYTES,
            max_queue=4,
            close_timeout=_CLOSE_TIMEOUT_S,
            logger=_silent,
            server_header=None,
        ):
            self._running.set_result((asyncio.get_running_loop(), end))
            await end.wait()
        subscribing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await subscribing

    def _check(self, connection: ServerConnection, request: Request) -> Response | None:
        headers = {name: request.headers.get_all(name) for name in ("Origin", "Authorization")}
        reason = self._access.refusal(request.path, {name: values[0] for name, values in headers.items() if values})
        if reason is not None:
            self._log_refusal(reason)
            return connection.respond(http.HTTPStatus.UNAUTHORIZED, f"{reason}\n")
        if len(self._clients) >= _MOST_CLIENTS:
            return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, f"{_MOST_CLIENTS} programs are connected\n")
        return None

    def _log_refusal(self, reason: str) -> None:
        now_s = time.monotonic()
        if now_s - self._logged_s >= _REFUSALS_LOGGED_EVERY_S:
            self._logged_s = now_s
            log.warning("refused a program that asked for the topics: %s", reason)

    async def _converse(self, connection: ServerConnection, feeds: Feeds) -> None:
        client = Client(f"Foxglove {next(self._numbers)}", feeds, self._driving)
        self._clients.add(client)
        client.outbox.reply(server_info(self._session, takes_commands=self._driving is not None))
        client.outbox.reply(advertise(feeds.channels))
        tasks = [
            asyncio.create_task(_send(connection, client.outbox)),
            asyncio.create_task(_confirm(client, connection)),
        ]
        try:
            waiting = 0
            while True:
                asked_s = time.monotonic()
                client.is_read = True
                data = await connection.recv()
                client.is_read = False
                waiting = waiting + 1 if time.monotonic() - asked_s < _AT_ONCE_S else 0
                client.obey(data, is_late=waiting > _MOST_WAITING)
                await asyncio.sleep(_REQUEST_PERIOD_S)
        except ConnectionClosed:
            pass
        finally:
            for task in tasks:
                task.cancel()
            client.leave()
            self._clients.discard(client)


async def _confirm(client: Client, connection: ServerConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        await client.confirm_silences(connection)


async def _send(connection: ServerConnection, outbox: Outbox) -> None:
    """Send what waits for a client, as fast as it reads, until the connection is closed."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            what = await outbox.take()
            if isinstance(what, str):
                await connection.send(what)
                continue
            subscription, message = what
            try:
                raw = message.raw
            except Exception as error:
                log.warning("a message cannot be sent to Foxglove: %s", error)
                continue
            await connection.send(message_data(subscription, message.time_ns, raw))
