"""Quality of service: what we offer and request for each kind of topic, whatever carries it.

Commands, signs and what follows from them are reliable. Of images, a robot's state and its scans we offer reliable and
request best effort, as REP 2003 has it for what sensors give: that fits with whoever is at the other end, and for us a
late one is of no use. ``/clock`` is best effort.
"""

from dataclasses import dataclass
from typing import Any

from handsteer.messages import CameraInfo, ClockMessage, CompressedImage, Image, JointState, LaserScan, Odometry, Topic

IMAGES = (Image, CompressedImage)
"""What is large, and gives way to all else on the same link."""
_SENSOR_DATA = (*IMAGES, CameraInfo, Odometry, JointState, LaserScan)
# Enough for what is lost on the way to be sent again before the next one has come; older ones are of no use to anybody.
_IMAGES_KEPT = 3


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
    depth = max(topic.depth, _IMAGES_KEPT) if topic.type in IMAGES else topic.depth
    return Profile(topic.type is not ClockMessage, topic.latched, depth)


def requested(topic: Topic[Any]) -> Profile:
    """Return what a subscriber of ``topic`` requests."""
    return Profile(topic.type not in (*_SENSOR_DATA, ClockMessage), topic.latched, topic.depth)
