"""This process as a node of a ROS 2 graph over DDS, which carries the messages of all its nodes."""

import logging
import os
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

from cyclonedds.core import DDSException
from cyclonedds.internal import InvalidSample

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic
from handsteer.transports.channels import Deliver, Fanout, FanoutSubscription, TopicTypes, check_type
from handsteer.transports.dds.network import network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.services import ServiceServer
from handsteer.transports.ros2.base_session import Ros2Session
from handsteer.transports.ros2.encoding import encode
from handsteer.transports.ros2.intake import Intake
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.service_types import Service

M = TypeVar("M")

_LAST_S = 0.2

log = logging.getLogger(__name__)


class DdsTransport:
    """A :class:`~handsteer.transports.protocol.Transport` over DDS, compatible with ROS 2.

    Capture times are the stamps of message headers; messages without a header have none.
    """

    def __init__(self, participant: Participant, clock: Clock) -> None:
        self._participant = participant
        self._clock = clock
        self._types = TopicTypes()
        self._lock = threading.Lock()
        self._publishers: list[DdsPublisher[Any]] = []
        self._incoming: dict[str, Fanout[Any]] = {}

    @property
    def crosses_network(self) -> bool:
        """Whether others may be on other machines."""
        return not self._participant.is_local

    def advertise(self, node: str, topic: Topic[M]) -> "DdsPublisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        publisher = DdsPublisher(self._participant, topic, self._claim(topic))
        with self._lock:
            self._publishers.append(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> FanoutSubscription[M]:
        """Call ``deliver`` for each message on ``topic`` from now on, on the DDS thread of this process."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._incoming:
                self._incoming[name] = Fanout(latched=topic.latched, receive=partial(self._receive, topic))
            fanout: Fanout[M] = self._incoming[name]
        return fanout.add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS 2 nodes that publish ``topic``; names come up to three seconds late."""
        name = self._participant.name.topic(topic)
        with self._lock:
            ours = [self._participant.name.full for publisher in self._publishers if publisher.name == name]
        return sorted([*ours, *self._participant.publishers_of(topic)])

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``; none while this process uses it twice."""
        is_shared = self._types.is_shared(self._participant.name.topic(topic))
        return set() if is_shared else self._participant.subscribed_types(topic)

    def withdraw(self, publisher: "DdsPublisher[Any]") -> None:
        """Close a publisher once its readers have what it sent."""
        publisher.flush(_LAST_S)
        with self._lock:
            self._publishers.remove(publisher)
        publisher.close()
        self._types.release(publisher.name)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped."""
        return self._participant.name.topic(topic)

    def full_name(self, node: str) -> str:
        """Return the ROS 2 node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
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
        self._types.claim(name, topic)
        return name

    def _receive(self, topic: Topic[M], send: Deliver[M]) -> Callable[[], None]:
        return _Reception(self._participant, topic, self._clock, send).close


class DdsPublisher(Generic[M]):
    """Publisher of a topic.

    Attributes:
        name: Full name of the topic.
    """

    def __init__(self, participant: Participant, topic: Topic[M], name: str) -> None:
        self.name = name
        self._participant = participant
        self._topic = topic
        self._writer: Any = participant.writer(topic)
        self._is_held_up = False
        self._lock = threading.Lock()

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers, in this process or another."""
        writer = self._writer
        return writer is not None and writer.get_publication_matched_status().current_count > 0

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Send ``message``; readers that are too slow miss it."""
        check_type(self._topic, message)
        writer = self._writer
        if writer is None or not (self._topic.latched or self.has_subscribers):
            return
        try:
            writer.write(writer.data_type(encode(message)))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise TransportError(f"{self.name} cannot be published: {error}") from None
            if not self._is_held_up:
                log.warning("%s: a subscriber is too slow, and messages are dropped", self.name)
            self._is_held_up = True
        else:
            self._is_held_up = False

    def flush(self, timeout_s: float) -> None:
        """Wait until all reliable readers have what was published, for at most ``timeout_s`` seconds."""
        writer = self._writer
        if writer is not None:
            try:
                writer.wait_for_acks(round(timeout_s * 1e9))
            except (DDSException, AttributeError):
                # At a timeout, cyclonedds 11.0.1 raises AttributeError for a wrong name of its own. Readers that have
                # not confirmed by then are given up.
                log.info("%s: not every subscriber has confirmed the last message", self.name)

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        with self._lock:
            writer, self._writer = self._writer, None
        if writer is not None:
            self._participant.release(writer)


class _Reception(Generic[M]):
    """A reader, whose messages are decoded and passed on."""

    def __init__(self, participant: Participant, topic: Topic[M], clock: Clock, send: Deliver[M]) -> None:
        self._participant = participant
        self._depth = topic.depth
        self._intake = Intake(topic, participant.name.topic(topic), clock, send)
        self._reader: Any = participant.reader(topic)
        participant.serve(self._reader, self._serve)

    def close(self) -> None:
        """Stop receiving."""
        reader, self._reader = self._reader, None
        self._participant.release(reader)

    def _serve(self) -> None:
        reader = self._reader
        if reader is None:
            return
        for sample in reader.take(self._depth):
            # A writer that leaves sends a sample without a message.
            if not isinstance(sample, InvalidSample):
                info = sample.sample_info
                # RTPS allows a sender to omit its time.
                sent_s = info.source_timestamp / 1e9 if info.source_timestamp > 0 else None
                self._intake.take(sample.raw, info.publication_handle.to_bytes(8, "big"), sent_s)


class DdsSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over DDS."""

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        super().close()
        self._participant.close()

    def _connect(self, name: NodeName, clock: Clock) -> DdsTransport:
        self._participant = Participant(network(os.environ), name)
        return DdsTransport(self._participant, clock)

    def _answer(self, name: str, service: Service, answer: Callable[[Any], Any]) -> ServiceServer:
        return ServiceServer(self._participant, name, service, answer)
