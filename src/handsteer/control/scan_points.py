"""Converts a laser scan to obstacle points in the robot's base frame."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import gaps
from handsteer.messages import LaserScan

Points = NDArray[np.float64]
"""(N, 2): x forward and y left in the robot's base frame, in metres."""

MOST_POINTS = 1440
"""Limit for one scan; of a longer one, the nearest of each few neighbouring rays is kept."""

# A reading deeper inside the footprint is a part of the robot, such as a post in view of the scanner.
_SKIN_M = 0.05


def points_of(scan: LaserScan, rule: CollisionMonitorConfig) -> Points | None:
    """Return the points that the scanner measured; None if the scan is invalid or empty.

    Ranges follow REP 117 and ``sensor_msgs/LaserScan``: beyond ``range_max`` and +inf is free; -inf is too near to be
    measured, so it counts as touching the robot; NaN and values below ``range_min`` are no readings.

    Args:
        scan: The message, of any size.
        rule: Pose of the scanner on the robot, and size of the footprint.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64).reshape(-1)
    figures = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
    if not all(map(math.isfinite, figures)) or not scan.angle_increment or scan.range_max <= 0:
        return None
    touches = np.isneginf(ranges)
    found = (ranges >= max(0.0, scan.range_min)) & (ranges <= scan.range_max) & (ranges > 0)
    if not (touches | found | (ranges > scan.range_max)).any():
        return None
    kept, distances = _thinned(np.where(touches, 0.0, np.where(found, ranges, np.inf)))
    angles = rule.scan_yaw + scan.angle_min + kept * scan.angle_increment
    points = _along(angles, distances) + np.array([rule.scan_x, rule.scan_y])
    gap = gaps(points[:, 0], points[:, 1], rule)
    is_touch = distances == 0.0
    seen = points[~is_touch & (gap > -_SKIN_M)]
    return np.concatenate([seen, _on_the_edge(angles[is_touch], rule)])


def _thinned(ranges: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the indices of rays that hit something, at most :data:`MOST_POINTS`, and their ranges."""
    if len(ranges) > MOST_POINTS:
        each = math.ceil(len(ranges) / MOST_POINTS)
        groups = np.pad(ranges, (0, -len(ranges) % each), constant_values=np.inf).reshape(-1, each)
        nearest = groups.argmin(axis=1)
        numbers, ranges = np.arange(len(groups)) * each + nearest, groups[np.arange(len(groups)), nearest]
    else:
        numbers = np.arange(len(ranges))
    meets = np.isfinite(ranges)
    return numbers[meets].astype(np.float64), ranges[meets]


def _along(angles: NDArray[np.float64], distances: NDArray[np.float64]) -> Points:
    return np.stack([distances * np.cos(angles), distances * np.sin(angles)], axis=1)


def _on_the_edge(angles: NDArray[np.float64], rule: CollisionMonitorConfig) -> Points:
    """Return where rays from the base frame leave the footprint, slightly inside."""
    cos, sin = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        ahead = np.where(cos >= 0, rule.front, rule.back) / np.abs(cos)
        aside = rule.side / np.abs(sin)
    return _along(angles, np.minimum(ahead, aside) * (1 - 1e-6))
