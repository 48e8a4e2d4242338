"""Quality of service: what we offer and request for each kind of topic, whatever carries it.

Commands, signs and what follows from them are reliable. Images and ``/clock`` are best effort, as ROS 2's
``sensor_data`` has it: a late one is of no use. Of a robot's state and its scans we offer reliable and request best
effort, which fits with any robot.
"""

from dataclasses import dataclass
from typing import Any

from handsteer.messages import ClockMessage, CompressedImage, Image, JointState, LaserScan, Odometry, Topic

_SENSOR_DATA = (Image, CompressedImage, ClockMessage)
_STATE = (Odometry, JointState, LaserScan)


@dataclass(frozen=True)
class Profile:
    """The quality of service of one end of a topic; the history is always to keep the last ones.

    Attributes:
        reliable: Whether it is reliable, rather than best effort.
        latched: Whether it is transient local, rather than volatile.
        depth: How many messages are kept.
    """

    reliable: bool
    latched: bool
    depth: int


def offered(topic: Topic[Any]) -> Profile:
    """Return what a publisher of ``topic`` offers."""
    return Profile(topic.type not in _SENSOR_DATA, topic.latched, topic.depth)


def requested(topic: Topic[Any]) -> Profile:
    """Return what a subscriber of ``topic`` requests."""
    return Profile(topic.type not in (*_SENSOR_DATA, *_STATE), topic.latched, topic.depth)
