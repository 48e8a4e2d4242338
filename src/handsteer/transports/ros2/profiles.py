"""Quality of service offered and requested for each kind of topic, on any middleware.

Commands, signs and what follows from them are reliable. For images, a robot's state and its scans, publishers offer
reliable and subscribers request best effort, as in REP 2003 for sensor data: this matches every other endpoint, and
late messages are of no use to us. ``/clock`` is best effort.
"""

from dataclasses import dataclass
from typing import Any

from handsteer.messages import CameraInfo, ClockMessage, CompressedImage, Image, JointState, LaserScan, Odometry, Topic

IMAGES = (Image, CompressedImage)
"""Large messages, which have a lower priority than all others on a link."""
_SENSOR_DATA = (*IMAGES, CameraInfo, Odometry, JointState, LaserScan)
# Enough to resend lost parts before the next image arrives; older images are of no use.
_IMAGES_KEPT = 3


@dataclass(frozen=True)
class Profile:
    """The quality of service of one endpoint of a topic; the history is always keep last.

    Attributes:
        reliable: Reliable if true, else best effort.
        latched: Transient local if true, else volatile.
        depth: How many messages are kept.
    """

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
