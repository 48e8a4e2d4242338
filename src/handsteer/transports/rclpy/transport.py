"""Messages by rclpy: one ROS 2 node for all nodes of this process, with serialised messages."""

import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.transports.channels import Deliver, Fanout, FanoutSubscription, TopicTypes, check_type
from handsteer.transports.rclpy.types import ros_class
from handsteer.transports.ros2.encoding import encode
from handsteer.transports.ros2.intake import Intake
from handsteer.transports.ros2.profiles import Profile, offered, requested


def publisher_qos(topic: Topic[Any]) -> QoSProfile:
    """Return the QoS offered by a publisher of ``topic``."""
    qos = _qos(offered(topic))
    if topic.lifespan_s is not None:
        qos.lifespan = Duration(seconds=topic.lifespan_s)
    return qos


def subscription_qos(topic: Topic[Any]) -> QoSProfile:
    """Return the QoS requested by a subscription to ``topic``."""
    return _qos(requested(topic))


def _qos(profile: Profile) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=profile.depth,
        reliability=ReliabilityPolicy.RELIABLE if profile.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if profile.latched else DurabilityPolicy.VOLATILE,
    )


M = TypeVar("M")

_LAST_S = 0.2

log = logging.getLogger(__name__)


class RclpyTransport:
    """A :class:`~handsteer.transports.protocol.Transport` by a node of rclpy, which the caller spins.

    Capture times are the stamps of message headers; messages without a header have none. A topic whose message type is
    missing in this ROS 2 is logged once and ignored.
    """

    # Fast DDS loses most raw images even on one machine.
    crosses_network = True

    def __init__(self, node: Node, clock: Clock) -> None:
        self._node = node
        self._clock = clock
        self._types = TopicTypes()
        self._lock = threading.Lock()
        self._lacking: set[str] = set()
        self._publishers: list[RclpyPublisher[Any]] = []
        self._incoming: dict[str, Fanout[Any]] = {}
        self._is_open = True

    def advertise(self, node: str, topic: Topic[M]) -> "RclpyPublisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        name = self._claim(topic)
        publisher = RclpyPublisher(self._node, topic, name, self._class_of(topic))
        with self._lock:
            self._publishers.append(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> FanoutSubscription[M]:
        """Call ``deliver`` for each message on ``topic`` from now on, on the thread that spins the node."""
        name = self._claim(topic)
        with self._lock:
            if name not in self._incoming:
                receive = partial(self._receive, topic)
                self._incoming[name] = Fanout(latched=topic.latched, receive=receive)
            fanout: Fanout[M] = self._incoming[name]
        return fanout.add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS 2 nodes that publish ``topic``; killed ones remain for a while."""
        if not self._is_open:
            return []
        found = self._node.get_publishers_info_by_topic(_given(self._node, topic))
        return sorted(f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in found)

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``; none while this process uses it twice."""
        if self._types.is_shared(resolved(self._node, topic)):
            return set()
        return {one.topic_type for one in self._node.get_subscriptions_info_by_topic(_given(self._node, topic))}

    def withdraw(self, publisher: "RclpyPublisher[Any]") -> None:
        """Close a publisher once its subscribers have what it sent."""
        publisher.flush(_LAST_S)
        with self._lock:
            self._publishers.remove(publisher)
        publisher.close()
        self._types.release(publisher.name)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped."""
        return resolved(self._node, topic)

    def full_name(self, node: str) -> str:
        """Return the ROS 2 node's name and ``node``, as in ROS's own diagnostics: ``r1/my_camera: my_camera``."""
        return f"{self._node.get_fully_qualified_name().removeprefix('/')}: {node}"

    def flush(self, timeout_s: float) -> None:
        """Wait until all reliable subscribers have what was published, for at most ``timeout_s`` seconds."""
        deadline_s = time.monotonic() + timeout_s
        with self._lock:
            publishers = list(self._publishers)
        for publisher in publishers:
            publisher.flush(max(0.0, deadline_s - time.monotonic()))

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        self._is_open = False
        with self._lock:
            publishers, self._publishers = self._publishers, []
            incoming, self._incoming = self._incoming, {}
        for publisher in publishers:
            publisher.close()
        for channel in incoming.values():
            channel.close()

    def _claim(self, topic: Topic[Any]) -> str:
        name = resolved(self._node, topic)
        self._types.claim(name, topic)
        return name

    def _class_of(self, topic: Topic[Any]) -> Any | None:
        kind = type_name(topic.type)
        found = ros_class(kind)
        package = kind.partition("/")[0]
        if found is None and package not in self._lacking:
            self._lacking.add(package)
            log.warning(
                "%s is left out: this ROS 2 lacks the package %s (sudo apt install ros-$ROS_DISTRO-%s)",
                resolved(self._node, topic),
                package,
                package.replace("_", "-"),
            )
        return found

    def _receive(self, topic: Topic[M], send: Deliver[M]) -> Callable[[], None]:
        kind = self._class_of(topic)
        return (lambda: None) if kind is None else _Reception(self._node, topic, kind, self._clock, send).close


class RclpyPublisher(Generic[M]):
    """Publisher of a topic.

    Attributes:
        name: Full name of the topic.

    Args:
        kind: ROS 2's class for its messages; None if it is missing, so that there are never subscribers.
    """

    def __init__(self, node: Node, topic: Topic[M], name: str, kind: Any | None) -> None:
        self.name = name
        self._node = node
        self._topic = topic
        self._lock = threading.Lock()
        self._publisher: Any = None
        if kind is not None:
            with _refusals(name):
                self._publisher = node.create_publisher(
                    kind,
                    _given(node, topic),
                    publisher_qos(topic),
                    # Event callbacks would keep a reference in the executor, and with it the publisher and the type of
                    # its topic.
                    event_callbacks=PublisherEventCallbacks(use_default_callbacks=topic.or_type is None),
                    qos_overriding_options=_overriding(node, name),
                )

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers, in this process or another."""
        publisher = self._publisher
        return publisher is not None and publisher.get_subscription_count() > 0

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Send ``message`` by rclpy; subscribers that are too slow miss it."""
        check_type(self._topic, message)
        publisher = self._publisher
        if publisher is None or not (self._topic.latched or self.has_subscribers):
            return
        try:
            publisher.publish(encode(message))
        except RuntimeError as error:
            raise TransportError(f"{self.name} cannot be published: {error}") from None

    def flush(self, timeout_s: float) -> None:
        """Wait until all reliable subscribers have what was published, for at most ``timeout_s`` seconds."""
        publisher = self._publisher
        if publisher is None:
            return
        try:
            confirmed = publisher.wait_for_all_acked(Duration(seconds=timeout_s))
        except RuntimeError:  # not supported by every middleware
            return
        if not confirmed:
            log.info("%s: not every subscriber has confirmed the last message", self.name)

    def close(self) -> None:
        """Stop publishing; may be called twice."""
        with self._lock:
            publisher, self._publisher = self._publisher, None
        if publisher is not None:
            self._node.destroy_publisher(publisher)


class _Reception(Generic[M]):
    """A subscription, whose messages are decoded and passed on."""

    def __init__(self, node: Node, topic: Topic[M], kind: Any, clock: Clock, send: Deliver[M]) -> None:
        self._node = node
        name = resolved(node, topic)
        self._intake = Intake(topic, name, clock, send)
        with _refusals(name):
            self._subscription: Any = node.create_subscription(
                kind,
                _given(node, topic),
                self._on_message,
                subscription_qos(topic),
                qos_overriding_options=_overriding(node, name),
                raw=True,
            )

    def close(self) -> None:
        """Stop receiving."""
        self._node.destroy_subscription(self._subscription)

    def _on_message(self, raw: bytes, info: Mapping[str, int]) -> None:
        sent_ns = info.get("source_timestamp", 0)  # not provided by every middleware
        self._intake.take(raw, sent_s=sent_ns / 1e9 if sent_ns > 0 else None)


def resolved(node: Node, topic: Topic[Any]) -> str:
    """Return the full name of ``topic``, remapped.

    Raises:
        TransportError: Remapping results in a name that is not allowed.
    """
    with _refusals(topic.name):
        return str(node.resolve_topic_name(_given(node, topic)))


def _given(node: Node, topic: Topic[Any]) -> str:
    """Return the name for rclpy, which expands and remaps it; a topic beneath another is renamed with that."""
    beneath, name = topic.beneath, topic.ros_name
    if beneath is None or node.resolve_topic_name(name) != node.resolve_topic_name(name, only_expand=True):
        return name
    return topic.moved_with(resolved(node, beneath))


def _overriding(node: Node, name: str) -> QoSOverridingOptions | None:
    """Apply ``qos_overrides`` to the topic of this full name, if any are given."""
    given = node.get_parameters_by_prefix(f"qos_overrides.{name}")
    return QoSOverridingOptions.with_default_policies() if given else None


@contextmanager
def _refusals(name: str) -> Iterator[None]:
    """Convert rclpy's exceptions about the topic of this name to our errors."""
    try:
        yield
    except (InvalidTopicNameException, InvalidQosOverridesError, RuntimeError, ValueError) as error:
        raise TransportError(f"{name}: {' '.join(str(error).split())}") from None
