"""Messages over Zenoh: one ROS 2 node for all nodes of this process."""

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

import zenoh
import zenoh.ext

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.channels import Deliver, Fanout, FanoutSubscription, TopicTypes, check_type
from handsteer.transports.protocol import Received
from handsteer.transports.ros2.encoding import encode
from handsteer.transports.ros2.intake import Intake
from handsteer.transports.ros2.profiles import IMAGES, Profile, offered, requested
from handsteer.transports.zenoh.keys import attachment, gid, read_attachment
from handsteer.transports.zenoh.member import Member

M = TypeVar("M")

# Zenoh sends on its own threads and does not report when they are done.
_DELIVER_S = 0.1
_HEARTBEAT_S = 0.5

log = logging.getLogger(__name__)


class ZenohTransport:
    """A :class:`~handsteer.transports.protocol.Transport` over Zenoh, compatible with ROS 2 under rmw_zenoh.

    Capture times are the stamps of message headers; messages without a header have none.
    """

    def __init__(self, member: Member, clock: Clock) -> None:
        self._member = member
        self._clock = clock
        self._types = TopicTypes()
        self._lock = threading.Lock()
        self._publishers: list[ZenohPublisher[Any]] = []
        self._incoming: dict[str, Fanout[Any]] = {}

    @property
    def crosses_network(self) -> bool:
        """Whether others may be on other machines; forwarding by a router is unknown."""
        return not self._member.is_local

    def advertise(self, node: str, topic: Topic[M]) -> "ZenohPublisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        self._claim(topic)
        publisher = ZenohPublisher(self._member, topic)
        with self._lock:
            self._publishers.append(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> FanoutSubscription[M]:
        """Call ``deliver`` for each message on ``topic`` from now on, on a thread of the topic's own."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._incoming:
                self._incoming[name] = Fanout(latched=topic.latched, receive=partial(self._receive, topic))
            fanout: Fanout[M] = self._incoming[name]
        return fanout.add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS 2 nodes that publish ``topic``, from their liveliness tokens."""
        name = self._member.name.topic(topic)
        with self._lock:
            ours = [self._member.name.full for publisher in self._publishers if publisher.name == name]
        return sorted([*ours, *self._member.publishers_of(name)])

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``; none while this process uses it twice."""
        name = self._member.name.topic(topic)
        return set() if self._types.is_shared(name) else self._member.subscribed_types(name)

    def withdraw(self, publisher: "ZenohPublisher[Any]") -> None:
        """Close a publisher, after a delay for what it sent."""
        self.flush(_DELIVER_S)
        with self._lock:
            self._publishers.remove(publisher)
        publisher.close()
        self._types.release(publisher.name)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped."""
        return self._member.name.topic(topic)

    def full_name(self, node: str) -> str:
        """Return the ROS 2 node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
        return f"{self._member.name.full.removeprefix('/')}: {node}"

    def flush(self, timeout_s: float) -> None:
        """Wait for what was published to be sent, at most ``timeout_s`` seconds."""
        time.sleep(min(timeout_s, _DELIVER_S))

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
        name = self._member.name.topic(topic)
        self._types.claim(name, topic)
        return name

    def _receive(self, topic: Topic[M], send: Deliver[M]) -> Callable[[], None]:
        return _Reception(self._member, topic, self._clock, send).close


class ZenohPublisher(Generic[M]):
    """Publisher of a topic.

    Attributes:
        name: Full name of the topic.
    """

    def __init__(self, member: Member, topic: Topic[M]) -> None:
        self._topic = topic
        profile = offered(topic)
        name, kind = _named(member, topic)
        self.name = name
        key = member.key(name, kind)
        self._publisher = member.session.declare_publisher(key, **_options(topic, profile))
        # It keeps messages for late subscribers but does not report subscribers, which the plain publisher does.
        self._keeper = _keeper(member.session, key, topic, profile) if profile.latched else None
        or_type = type_name(topic.or_type) if topic.or_type else None
        self._token, text = member.introduce("publisher", name, kind, profile, or_type)
        self._gid = gid(text)
        self._lock = threading.Lock()
        self._number = 0
        self._is_closed = False

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers, in this process or another."""
        with self._lock:
            if self._is_closed:
                return False
            status: Any = self._publisher.matching_status  # not a bool, despite its type hint
        return bool(status.matching)

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Send ``message``; subscribers that are too slow miss it."""
        check_type(self._topic, message)
        if not (self._topic.latched or self.has_subscribers):
            return
        raw = encode(message)
        with self._lock:
            if self._is_closed:
                return
            self._number += 1
            put = self._publisher.put if self._keeper is None else self._keeper.put
            try:
                put(raw, attachment=attachment(self._number, time.time_ns(), self._gid))
            except zenoh.ZError as error:
                raise TransportError(f"{self.name} cannot be published: {error}") from None

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        with self._lock:
            if self._is_closed:
                return
            self._is_closed = True
        self._token.undeclare()
        self._publisher.undeclare()
        if self._keeper is not None:
            self._keeper.undeclare()


def _named(member: Member, topic: Topic[Any]) -> tuple[str, str]:
    """Return the names of a topic and its type, as ``/r1/image_raw`` and ``sensor_msgs/msg/Image``."""
    return member.name.topic(topic), type_name(topic.type)


def _options(topic: Topic[Any], profile: Profile) -> dict[str, Any]:
    """Return the publisher's options.

    As in rmw_zenoh, no publisher waits for a stalled subscriber: messages are dropped. Signs and commands have priority
    over images on the same link, and are not delayed for batching.
    """
    is_urgent = profile.reliable and topic.type not in IMAGES
    return {
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if profile.reliable else zenoh.Reliability.BEST_EFFORT,
        "priority": zenoh.Priority.INTERACTIVE_HIGH if is_urgent else zenoh.Priority.DATA,
        "express": is_urgent,
    }


def _keeper(session: zenoh.Session, key: str, topic: Topic[Any], profile: Profile) -> zenoh.ext.AdvancedPublisher:
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(profile.depth),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S),
        publisher_detection=True,
        **_options(topic, profile),
    )


class _Reception(Generic[M]):
    """A subscriber, whose messages are decoded and passed on by its own thread.

    Zenoh puts them into a ring that keeps the newest, so that no queue grows and no other subscriber is delayed.
    """

    def __init__(self, member: Member, topic: Topic[M], clock: Clock, send: Deliver[M]) -> None:
        self._send = send
        self._is_closed = False
        profile = requested(topic)
        name, kind = _named(member, topic)
        self._intake = Intake(topic, name, clock, self._pass_on)
        self._subscriber = _subscriber(member.session, member.key(name, kind), profile)
        self._token, _ = member.introduce("subscriber", name, kind, profile)
        self._thread = threading.Thread(target=self._run, name=f"zenoh {topic.name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving."""
        self._is_closed = True
        self._token.undeclare()
        self._subscriber.undeclare()

    def _run(self) -> None:
        ring = self._subscriber.handler
        while not self._is_closed:
            try:
                sample = ring.recv()
            except zenoh.ZError:  # it has been closed
                return
            if sample.kind == zenoh.SampleKind.PUT:
                self._intake.take(sample.payload.to_bytes(), *_sending(sample.attachment))

    def _pass_on(self, received: Received[M]) -> None:
        if not self._is_closed:
            self._send(received)


def _sending(attached: zenoh.ZBytes | None) -> tuple[bytes, float | None]:
    """Return sender and time of a message; empty and None if it is not from ROS 2, or from an older one."""
    if attached is None:
        return b"", None
    try:
        _, time_ns, sender = read_attachment(attached.to_bytes())
    except ValueError:
        return b"", None
    return sender, time_ns / 1e9


def _subscriber(session: zenoh.Session, key: str, profile: Profile) -> Any:
    ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(profile.depth)
    if not profile.latched:
        return session.declare_subscriber(key, ring)
    return zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        ring,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=profile.depth),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        subscriber_detection=True,
    )
