"""The points of a laser scan for the 3D view."""

import math

import numpy as np

from handsteer.messages import LaserScan
from handsteer.types import Pose2D

MOST_POINTS = 180
"""Longer scans are subsampled."""


def scan_points(scan: LaserScan, robot: Pose2D) -> tuple[tuple[float, float], ...]:
    """Return x and y in the world, in metres, of the points of ``scan``; rays without a return are left out.

    ``robot`` is the robot's pose at the time of the scan. The scanner is assumed at its centre, facing forward, as on
    the simulated robot.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    step = max(1, math.ceil(len(ranges) / MOST_POINTS))
    numbers = np.arange(0, len(ranges), step)
    ranges = ranges[::step]
    meets = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    angles = robot.yaw + scan.angle_min + numbers[meets] * scan.angle_increment
    points = np.stack([robot.x + ranges[meets] * np.cos(angles), robot.y + ranges[meets] * np.sin(angles)], axis=1)
    return tuple((x, y) for x, y in points[np.isfinite(points).all(axis=1)].round(2).tolist())
