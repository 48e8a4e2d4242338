"""Connects nodes in a child process to the graph of its parent by a pipe.

The child's nodes use a :class:`PipedTransport`; a :class:`Gateway` in the parent publishes and subscribes for them on
the graph's own transport. Both use a :class:`Pipe`, which may have other users too. If one process stalls, the other
continues, keeps the newest messages for it, and drops the rest.
"""

import contextlib
import dataclasses
import enum
import functools
import importlib
import io
import itertools
import logging
import math
import pickle
import struct
import sys
import threading
import weakref
from collections import deque
from collections.abc import Callable, Collection, Hashable
from typing import IO, Any, Final, TypeVar

from pydantic import BaseModel

from handsteer.clock import monotonic
from handsteer.errors import HandsteerError, TransportError, quoted
from handsteer.messages import CompressedImage, Image, Topic
from handsteer.transports.base import Deliver, Publisher, Received, Subscription, Transport
from handsteer.transports.in_process import BasePublisher, BaseTransport, Receive

M = TypeVar("M")
log = logging.getLogger(__name__)

_KEPT = 16
"""How many messages of a topic wait for a stalled process; more than any topic's depth."""

_MOST_WAITING = 1000
"""How many undroppable messages may wait: a process that reads none of them is stuck."""

_LENGTHS = struct.Struct("<IQ")
"""Bytes of a message's kind and of its content; precede both, so that a message that cannot be read is left out."""

_LARGEST_BYTES = 1 << 28
"""Of a message; an image of the largest size has a fifth of that."""

_LOG_PERIOD_S = 10.0


_DATA: Final = (BaseModel, HandsteerError, enum.Enum, logging.LogRecord, functools.partial)
_PURE_MODULES: Final = frozenset({"handsteer.messages"})
"""Their functions change nothing."""
_BUILT_IN: Final = frozenset(
    {
        *(("builtins", name) for name in ("bytearray", "complex", "frozenset", "range", "set", "slice")),
        *(("collections", name) for name in ("OrderedDict", "deque")),
        *(("datetime", name) for name in ("date", "datetime", "timedelta", "timezone")),
        *((module, name) for module in ("pathlib", "pathlib._local") for name in ("PosixPath", "WindowsPath")),
        *((f"numpy.{core}.multiarray", name) for core in ("core", "_core") for name in ("_reconstruct", "scalar")),
        *((f"numpy.{core}.numeric", "_frombuffer") for core in ("core", "_core")),
        *(("numpy", name) for name in ("dtype", "ndarray")),
    }
)


class _DataUnpickler(pickle.Unpickler):
    """Makes objects of data only, so that the process that wrote the pickle cannot run code here."""

    def __init__(self, source: IO[bytes], pure: frozenset[str]) -> None:
        super().__init__(source)
        self._pure = pure

    def find_class(self, module: str, name: str) -> Any:
        return _data_class(module, name, self._pure)


@functools.cache
def _data_class(module: str, name: str, pure: frozenset[str]) -> Any:
    if module in pure:
        importlib.import_module(module)
    found = getattr(sys.modules.get(module), name, None)
    is_ours = module in pure and getattr(found, "__module__", "") == module
    is_data = isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, _DATA))
    if found is None or not (is_ours or is_data or (module, name) in _BUILT_IN):
        raise pickle.UnpicklingError(f"{module}.{name} is not a class of data")
    return found


class Pipe:
    """One end of a pipe to another process of this program.

    A message that cannot be sent or read is left out, and logged in one line; the next ones pass.

    Args:
        source: Written by the other process.
        sink: Read by the other process.
        trusts: Whether what the other process sends may be any object. Otherwise it has to be data: plain values,
            arrays, dataclasses, models, enumerations, errors and log records of modules that are loaded.
        pure_modules: Full names of further modules whose functions it may send, as they change nothing.

    Attributes:
        ended: Set when either end is closed, or the other process has ended.
    """

    def __init__(self, source: IO[bytes], sink: IO[bytes], *, trusts: bool, pure_modules: Collection[str] = ()) -> None:
        self._source = source
        self._sink = sink
        data = functools.partial(_DataUnpickler, pure=_PURE_MODULES.union(pure_modules))
        self._unpickler: Callable[[IO[bytes]], pickle.Unpickler] = pickle.Unpickler if trusts else data
        self._handlers: dict[str, Callable[..., object]] = {}
        self._news = threading.Condition()
        self._queues: dict[Hashable, deque[tuple[Any, ...]]] = {}
        self._order: deque[Hashable] = deque()
        self._logged_s: dict[tuple[str, str], float] = {}
        self._writer = threading.Thread(target=self._write, name="pipe_write", daemon=True)
        self.ended = threading.Event()

    def on(self, kind: str, handler: Callable[..., object]) -> None:
        """Call ``handler`` for messages of this ``kind`` from the other end, on the reading thread.

        All handlers must be added before the start.
        """
        self._handlers[kind] = handler

    def start(self) -> None:
        """Start the threads that read and write."""
        self._writer.start()
        threading.Thread(target=self._read, name="pipe_read", daemon=True).start()

    def say(self, kind: str, *what: object, key: Hashable = None, keep: int = _MOST_WAITING) -> None:
        """Send a message to the other end's handler of ``kind``, which is called with ``what``; the order is kept.

        Returns at once. For each ``key``, the newest ``keep`` messages wait while the other end does not read.

        Raises:
            TransportError: Without a key: too many messages are waiting.
        """
        with self._news:
            if self.ended.is_set():
                return
            queue = self._queues.setdefault(key, deque(maxlen=keep))
            if len(queue) < keep:
                self._order.append(key)
            elif key is None:
                raise TransportError("the other process does not answer")
            queue.append((kind, *what))
            self._news.notify()

    def close(self, timeout_s: float = 0.0) -> None:
        """Stop sending and close the pipe; may be called twice.

        Args:
            timeout_s: How long to wait for the other end to read pending messages.
        """
        with self._news:
            self.ended.set()
            self._news.notify()
        if self._writer.ident is not None:
            self._writer.join(timeout_s)

    def _read(self) -> None:
        try:
            while True:
                kind_bytes, content_bytes = _LENGTHS.unpack(self._read_whole(_LENGTHS.size))
                kind = self._read_whole(kind_bytes).decode()
                self._take(kind, self._read_whole(content_bytes))
        except (EOFError, OSError, ValueError):
            self.close()

    def _read_whole(self, size: int) -> bytes:
        if size > _LARGEST_BYTES:
            raise ValueError(f"a message of {size} bytes is too large")
        data = self._source.read(size)
        if len(data) < size:
            raise EOFError
        return data

    def _take(self, kind: str, content: bytes) -> None:
        try:
            what = self._unpickler(io.BytesIO(content)).load()
        except Exception as error:
            self._leave_out(kind, "read", error)
        else:
            self._handle(kind, what)

    def _handle(self, kind: str, what: tuple[Any, ...]) -> None:
        try:
            self._handlers[kind](*what)
        except Exception:
            log.exception("a message of another process about %s could not be handled", kind)

    def _write(self) -> None:
        try:
            while (message := self._next()) is not None:
                self._write_one(*message)
        except (OSError, ValueError):
            pass  # the other end is closed
        # Nothing can be sent any more, so the other end must be informed.
        self.ended.set()
        with contextlib.suppress(OSError):
            self._sink.close()

    def _write_one(self, kind: str, *what: object) -> None:
        try:
            content = pickle.dumps(what, protocol=5)  # as a whole: half a message would make the rest unreadable
        except Exception as error:
            self._leave_out(kind, "sent", error)
            return
        name = kind.encode()
        self._sink.write(_LENGTHS.pack(len(name), len(content)) + name)
        self._sink.write(content)
        self._sink.flush()

    def _leave_out(self, kind: str, verb: str, error: Exception) -> None:
        now_s = monotonic()
        if now_s - self._logged_s.get((kind, verb), -math.inf) >= _LOG_PERIOD_S:
            self._logged_s[kind, verb] = now_s
            reason = f"{type(error).__name__} {quoted(str(error))}"
            log.error("a message between processes about %s cannot be %s, and is left out: %s", kind, verb, reason)

    def _next(self) -> tuple[Any, ...] | None:
        with self._news:
            self._news.wait_for(lambda: self._order or self.ended.is_set())
            if not self._order:
                return None
            key = self._order.popleft()
            message = self._queues[key].popleft()
            if not self._queues[key]:
                del self._queues[key]
            return message


class PipedTransport(BaseTransport):
    """A transport for nodes whose graph is at the other end of a pipe; topics and nodes have their names in that graph.

    Args:
        pipe: Not started yet; a :class:`Gateway` is at its other end.
    """

    def __init__(self, pipe: Pipe) -> None:
        super().__init__(weakref.WeakSet())
        self._pipe = pipe
        self._numbers = itertools.count()
        pipe.on("message", self._on_message)

    def _open_publisher(self, node: str, name: str, topic: Topic[M]) -> BasePublisher[M]:
        return _PipedPublisher(node, name, topic, self._pipe, next(self._numbers))

    def _reception(self, node: str, name: str, topic: Topic[M]) -> Receive[M]:
        def receive(_send: Deliver[M]) -> Callable[[], None]:
            number = next(self._numbers)
            self._pipe.say("subscribe", number, node, topic)
            return lambda: self._pipe.say("unsubscribe", name, number)

        return receive

    def _on_message(self, name: str, received: Received[Any]) -> None:
        fanout = self._fanouts.get(name)
        if fanout is not None:
            fanout.send(received)


class _PipedPublisher(BasePublisher[M]):
    has_subscribers = True  # they are in the other process

    def __init__(self, node: str, name: str, topic: Topic[M], pipe: Pipe, number: int) -> None:
        super().__init__(node, name, topic)
        self._pipe = pipe
        self._number = number
        pipe.say("advertise", number, node, topic)
        self._end = weakref.finalize(self, pipe.say, "unadvertise", number)

    def _send(self, message: M, captured_s: float | None) -> None:
        if self._end.alive:
            # All processes of a machine share one monotonic clock.
            sent = (self._number, Received(message, captured_s), monotonic())
            self._pipe.say("publish", *sent, key=self._number, keep=kept(self.topic))

    def close(self) -> None:
        self._end()


class Gateway:
    """Publishes and subscribes on a graph's transport, for the nodes at the other end of a pipe.

    Args:
        pipe: Not started yet; a :class:`PipedTransport` is at its other end.
        transport: The graph's.
    """

    def __init__(self, pipe: Pipe, transport: Transport) -> None:
        self._pipe = pipe
        self._transport = transport
        self._publishers: dict[int, tuple[Publisher[Any], Topic[Any]]] = {}
        self._subscriptions: dict[str, tuple[int, Subscription]] = {}
        for handler in (self._advertise, self._unadvertise, self._publish, self._subscribe, self._unsubscribe):
            pipe.on(handler.__name__.removeprefix("_"), handler)

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        self._publishers.clear()
        while self._subscriptions:
            _, (_, subscription) = self._subscriptions.popitem()
            subscription.close()

    def _advertise(self, number: int, node: str, topic: Topic[Any]) -> None:
        self._publishers[number] = (self._transport.advertise(node, topic), topic)

    def _unadvertise(self, number: int) -> None:
        self._publishers.pop(number, None)

    def _publish(self, number: int, received: Received[Any], sent_s: float) -> None:
        publisher, topic = self._publishers.get(number, (None, None))
        if publisher is None or topic is None:
            return
        if topic.lifespan_s is None or monotonic() - sent_s <= topic.lifespan_s:
            publisher.publish(received.message, received.captured_s)

    def _subscribe(self, number: int, node: str, topic: Topic[Any]) -> None:
        def deliver(received: Received[Any]) -> None:
            self._pipe.say("message", topic.name, received, key=topic.name, keep=kept(topic))

        if topic.name in self._subscriptions:
            self._subscriptions.pop(topic.name)[1].close()
        self._subscriptions[topic.name] = (number, self._transport.subscribe(node, topic, deliver))

    def _unsubscribe(self, name: str, number: int) -> None:
        # The end of a subscription may come after the beginning of the next one, which has replaced it.
        if self._subscriptions.get(name, (None,))[0] == number:
            self._subscriptions.pop(name)[1].close()


def kept(topic: Topic[Any]) -> int:
    """Return how many messages of ``topic`` may wait for a slow reader; of pictures, which are large, the newest."""
    return 1 if topic.type in (Image, CompressedImage) else _KEPT
