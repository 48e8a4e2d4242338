"""Our profiles of quality of service in rclpy's terms."""

from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from handsteer.messages import Topic
from handsteer.transports.ros2.profiles import Profile, offered, requested


def publisher_qos(topic: Topic[Any]) -> QoSProfile:
    """Return what a publisher of ``topic`` offers."""
    qos = _qos(offered(topic))
    if topic.lifespan_s is not None:
        qos.lifespan = Duration(seconds=topic.lifespan_s)
    return qos


def subscription_qos(topic: Topic[Any]) -> QoSProfile:
    """Return what a subscription to ``topic`` requests."""
    return _qos(requested(topic))


def _qos(profile: Profile) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=profile.depth,
        reliability=ReliabilityPolicy.RELIABLE if profile.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if profile.latched else DurabilityPolicy.VOLATILE,
    )
