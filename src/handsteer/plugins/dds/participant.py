"""This process as a participant of a DDS domain and a node of ROS 2, with its publishers and subscribers."""

import itertools
import logging
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from cyclonedds.core import (
    DDSException,
    GuardCondition,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.plugins.dds.discovery import Endpoint, Matching, RosGraph
from handsteer.plugins.dds.network import Network
from handsteer.plugins.dds.topics import (
    dds_type,
    keeps,
    opaque_type,
    reader_qos,
    service_dds_type,
    service_qos,
    writer_qos,
)
from handsteer.plugins.ros2.base_transport import Other, Profile
from handsteer.plugins.ros2.names import NodeName, dds_type_name, ros_type_name
from handsteer.transports.base import UNNAMED
from handsteer.transports.encoding import reply_type, request_type

_USER_DATA = b"enclave=/;"
_TICK_S = 0.25
_NS_PER_S = 1_000_000_000
_AFTER_FAILURE_S = 0.05
_LEAVE_TIMEOUT_S = 2.0
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any

E = TypeVar("E", DataWriter[Any], DataReader[Any])

log = logging.getLogger(__name__)


class Participant:
    """A participant of a DDS domain, known to ROS 2 as one node.

    Attributes:
        is_local: Whether all others are certainly on this machine.
        dispatcher: The thread that serves readers, until they are released.

    Args:
        is_observer: Whether it only observes, and announces no node.

    Raises:
        TransportError: The domain cannot be joined.
    """

    def __init__(self, network: Network, name: NodeName, *, is_observer: bool = False) -> None:
        self.is_local = network.is_local
        try:
            self._domain: Any = None if network.config is None else Domain(network.domain, network.config)
            self._participant: Any = DomainParticipant(network.domain, Qos(Policy.Userdata(_USER_DATA)))
        except DDSException as error:
            raise TransportError(
                f"cannot join the ROS 2 domain {network.domain} as {name.full}: {error} Is it joined already by this "
                f"process, are there more than 32 others on this machine, is CYCLONEDDS_URI wrong?"
            ) from None
        self._lock = threading.Lock()
        self._topics: dict[tuple[str, str], Any] = {}
        self._service_numbers = itertools.count(1)
        self._graph = RosGraph(self._participant, None if is_observer else name, network.distribution)
        self._matching = Matching(self._participant, self._graph)
        self.dispatcher = Dispatcher(self._participant)
        self.dispatcher.tick(self._matching.tick)
        self.dispatcher.add(self._graph.reader, self._graph.serve)
        for reader, serve in self._matching.readers:
            self.dispatcher.add(reader, serve)
        self.dispatcher.start()

    def writer(self, name: str, topic: Topic[Any]) -> DataWriter[Any]:
        """Return a new writer of ``topic``, whose full name is ``name``; its messages have its ``data_type``."""
        return self._open(DataWriter, name, topic, writer_qos(topic), publishes=True)

    def reader(self, name: str, topic: Topic[Any], profile: Profile) -> DataReader[Any]:
        """Return a new reader of ``topic``, whose full name is ``name``; of two with a name, the last is compared.

        One of what others have kept, of a topic that is not latched, is not compared.
        """
        compares = profile.latched == topic.latched
        return self._open(DataReader, name, topic, reader_qos(topic, profile), publishes=False, compares=compares)

    def service(self, name: str, kind: str) -> tuple[DataReader[Any], DataWriter[Any]]:
        """Return a reader of the requests and a writer of the replies of the service of this full name and type."""
        request, reply = request_type(kind), reply_type(kind)
        # As in ROS 2: the participant's part of an identifier, and a number.
        number = next(self._service_numbers).to_bytes(4, "big")
        identity = ".".join(f"{byte:x}" for byte in self._participant.guid.bytes[:12] + number)
        # Cyclone DDS checks received messages, and prints a warning for each request of a client on Fast DDS.
        requests = DdsTopic(self._participant, f"rq{name}Request", opaque_type(dds_type_name(request)))
        replies = DdsTopic(self._participant, f"rr{name}Reply", service_dds_type(reply))
        reader: DataReader[Any] = DataReader(self._participant, requests, qos=service_qos(request, identity))
        writer: DataWriter[Any] = DataWriter(self._participant, replies, qos=service_qos(reply, identity))
        self._graph.add(reader)
        self._graph.add(writer)
        return reader, writer

    def others(self) -> tuple[list[str], list[tuple[Endpoint, str | None]]]:
        """Return the nodes of other processes, and their publishers and subscribers with the node of each, if known."""
        return self._graph.nodes(), [(end, self._graph.node_of(key)) for key, end in self._matching.others().items()]

    def others_of(self, name: str) -> list[Other]:
        """Return the publishers and subscribers of the topic of this full name in other processes.

        Names of nodes come up to three seconds late.
        """
        # Of this topic only: to find the node of each in a large graph takes tens of milliseconds.
        return [
            Other(self._graph.node_of(key) or UNNAMED, ros_type_name(end.type), end.publishes, keeps(end.qos))
            for key, end in self._matching.others().items()
            if end.topic == f"rt{name}"
        ]

    def release(self, endpoint: DataWriter[Any] | DataReader[Any]) -> None:
        """Release a writer or reader; it is deleted when the caller drops its reference too."""
        if isinstance(endpoint, DataReader):
            self.dispatcher.remove(endpoint)
        self._graph.remove(endpoint)

    def close(self) -> None:
        """Leave the domain; may be called twice."""
        self.dispatcher.close()
        self._matching.close()
        self._graph.close()
        self._topics.clear()
        self._participant = self._domain = None

    def _open(
        self,
        kind: Callable[..., E],
        full_name: str,
        topic: Topic[Any],
        qos: Qos,
        *,
        publishes: bool,
        compares: bool = True,
    ) -> E:
        name, message = f"rt{full_name}", type_name(topic.type)
        with self._lock:
            if (name, message) not in self._topics:
                self._topics[name, message] = DdsTopic(self._participant, name, dds_type(message))
            dds_topic = self._topics[name, message]
        endpoint = kind(self._participant, dds_topic, qos=qos)
        self._graph.add(endpoint)
        or_type = dds_type_name(type_name(topic.or_type)) if publishes and topic.or_type else None
        if compares:
            self._matching.add(Endpoint(name, dds_type_name(message), qos, publishes, or_type))
        return endpoint


class Dispatcher:
    """The thread that processes everything received: calls a function for each reader that has messages.

    Listeners would run on the threads of Cyclone DDS, which hold its locks while they wait for Python's.
    """

    def __init__(self, participant: DomainParticipant) -> None:
        # Referenced while the thread runs: a start interrupted by a signal drops the participant without closing it.
        self._participant: DomainParticipant | None = participant
        self._waitset = WaitSet(participant)
        self._guard = GuardCondition(participant)
        self._waitset.attach(self._guard)
        self._ticks: tuple[Callable[[], None], ...] = ()
        self._lock = threading.Lock()
        self._served: dict[DataReader[Any], tuple[ReadCondition, Callable[[], None]]] = {}
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="dds", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def add(self, reader: DataReader[Any], serve: Callable[[], None]) -> None:
        """Call ``serve``, which must take all messages, whenever ``reader`` has some."""
        condition = ReadCondition(reader, _ANY)
        with self._lock:
            self._served[reader] = (condition, serve)
            self._waitset.attach(condition)

    def tick(self, call: Callable[[], None]) -> None:
        """Call ``call`` four times a second, and whenever something was received."""
        with self._lock:
            self._ticks = (*self._ticks, call)

    def remove(self, reader: DataReader[Any]) -> None:
        """Stop calling for ``reader``; one call may still be running."""
        with self._lock:
            condition, _ = self._served.pop(reader)
            self._waitset.detach(condition)

    def close(self) -> None:
        """End the thread; may be called twice."""
        if not self._closing.is_set():
            self._closing.set()
            self._guard.set(True)
            if self._thread.is_alive() and self._thread is not threading.current_thread():
                self._thread.join(_LEAVE_TIMEOUT_S)
            for reader in list(self._served):
                self.remove(reader)
            self._participant = None

    def _run(self) -> None:
        while not self._closing.is_set():
            self._guarded(self._wait)
            self._serve_all()
            for call in self._ticks:
                self._guarded(call)

    def _wait(self) -> None:
        self._waitset.wait(round(_TICK_S * _NS_PER_S))

    def _serve_all(self) -> None:
        with self._lock:
            served = list(self._served.values())
        for condition, serve in served:
            # Checking is cheaper than an empty take, and usually only one reader has messages.
            if condition.triggered:
                self._guarded(serve)

    def _guarded(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception:
            if not self._closing.is_set():
                log.exception("DDS: a message could not be served")
                self._closing.wait(_AFTER_FAILURE_S)  # repeated failures must not use up the processor
