"""What a laser scanner sees, as the 3D view draws it."""

import math

import numpy as np

from handsteer.messages import LaserScan
from handsteer.types import Pose2D

MOST_POINTS = 180
"""Of a longer scan, only every so many rays are drawn."""


def scan_points(scan: LaserScan, robot: Pose2D) -> tuple[tuple[float, float], ...]:
    """Return x and y in the world, in metres, of what ``scan`` sees; rays that meet nothing are left out.

    The scanner counts as being in the middle of the robot and as looking ahead, as the simulated robot's does.

    Args:
        scan: The message.
        robot: Where the robot was when it was measured.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    step = max(1, math.ceil(len(ranges) / MOST_POINTS))
    numbers = np.arange(0, len(ranges), step)
    ranges = ranges[::step]
    meets = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    angles = robot.yaw + scan.angle_min + numbers[meets] * scan.angle_increment
    points = np.stack([robot.x + ranges[meets] * np.cos(angles), robot.y + ranges[meets] * np.sin(angles)], axis=1)
    return tuple((x, y) for x, y in points[np.isfinite(points).all(axis=1)].round(2).tolist())
