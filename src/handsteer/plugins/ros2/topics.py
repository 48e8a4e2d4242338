"""Messages by rclpy: one ROS 2 node for all nodes of this process, with serialised messages."""

import importlib
import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException, ParameterException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions

from handsteer.clock import Clock
from handsteer.errors import TransportError
from handsteer.messages import Topic, type_name
from handsteer.plugins.ros2.base_transport import (
    IMAGES,
    Profile,
    Ros2Transport,
    Take,
    are_players,
    offered,
    requested,
    types_of,
)
from handsteer.plugins.ros2.matching import End, Matching, node_of

_LOOK_S = 0.25
_PLAYED_KEPT = 200
_opening = threading.local()

log = logging.getLogger(__name__)


def publisher_qos(topic: Topic[Any]) -> QoSProfile:
    """Return the QoS offered by a publisher of ``topic``."""
    qos = _qos(offered(topic))
    if topic.lifespan_s is not None:
        qos.lifespan = Duration(seconds=topic.lifespan_s)
    return qos


def subscription_qos(topic: Topic[Any], profile: Profile | None = None) -> QoSProfile:
    """Return the QoS requested by a subscription to ``topic``, by ``profile`` if it is not the usual one."""
    return _qos(profile or requested(topic))


def is_opening() -> bool:
    """Return whether this thread is opening a publisher or a subscription, which declares its ``qos_overrides``."""
    return getattr(_opening, "now", False)


def _qos(profile: Profile) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=profile.depth,
        reliability=ReliabilityPolicy.RELIABLE if profile.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if profile.latched else DurabilityPolicy.VOLATILE,
    )


class RclpyTransport(Ros2Transport):
    """A :class:`~handsteer.transports.base.Transport` by a node of rclpy, on whose thread it delivers.

    A topic whose message type is missing in this ROS 2 is logged once and ignored.
    """

    # Fast DDS loses most raw images even on one machine.
    crosses_network = True
    errors = (RuntimeError,)

    def __init__(self, node: Node, clock: Clock) -> None:
        super().__init__(node.get_fully_qualified_name(), clock)
        self._node = node
        self._missing: set[str] = set()
        self._is_open = True
        self._matching = Matching(node)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the full names of the ROS 2 nodes that publish ``topic``; killed ones remain for a while."""
        found = self._node.get_publishers_info_by_topic(self._unresolved(topic)) if self._is_open else []
        kinds = types_of(topic)
        return sorted(node_of(one) for one in found if one.topic_type in kinds)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the topic's full name in the graph, remapped.

        Raises:
            TransportError: Remapping results in a name that is not allowed.
        """
        with _refusals(topic.name):
            return str(self._node.resolve_topic_name(self._unresolved(topic)))

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        self._is_open = False
        super().close()

    def _open_writer(self, name: str, topic: Topic[Any]) -> "_Writer | None":
        kind = self._class_of(name, topic)
        if kind is None:
            return None
        with _open(name):
            publisher = self._node.create_publisher(
                kind,
                self._unresolved(topic),
                publisher_qos(topic),
                # They would keep a reference in the executor, and with it the publisher and the type of its topic;
                # :meth:`check` names the other node, too.
                event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
                qos_overriding_options=self._overriding(name),
            )
        end = End(name, self._unresolved(topic), topic, publisher.qos_profile, publishes=True)
        return _Writer(self._node, publisher, self._matching.add(end))

    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: Take) -> Callable[[], None]:
        kind = self._class_of(name, topic)
        if kind is None:
            return lambda: None

        def on_message(raw: bytes, info: Mapping[str, int]) -> None:
            sent_ns = info.get("source_timestamp", 0)  # not provided by every middleware
            take(raw, b"", sent_ns / 1e9 if sent_ns > 0 else None)

        entity = None
        if topic.any_reliability and (profile.latched or not profile.reliable):
            entity = "transient_local" if profile.latched else "best_effort"

        def open_(on_message: Callable[[bytes, Mapping[str, int]], None], qos: QoSProfile) -> Any:
            with _open(name):
                return self._node.create_subscription(
                    kind,
                    self._unresolved(topic),
                    on_message,
                    qos,
                    event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
                    qos_overriding_options=self._overriding(name, entity),
                    raw=True,
                )

        qos = subscription_qos(topic, profile)
        if topic.type in IMAGES:
            images = _Images(self._node, self._unresolved(topic), qos, open_, on_message)
            live, end = images.live, images.close
        else:
            live = open_(on_message, qos)
            end = partial(self._node.destroy_subscription, live)
        # Of two, the second one takes what the first one does not; a reader of what is kept takes it from few.
        mine = End(name, self._unresolved(topic), topic, live.qos_profile, publishes=False)
        forget = self._matching.add(mine) if profile.latched == topic.latched else lambda: None

        def close() -> None:
            forget()
            end()

        return close

    def check(self) -> None:
        """Hear the Stops that others have kept, and log who is not connected to us, once; called regularly."""
        super().check()
        self._matching.check()

    def _subscribed_types(self, topic: Topic[Any]) -> set[str]:
        found = self._node.get_subscriptions_info_by_topic(self._unresolved(topic))
        return {one.topic_type for one in found}

    def _has_keepers(self, topic: Topic[Any]) -> bool:
        found = self._node.get_publishers_info_by_topic(self._unresolved(topic))
        return any(one.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL for one in found)

    def _unresolved(self, topic: Topic[Any]) -> str:
        """Return the name for rclpy, which expands and remaps it; a topic beneath another is renamed with that."""
        beneath, name, resolve = topic.beneath, topic.ros_name, self._node.resolve_topic_name
        if beneath is None or resolve(name) != resolve(name, only_expand=True):
            return name
        return topic.moved_with(self.topic_name(beneath))

    def _overriding(self, name: str, entity: str | None = None) -> QoSOverridingOptions | None:
        """Apply ``qos_overrides`` to the topic of this full name, if any are given; to a second end by its name."""
        given = self._node.get_parameters_by_prefix(f"qos_overrides.{name}")
        return QoSOverridingOptions.with_default_policies(entity_id=entity) if given else None

    def _class_of(self, name: str, topic: Topic[Any]) -> Any | None:
        kind = type_name(topic.type)
        found = ros_class(kind)
        package = kind.partition("/")[0]
        if found is None and package not in self._missing:
            self._missing.add(package)
            log.warning(
                "%s is left out: this ROS 2 lacks the package %s (sudo apt install ros-$ROS_DISTRO-%s)",
                name,
                package,
                package.replace("_", "-"),
            )
        return found


class _Images:
    """A subscription to images: the newest of a camera, but all of a player of bags, by a second subscription.

    Args:
        node: The node of rclpy, on whose thread everything is called.
        name: The topic, as rclpy is asked for it.
        qos: For the images of a camera.
        open_: Opens a subscription with a callback and a profile.
        on_message: Gets each image once.

    Attributes:
        live: The subscription to the newest.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        qos: QoSProfile,
        open_: Callable[[Callable[[bytes, Mapping[str, int]], None], QoSProfile], Any],
        on_message: Callable[[bytes, Mapping[str, int]], None],
    ) -> None:
        self._node, self._name, self._open, self._on_message = node, name, open_, on_message
        self._played: Any = None
        self._qos_of_played: QoSProfile | None = None
        self.live = open_(self._on_live, qos)
        # By a clock of its own: /clock may stand still.
        self._timer = node.create_timer(_LOOK_S, self._look, clock=RosClock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        self._node.destroy_timer(self._timer)
        for subscription in filter(None, (self.live, self._played)):
            self._node.destroy_subscription(subscription)

    def _on_live(self, raw: bytes, info: Mapping[str, int]) -> None:
        if self._played is None:
            self._on_message(raw, info)

    def _look(self) -> None:
        found = self._node.get_publishers_info_by_topic(self._name)
        is_played = are_players([f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in found])
        if not found:
            return  # the last images of a player that has ended may still wait
        are_reliable = all(one.qos_profile.reliability is ReliabilityPolicy.RELIABLE for one in found)
        wanted = _qos(Profile(are_reliable, latched=False, depth=_PLAYED_KEPT)) if is_played else None
        if wanted == self._qos_of_played:
            return
        if self._played is not None:
            self._node.destroy_subscription(self._played)
        self._qos_of_played = wanted
        self._played = None if wanted is None else self._open(self._on_message, wanted)


class _Writer:
    def __init__(self, node: Node, publisher: Any, on_close: Callable[[], None]) -> None:
        self._node = node
        self._publisher = publisher
        self._on_close = on_close

    @property
    def has_readers(self) -> bool:
        return bool(self._publisher.get_subscription_count() > 0)

    def write(self, raw: bytes) -> None:
        self._publisher.publish(raw)

    def flush(self, timeout_s: float) -> bool:
        try:
            return bool(self._publisher.wait_for_all_acked(Duration(seconds=timeout_s)))
        except RuntimeError:  # not supported by every middleware
            return True

    def close(self) -> None:
        self._on_close()
        self._node.destroy_publisher(self._publisher)


def ros_class(name: str) -> Any | None:
    """Return ROS 2's class for the type ``name``, as ``std_msgs/msg/String``; None if its package is missing."""
    package, kind, of = name.split("/")
    try:
        found = getattr(importlib.import_module(f"{package}.{kind}"), of, None)
    except ImportError:
        return None
    # A ROS 1 package of the same name does not have this type support.
    return found if hasattr(type(found), "__import_type_support__") else None


@contextmanager
def _open(name: str) -> Iterator[None]:
    """Open a publisher or a subscription of the topic of this name."""
    _opening.now = True
    try:
        with _refusals(name):
            yield
    finally:
        _opening.now = False


@contextmanager
def _refusals(name: str) -> Iterator[None]:
    """Convert rclpy's exceptions about the topic of this name to our errors."""
    try:
        yield
    except AssertionError:  # a depth that is a text
        raise TransportError(f"{name}: a value of qos_overrides has the wrong type") from None
    except (
        InvalidTopicNameException,
        InvalidQosOverridesError,
        ParameterException,
        RuntimeError,
        ValueError,
    ) as error:
        raise TransportError(f"{name}: {' '.join(str(error).split())}") from None
