"""What transports of ROS 2 share: quality of service, and publishing and receiving of encoded messages.

Commands, signs and what follows from them are reliable. For images, a robot's state and its scans, publishers offer
reliable and subscribers request best effort, as in REP 2003 for sensor data: this matches every other endpoint, and
late messages are of no use to us. ``/clock`` is best effort.
"""

import itertools
import logging
import math
import re
import threading
import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

from handsteer.clock import Clock, monotonic
from handsteer.errors import TransportError
from handsteer.messages import (
    CameraInfo,
    ClockMessage,
    CompressedImage,
    Image,
    JointState,
    LaserScan,
    Odometry,
    Topic,
    Twist,
    TwistStamped,
    type_name,
)
from handsteer.plugins.ros2.names import NodeName
from handsteer.plugins.ros2.stop_order import StopOrder
from handsteer.timeouts import STALE_S
from handsteer.transports.base import Deliver, Received
from handsteer.transports.encoding import MessageReader, compile_type, decode, encode
from handsteer.transports.in_process import BasePublisher, BaseTransport, Receive
from handsteer.transports.timing import StaleMessageFilter, capture_time

M = TypeVar("M")

NO_DEADLINE = "the subscriber has a deadline that the publisher does not promise to meet"
NO_LIVELINESS = "the subscriber wants a liveliness that the publisher does not promise"
"""Reasons why DDS does not connect a publisher and a subscriber, in words."""
IMAGES = (Image, CompressedImage)
"""Large messages, which have a lower priority than all others on a link."""
_SENSOR_DATA = (*IMAGES, CameraInfo, Odometry, JointState, LaserScan)
# Enough to resend lost parts before the next image arrives; older images are of no use.
_IMAGES_KEPT = 3
_LAST_S = 0.2
_PLAYER = re.compile(r"(/\w+)*/rosbag2_player\w*", re.ASCII)
_PLAYERS_KNOWN_S = 0.25
_REMEMBERED = 64
_LOOK_S = 0.2

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Profile:
    """The quality of service of one endpoint: reliable or best effort, transient local or volatile, keep last."""

    reliable: bool
    latched: bool
    depth: int


def offered(topic: Topic[Any]) -> Profile:
    """Return the profile offered by a publisher of ``topic``."""
    depth = max(topic.depth, _IMAGES_KEPT) if topic.type in IMAGES else topic.depth
    return Profile(topic.type is not ClockMessage, topic.latched, depth)


def requested(topic: Topic[Any]) -> Profile:
    """Return the profile requested by a subscriber of ``topic``."""
    return Profile(topic.type not in (*_SENSOR_DATA, ClockMessage), topic.latched, topic.depth)


def unconnected(topic: str, ours: str, theirs: str, node: str, why: str) -> str:
    """Return one line on ends of a topic, each ``publisher`` or ``subscriber``, that exchange no messages.

    Args:
        topic: Full name of the topic.
        ours: What our end is.
        theirs: What the other end is.
        node: Full name of its node.
        why: The reason.
    """
    return f"{topic}: nothing passes between our {ours} and the {theirs} of {node}: {why}"


class Writer(Protocol):
    """Sends the encoded messages of a topic, on any middleware."""

    @property
    def has_readers(self) -> bool:
        """Whether there are subscribers, in this process or another."""
        ...

    def write(self, raw: bytes) -> None:
        """Send a message; never waits for subscribers, which miss it if they are too slow."""
        ...

    def flush(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether all reliable subscribers have what was sent."""
        ...

    def close(self) -> None:
        """Stop sending; called once."""
        ...


class _Publisher(BasePublisher[M]):
    """Publisher of a topic by ``writer``, which raises one of ``errors`` if it cannot send.

    Without a writer, there are never subscribers.
    """

    def __init__(
        self, node: str, name: str, topic: Topic[M], writer: Writer | None, errors: tuple[type[Exception], ...]
    ) -> None:
        super().__init__(node, name, topic)
        self._lock = threading.Lock()
        self._writer = writer
        self._errors = errors

    @property
    def has_subscribers(self) -> bool:
        with self._lock:
            return self._writer is not None and self._writer.has_readers

    def flush(self, timeout_s: float) -> None:
        writer = self._writer
        if writer is not None and not writer.flush(timeout_s):
            log.info("%s: not every subscriber has confirmed the last message", self.name)

    def close(self) -> None:
        with self._lock:
            writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _send(self, message: M, captured_s: float | None) -> None:
        raw = encode(message)
        try:
            with self._lock:
                if self._writer is not None:
                    self._writer.write(raw)
        except self._errors as error:
            raise TransportError(f"{self.name} cannot be published: {error}") from None


class Ros2Transport(BaseTransport):
    """Carries messages as one ROS 2 node for all nodes of this process, on any middleware.

    Capture times are the stamps of message headers; messages without a header have none.

    Args:
        node: Full name of this process's node, such as ``/r1/my_camera``.
        clock: The graph's clock.
    """

    errors: ClassVar[tuple[type[Exception], ...]]
    """Exceptions of a :class:`Writer` that cannot send."""
    connects_by_qos: ClassVar[bool] = True
    """Whether a publisher that is best effort and a subscriber that is reliable are not connected."""

    def __init__(self, node: str, clock: Clock) -> None:
        super().__init__(set())
        self._node_name = node
        self._clock = clock
        self._unkept: set[_KeptStops] = set()
        self._looked_s = -math.inf

    def check(self) -> None:
        """Hear the Stops that others have kept, and log problems of the connection to the graph; called regularly.

        Raises:
            TransportError: The connection is lost for good.
        """
        if time.monotonic() - self._looked_s < _LOOK_S:
            return
        self._looked_s = time.monotonic()
        for kept in tuple(self._unkept):
            if self._has_keepers(kept.topic):
                kept.open()
                self._unkept.discard(kept)

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``; none while this process uses it twice."""
        return set() if self._types.is_shared(self.topic_name(topic)) else self._subscribed_types(topic)

    def withdraw(self, publisher: BasePublisher[Any]) -> None:
        """Close a publisher once its subscribers have what it sent."""
        publisher.flush(_LAST_S)
        with self._lock:
            self._publishers.remove(publisher)
        publisher.close()
        self._types.release(publisher.name)

    def full_name(self, node: str) -> str:
        """Return the ROS 2 node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
        return f"{self._node_name.removeprefix('/')}: {node}"

    def flush(self, timeout_s: float) -> None:
        """Wait until all subscribers have what was published, for at most ``timeout_s`` seconds."""
        with self._lock:
            publishers = list(self._publishers)
        deadline_s = time.monotonic() + timeout_s
        for publisher in publishers:
            publisher.flush(max(0.0, deadline_s - time.monotonic()))

    def _open_publisher(self, node: str, name: str, topic: Topic[M]) -> BasePublisher[M]:
        compile_type(type_name(topic.type))
        return _Publisher(self._node_name, name, topic, self._open_writer(name, topic), self.errors)

    def _reception(self, node: str, name: str, topic: Topic[M]) -> Receive[M]:
        compile_type(type_name(topic.type))
        players = Players(lambda: self.publishers_of(topic)) if topic.type in IMAGES else None
        profile = requested(topic)

        def receive(send: Deliver[M]) -> Callable[[], None]:
            take = Intake(topic, name, self._clock, send, players).take
            if not topic.any_reliability:
                return self._open_reader(name, topic, profile, take)
            once = Once(take).take
            reliabilities = (True, False) if self.connects_by_qos else (True,)
            ends = [self._open_reader(name, topic, replace(profile, reliable=each), once) for each in reliabilities]
            kept = _KeptStops(topic, once, partial(self._open_reader, name, topic, replace(profile, latched=True)))
            self._unkept.add(kept)

            def close() -> None:
                self._unkept.discard(kept)
                for end in (*ends, kept.close):
                    end()

            return close

        return receive

    @abstractmethod
    def _open_writer(self, name: str, topic: Topic[Any]) -> Writer | None:
        """Return a new writer of ``topic``, whose full name is ``name``; None if there can be no subscribers."""

    @abstractmethod
    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: "Take") -> Callable[[], None]:
        """Call ``take`` with the messages of ``topic``, on one thread at a time; return a function that ends it."""

    @abstractmethod
    def _subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of the subscribers of ``topic`` in other processes."""

    @abstractmethod
    def _has_keepers(self, topic: Topic[Any]) -> bool:
        """Return whether a publisher of ``topic`` in another process keeps messages for later subscribers."""


def types_of(topic: Topic[Any]) -> set[str]:
    """Return the names of the types that ``topic`` may have: a command is a Twist or a TwistStamped."""
    kinds, commands = {topic.type, topic.or_type or topic.type}, {Twist, TwistStamped}
    return {type_name(kind) for kind in (kinds | commands if kinds & commands else kinds)}


class Other(NamedTuple):
    """A publisher or subscriber in another process.

    Attributes:
        node: Full name of its node.
        type: Type of its messages.
        publishes: Whether it is a publisher.
        keeps: Whether a publisher keeps messages for later subscribers.
    """

    node: str
    type: str
    publishes: bool
    keeps: bool = False


class WireTransport(Ros2Transport):
    """Carries messages without ROS 2's own library, and services too.

    Args:
        name: Name of this process's node, with its remapping rules.
        clock: The graph's clock.
    """

    def __init__(self, name: NodeName, clock: Clock) -> None:
        super().__init__(name.full, clock)
        self._name = name
        self._services: list[Callable[[], None]] = []

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS 2 nodes that publish ``topic``, in this process and others."""
        kinds = types_of(topic)
        others = [
            other.node for other in self._others(self.topic_name(topic)) if other.publishes and other.type in kinds
        ]
        return sorted([*super().publishers_of(topic), *others])

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped."""
        return self._name.topic(topic)

    def serve(self, name: str, kind: str, respond: Callable[[bytes], bytes]) -> None:
        """Offer the service of this full name, and of a type such as ``rcl_interfaces/srv/ListParameters``.

        ``respond`` converts an encoded request to a reply, at once; it raises any exception if the request is invalid.
        """
        self._services.append(self._open_service(name, kind, respond))

    def close(self) -> None:
        """End all publishing, receiving and services; may be called twice."""
        while self._services:
            self._services.pop()()
        super().close()

    @abstractmethod
    def _open_service(self, name: str, kind: str, respond: Callable[[bytes], bytes]) -> Callable[[], None]:
        """Offer a service, as in :meth:`serve`; return a function that ends it, and is called once."""

    @abstractmethod
    def _others(self, name: str) -> list[Other]:
        """Return the publishers and subscribers of the topic of this full name in other processes."""

    def _subscribed_types(self, topic: Topic[Any]) -> set[str]:
        return {other.type for other in self._others(self.topic_name(topic)) if not other.publishes}

    def _has_keepers(self, topic: Topic[Any]) -> bool:
        return any(other.publishes and other.keeps for other in self._others(self.topic_name(topic)))


Take = Callable[[bytes, bytes, float | None], None]
"""Takes an encoded message, an identifier of its sender, and the time of sending, as :meth:`Intake.take`."""


class Once:
    """Passes on what several readers of one topic receive, each message once, and the newest of a sender last.

    One reader may overtake the other, which has to wait for what was lost. So after an older message, a newer one that
    was passed on already is passed on again.

    Args:
        take: As :meth:`Intake.take`.
    """

    def __init__(self, take: Take) -> None:
        self._take = take
        self._taken: deque[tuple[bytes, float]] = deque(maxlen=_REMEMBERED)
        self._lock = threading.RLock()

    def take(self, raw: bytes, sender: bytes, sent_s: float | None) -> None:
        """Process one message, on any thread; without a time of sending it may come twice."""
        with self._lock:
            if sent_s is None or not self._is_taken((raw, sent_s)):
                self._take(raw, sender, sent_s)

    def _is_taken(self, message: tuple[bytes, float]) -> bool:
        """Record a message; return whether it was passed on, and no older one after it."""
        taken = self._taken
        if message in taken:
            at = taken.index(message)
            if all(sent_s >= message[1] for _, sent_s in itertools.islice(taken, at, None)):
                return True
            del taken[at]
        taken.append(message)
        return False


class _KeptStops:
    """Passes on the Stop that a publisher has kept for later subscribers, as one that is transient local does.

    A kept reset ends no Stop of others: only one that the same sender has sent after its Stop is passed on.

    Args:
        topic: The topic, which has ``stops``.
        take: As :meth:`Intake.take`.
        open_reader: Opens a reader of what is kept. It is opened only when such a publisher is there, because all
            others would warn of a subscriber that gets none of their messages.
    """

    def __init__(self, topic: Topic[Any], take: Take, open_reader: Callable[[Take], Callable[[], None]]) -> None:
        self.topic = topic
        self._pass_on = take
        self._open_reader = open_reader
        self._end: Callable[[], None] | None = None
        self._lock = threading.Lock()
        self._is_closed = False
        self._stopped_by, self._stopped_s = b"", math.inf

    def open(self) -> None:
        """Begin to read."""
        with self._lock:
            if not self._is_closed:
                self._end = self._open_reader(self._take)

    def close(self) -> None:
        """Stop reading."""
        with self._lock:
            self._is_closed = True
        if self._end is not None:
            self._end()

    def _take(self, raw: bytes, sender: bytes, sent_s: float | None) -> None:
        try:
            stops = self.topic.stops is not None and self.topic.stops(decode(raw, type_name(self.topic.type)))
        except Exception:
            return  # the other readers report it
        if stops:
            self._stopped_by, self._stopped_s = sender, math.inf if sent_s is None else sent_s
        elif sent_s is None or sender != self._stopped_by or sent_s <= self._stopped_s:
            return
        self._pass_on(raw, sender, sent_s)


def are_players(nodes: Sequence[str]) -> bool:
    """Return whether these nodes, by their full names, are players of recordings: ``ros2 bag play``."""
    return bool(nodes) and all(_PLAYER.fullmatch(node) for node in nodes)


class Players:
    """Whether players of recordings publish a topic, looked up a few times a second at most.

    Args:
        publishers: Returns the full names of the nodes that publish it.
    """

    def __init__(self, publishers: Callable[[], Sequence[str]]) -> None:
        self._publishers = publishers
        self._looked_s = -math.inf
        self._known: Sequence[str] = ()

    def are_alone(self) -> bool:
        """Return whether there are some, and no other node publishes it."""
        return are_players(self._look())

    def are_among_others(self) -> bool:
        """Return whether there are some, and other nodes publish it too."""
        nodes = self._look()
        return any(map(_PLAYER.fullmatch, nodes)) and not are_players(nodes)

    def _look(self) -> Sequence[str]:
        now_s = time.monotonic()
        if now_s - self._looked_s >= _PLAYERS_KNOWN_S:
            self._looked_s, self._known = now_s, self._publishers()
        return self._known


class Intake(Generic[M]):
    """Decodes the messages of a topic and sends them on, except late ones that do not stop the robot.

    The first invalid message is logged, and the first of several late ones.
    """

    def __init__(
        self, topic: Topic[M], name: str, clock: Clock, send: Deliver[M], players: Players | None = None
    ) -> None:
        self._players = players
        self._topic = topic
        self._name = name
        self._clock = clock
        self._send = send
        self._stale = None if topic.lifespan_s is None else StaleMessageFilter(topic.lifespan_s)
        self._order = StopOrder() if topic.stops is not None and topic.lifespan_s is None else None
        kind = type_name(topic.type)
        self._reader: MessageReader[M] = MessageReader(name, lambda raw: decode(raw, kind))
        self._was_late = False

    def take(self, raw: bytes, sender: bytes, sent_s: float | None) -> None:
        """Process one message.

        Args:
            raw: The encoded message.
            sender: Identifies the sender; empty if unknown.
            sent_s: Time of sending, in seconds of the sender's clock; None if unknown.
        """
        is_late = self._is_late(sender, sent_s)
        message = self._reader.read(raw)
        if message is None:
            return
        stops = self._topic.stops is not None and self._topic.stops(message)
        if self._is_overtaken(sender, sent_s, stops=stops):
            return
        if not is_late or stops:
            captured_s = capture_time(message, self._clock)
            is_played = False
            if captured_s is not None and self._players is not None:
                is_played = self._players.are_alone()
                # Old stamps that advance would otherwise look like those of a camera whose clock was set.
                is_late = self._players.are_among_others() and self._clock.now() - captured_s > STALE_S
            self._send(Received(message, captured_s, is_late=is_late, by_player=is_played))

    def _is_overtaken(self, sender: bytes, sent_s: float | None, *, stops: bool) -> bool:
        if self._order is None or sent_s is None or not sender:
            return False
        is_overtaken = self._order.is_overtaken(sender, sent_s, monotonic(), stops=stops)
        if is_overtaken:
            log.warning("%s: a reset that was sent before the last Stop is not obeyed: reset again", self._name)
        return is_overtaken

    def _is_late(self, sender: bytes, sent_s: float | None) -> bool:
        if self._stale is None or sent_s is None:
            return False
        is_late = self._stale.is_late(sender, sent_s, monotonic())
        if is_late and not self._was_late:
            log.warning(
                "%s: messages come over %g s late and are not obeyed, but for stops: has the link stood still, has the "
                "clock of their sender been set back%s?",
                self._name,
                self._topic.lifespan_s,
                "" if sender else ", or have several senders clocks that differ",
            )
        self._was_late = is_late
        return is_late
