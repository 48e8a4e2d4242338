"""Rotations, colours and trees of links, as the 3D view needs them."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from handsteer.messages import Quaternion
from handsteer.robots.description import Joint, Vector

Rotation = NDArray[np.float64]
"""(3, 3)."""


def about_axis(axis: Vector, angle: float) -> Rotation:
    """Return the rotation by ``angle`` in rad about ``axis``, of any length (Rodrigues' formula); none for axis 0."""
    length = math.hypot(*axis)
    if not length:
        return np.eye(3)
    x, y, z = (part / length for part in axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return turn


def from_rpy(rpy: Vector) -> Rotation:
    """Return the rotation of roll, pitch and yaw in rad about fixed axes (REP 103)."""
    roll, pitch, yaw = rpy
    return about_axis((0, 0, 1), yaw) @ about_axis((0, 1, 0), pitch) @ about_axis((1, 0, 0), roll)


def from_quaternion(quaternion: Quaternion) -> Rotation:
    """Return the rotation of ``quaternion``, of any length; none for the all-zero one that some senders leave."""
    axis = (quaternion.x, quaternion.y, quaternion.z)
    return about_axis(axis, 2 * math.atan2(math.hypot(*axis), quaternion.w))


def css_colour(rgb: Iterable[float]) -> str:
    """Return a CSS colour for red, green and blue of 0 to 1; what is beyond is cut off."""
    return "#" + "".join(f"{round(255 * max(0.0, min(part, 1.0))):02x}" for part in rgb)


def parents_first(joints: Iterable[Joint]) -> Iterator[Joint]:
    """Yield each joint after the one that holds its parent link; joints in a circle are left out."""
    waiting = list(joints)
    while waiting:
        held = {joint.child for joint in waiting}
        ready = [joint for joint in waiting if joint.parent not in held]
        if not ready:
            return
        yield from ready
        waiting = [joint for joint in waiting if joint.parent in held]
