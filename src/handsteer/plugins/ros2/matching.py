"""Which nodes are not connected to our ends of topics, and why: rclpy itself names neither them nor the profiles."""

import logging
import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile

from handsteer.messages import Topic, type_name
from handsteer.plugins.ros2.base_transport import NO_DEADLINE, NO_LIVELINESS, unconnected
from handsteer.transports.base import UNNAMED

_COMPARE_S = 1.0
_NAME_DUE_S = 4.0
# Fast DDS's own endless time; that of ROS 2 is longer.
_ENDLESS_S = 2**31 - 1
_NS_PER_S = 1_000_000_000
_UNKNOWN, _REPORTED = "_NODE_NAME_UNKNOWN_", -math.inf

log = logging.getLogger(__name__)


class End(NamedTuple):
    """Our publisher of a topic, or our subscription to it.

    Attributes:
        name: Full name of the topic, as in the graph.
        asked: The same as rclpy is asked for it, which remaps it.
        topic: The topic.
        qos: The profile in use.
        publishes: Whether it is a publisher.
    """

    name: str
    asked: str
    topic: Topic[Any]
    qos: QoSProfile
    publishes: bool


class Matching:
    """Compares our ends of topics with those of other nodes.

    Args:
        node: The node of rclpy that has our ends.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._ends: dict[tuple[str, bool], End] = {}
        self._compared_s = -math.inf
        self._found: dict[tuple[int, ...], float] = {}

    def add(self, end: End) -> Callable[[], None]:
        """Compare ``end`` from now on, instead of one on the same topic; return a function that ends it."""
        key = (end.name, end.publishes)
        self._ends[key] = end

        def forget() -> None:
            if self._ends.get(key) is end:
                del self._ends[key]

        return forget

    def check(self) -> None:
        """Log who is not connected, once each; looks once a second at most."""
        now_s = time.monotonic()
        if now_s - self._compared_s < _COMPARE_S:
            return
        self._compared_s = now_s
        node = self._node
        for ours in tuple(self._ends.values()):
            look = node.get_subscriptions_info_by_topic if ours.publishes else node.get_publishers_info_by_topic
            ends = [(theirs, _misfits(ours, theirs)) for theirs in look(ours.asked)]
            reached = {node_of(theirs) for theirs, found in ends if not found} - {UNNAMED}
            for theirs, found in ends:
                if found and node_of(theirs) not in reached and self._is_due(theirs, now_s):
                    log.warning("%s", _explained(ours, theirs, found))

    def _is_due(self, theirs: Any, now_s: float) -> bool:
        """Return whether an end is to be reported now: once, and when its node's name is known, or will not be."""
        gid = tuple(theirs.endpoint_gid)
        since_s = self._found.setdefault(gid, now_s)
        if since_s == _REPORTED or (theirs.node_name == _UNKNOWN and now_s - since_s < _NAME_DUE_S):
            return False
        self._found[gid] = _REPORTED
        return True


def node_of(end: Any) -> str:
    """Return the full name of the node of an end of a topic, as rclpy describes it."""
    return UNNAMED if end.node_name == _UNKNOWN else f"{end.node_namespace.rstrip('/')}/{end.node_name}"


def _misfits(ours: End, theirs: Any) -> list[str]:
    """Return why our end is not connected to one of another node, in words; empty if it is."""
    known = {type_name(each) for each in (ours.topic.type, ours.topic.or_type) if each is not None}
    if theirs.topic_type not in known:
        return [f"ours has the type {type_name(ours.topic.type)}, theirs {theirs.topic_type}"]
    offer, request = (ours.qos, theirs.qos_profile) if ours.publishes else (theirs.qos_profile, ours.qos)
    # rclpy's own comparison takes an endless deadline for one where the other's is given as zero.
    found = [
        f"the publisher is {offered}, the subscriber wants {wanted}"
        for offered, wanted in zip(_in_words(offer), _in_words(request), strict=True)
        if (offered, wanted) in (("best effort", "reliable"), ("volatile", "transient local"))
    ]
    if _limit_s(offer.deadline) > _limit_s(request.deadline):
        found.append(NO_DEADLINE)
    if _is_manual(offer) < _is_manual(request) or (
        _limit_s(offer.liveliness_lease_duration) > _limit_s(request.liveliness_lease_duration)
    ):
        found.append(NO_LIVELINESS)
    return found


def _explained(ours: End, theirs: Any, reasons: list[str]) -> str:
    mine, other = ("publisher", "subscriber") if ours.publishes else ("subscriber", "publisher")
    profiles = f"(ours: {_profile(ours.qos, reasons)}; theirs: {_profile(theirs.qos_profile, reasons)})"
    return unconnected(ours.name, mine, other, node_of(theirs), f"{'; '.join(reasons)} {profiles}")


def _in_words(qos: QoSProfile) -> list[str]:
    return [str(each.name).lower().replace("_", " ") for each in (qos.reliability, qos.durability)]


def _profile(qos: QoSProfile, reasons: list[str]) -> str:
    """Return a profile in words, with its deadline and liveliness only where they are among the reasons."""
    words = _in_words(qos)
    if NO_DEADLINE in reasons:
        deadline_s = _limit_s(qos.deadline)
        words.append("no deadline" if math.isinf(deadline_s) else f"deadline {deadline_s:g} s")
    if NO_LIVELINESS in reasons:
        lease_s = _limit_s(qos.liveliness_lease_duration)
        kind = "manual by topic" if _is_manual(qos) else "automatic"
        words.append(f"{kind} liveliness" + ("" if math.isinf(lease_s) else f" within {lease_s:g} s"))
    return ", ".join(words)


def _is_manual(qos: QoSProfile) -> bool:
    return qos.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC


def _limit_s(duration: Duration) -> float:
    """Return a duration in seconds; infinite if it is not set, which rclpy gives as zero or as a huge number."""
    seconds = float(duration.nanoseconds) / _NS_PER_S
    return seconds if 0.0 < seconds < _ENDLESS_S else math.inf
