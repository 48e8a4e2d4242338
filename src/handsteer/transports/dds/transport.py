"""Messages over DDS: one ROS 2 node for all nodes of this process."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from cyclonedds.core import DDSException
from cyclonedds.internal import InvalidSample

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.dds.participant import Participant
from handsteer.transports.protocol import Received
from handsteer.transports.ros2.encoding import decode, encode
from handsteer.transports.stamps import capture_time

M = TypeVar("M")
Deliver = Callable[[Received[M]], None]

log = logging.getLogger(__name__)


class DdsTransport:
    """A :class:`~handsteer.transports.protocol.Transport` over DDS, as ROS 2 has it.

    Capture times travel in the stamps of message headers; messages without a header come without one.

    Args:
        participant: This process in its DDS domain.
        clock: The graph's clock.
    """

    def __init__(self, participant: Participant, clock: Clock) -> None:
        self._participant = participant
        self._clock = clock
        self._lock = threading.Lock()
        self._types: dict[str, type] = {}
        self._publishers: list[DdsPublisher[Any]] = []
        self._incoming: dict[str, _Incoming[Any]] = {}

    def advertise(self, node: str, topic: Topic[M]) -> "DdsPublisher[M]":
        """Return the sending end of ``topic`` for the node named ``node``."""
        self._claim(topic)
        publisher = DdsPublisher(self._participant, topic)
        with self._lock:
            self._publishers.append(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> "DdsSubscription[M]":
        """Call ``deliver`` for each message on ``topic`` from now on, on the DDS thread of this process."""
        name = self._claim(topic)
        with self._lock:
            incoming = self._incoming.setdefault(name, _Incoming(topic, self._participant, self._clock))
        incoming.add(deliver)
        return DdsSubscription(incoming, deliver)

    def full_name(self, node: str) -> str:
        """Return the ROS 2 node's name and ``node``, as ROS's own diagnostics do: ``r1/my_camera: my_camera``."""
        return f"{self._participant.name.full.removeprefix('/')}: {node}"

    def flush(self, timeout_s: float) -> None:
        """Wait until all readers have what was published, for at most ``timeout_s`` seconds."""
        deadline_s = time.monotonic() + timeout_s
        with self._lock:
            publishers = list(self._publishers)
        for publisher in publishers:
            publisher.flush(max(0.0, deadline_s - time.monotonic()))

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        with self._lock:
            publishers, incoming = self._publishers, list(self._incoming.values())
            self._publishers = []
            self._incoming = {}
        for publisher in publishers:
            publisher.close()
        for channel in incoming:
            channel.close()

    def _claim(self, topic: Topic[Any]) -> str:
        name = self._participant.name.topic(topic)
        with self._lock:
            known = self._types.setdefault(name, topic.type)
        if known is not topic.type:
            raise TransportError(
                f"{topic.name} carries {type_name(known)}, it cannot carry {type_name(topic.type)} too"
            )
        return name


class DdsPublisher(Generic[M]):
    """The sending end of a topic."""

    def __init__(self, participant: Participant, topic: Topic[M]) -> None:
        self._participant = participant
        self._topic = topic
        self._writer: Any = participant.writer(topic)
        self._lock = threading.Lock()

    @property
    def wanted(self) -> bool:
        """Whether anybody listens, in this process or another."""
        writer = self._writer
        return writer is not None and writer.get_publication_matched_status().current_count > 0

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Give ``message`` to the network; a reader that is too slow for it goes without."""
        if not isinstance(message, self._topic.type):
            raise TransportError(
                f"{self._topic.name} carries {type_name(self._topic.type)}, not {type_name(type(message))}"
            )
        writer = self._writer
        if writer is None or not (self._topic.latched or self.wanted):
            return
        try:
            writer.write(writer.data_type(encode(message)))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise TransportError(f"{self._topic.name} cannot be published: {error}") from None
            log.warning("%s: a subscriber is too slow, a message was dropped", self._topic.name)

    def flush(self, timeout_s: float) -> None:
        """Wait until all reliable readers have what was published, for at most ``timeout_s`` seconds."""
        writer = self._writer
        if writer is not None:
            try:
                writer.wait_for_acks(round(timeout_s * 1e9))
            except (DDSException, AttributeError):
                # cyclonedds 11.0.1 stumbles over its own name of the time-out; whoever has not answered is given up.
                log.info("%s: not every subscriber has confirmed the last message", self._topic.name)

    def close(self) -> None:
        """Send no more; may be called twice."""
        with self._lock:
            writer, self._writer = self._writer, None
        if writer is not None:
            self._participant.release(writer)


class DdsSubscription(Generic[M]):
    """The receiving end of a topic."""

    def __init__(self, incoming: "_Incoming[M]", deliver: Deliver[M]) -> None:
        self._incoming = incoming
        self._deliver = deliver

    def close(self) -> None:
        """Receive no more; may be called twice."""
        self._incoming.remove(self._deliver)


@dataclass
class _Incoming(Generic[M]):
    """One topic's subscribers in this process: they share one reader, and each message is decoded once."""

    topic: Topic[M]
    participant: Participant
    clock: Clock
    subscribers: tuple[Deliver[M], ...] = ()
    _reader: Any = None
    _last: Received[M] | None = None
    _broken: bool = False
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def add(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = (*self.subscribers, deliver)
            if self._last is not None:
                deliver(self._last)
            if self._reader is None:
                self._reader = self.participant.reader(self.topic)
                self.participant.serve(self._reader, self._serve)

    def remove(self, deliver: Deliver[M]) -> None:
        with self._lock:
            self.subscribers = tuple(known for known in self.subscribers if known is not deliver)
            if not self.subscribers:
                self.close()

    def close(self) -> None:
        with self._lock:
            reader, self._reader = self._reader, None
            self.subscribers, self._last = (), None
            if reader is not None:
                self.participant.release(reader)

    def _serve(self) -> None:
        with self._lock:
            if self._reader is None:
                return
            samples = self._reader.take(self.topic.depth)
        for sample in samples:
            # A writer that leaves sends one without a message.
            if not isinstance(sample, InvalidSample):
                self._pass_on(sample.raw)

    def _pass_on(self, raw: bytes) -> None:
        try:
            message = decode(raw, type_name(self.topic.type))
        except Exception as error:
            # Whatever the network brings must not end the receiving.
            if not self._broken:
                log.warning("%s: a message of %d bytes cannot be read: %s", self.topic.name, len(raw), error)
            self._broken = True
            return
        received = Received(message, capture_time(message, self.clock))
        with self._lock:
            if self.topic.latched:
                self._last = received
            subscribers = self.subscribers
        for deliver in subscribers:
            deliver(received)
