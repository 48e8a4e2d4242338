"""Finds out that a scanner repeats one scan while the robot moves, or that scans are of several scanners."""

import math

import numpy as np

from handsteer.config import CollisionMonitorConfig
from handsteer.messages import NO_STAMP, SAME_SCANNER_RAD, LaserScan, Pose, yaw_of

_MOVED_M, _TURNED_RAD = 0.1, 0.1
# Walls that are parallel to a straight way look the same all along it; at this angle and distance nothing can be one.
_AHEAD_RAD, _NEAR_M = math.radians(5), 4.0
_MIXED_S = 2.0


class MixedScans:
    """Compares what scans cover: of several scanners on one topic, or of sectors, each hides what the others see."""

    def __init__(self) -> None:
        self._covered: tuple[str, float, float] | None = None
        self._changed_s = -math.inf

    def note(self, scan: LaserScan, now_s: float) -> bool:
        """Return whether the frame or the angles of the scans have changed in the 2 s before ``now_s``."""
        before, last_rad = self._covered, scan.angle_min + scan.angle_increment * (len(scan.ranges) - 1)
        frame, lowest, highest = scan.header.frame_id, min(scan.angle_min, last_rad), max(scan.angle_min, last_rad)
        self._covered = frame, lowest, highest
        if before is not None:
            is_same = before[0] == frame and math.dist(before[1:], (lowest, highest)) <= SAME_SCANNER_RAD
            self._changed_s = self._changed_s if is_same else now_s
        return now_s - self._changed_s < _MIXED_S


class FrozenScans:
    """Compares scans, bit for bit, with the motion that odometry reports.

    Real scans have noise, and never repeat. Those of a simulated scanner without noise may, where all that it sees
    looks the same from elsewhere: a scan that shows one distance only, or nothing ahead or behind, is never frozen.
    """

    def __init__(self) -> None:
        self._scan: LaserScan | None = None
        self._pose: Pose | None = None
        self._since: Pose | None = None

    def move(self, pose: Pose) -> None:
        """Store where the robot is by its odometry."""
        self._pose = pose

    def note(self, scan: LaserScan, rule: CollisionMonitorConfig) -> tuple[bool, bool]:
        """Return whether ``scan`` is the same as the one before, and whether it is frozen.

        With the same stamp, it is the same message again, which is old, but not frozen; without one, that is not known.
        """
        before, self._scan = self._scan, scan
        if before is None or self._since is None or not _is_same(before, scan):
            self._since = self._pose
            return False, False
        is_again = before.header.stamp == scan.header.stamp != NO_STAMP
        if self._pose is None or is_again:
            return True, False
        moved_m = math.dist(_place(self._pose), _place(self._since))
        turned_rad = abs(math.remainder(yaw_of(self._pose.orientation) - yaw_of(self._since.orientation), math.tau))
        has_moved = moved_m > _MOVED_M and _sees_ahead(scan, rule)
        return True, has_moved or (turned_rad > _TURNED_RAD and _sees_shapes(scan))


def _is_same(one: LaserScan, other: LaserScan) -> bool:
    return np.asarray(one.ranges).tobytes() == np.asarray(other.ranges).tobytes()


def _place(pose: Pose) -> tuple[float, float]:
    return pose.position.x, pose.position.y


def _sees_shapes(scan: LaserScan) -> bool:
    """Return whether it shows several distances."""
    ranges = np.asarray(scan.ranges)
    return len(np.unique(ranges[np.isfinite(ranges) & (ranges < scan.range_max)])) > 1


def _sees_ahead(scan: LaserScan, rule: CollisionMonitorConfig) -> bool:
    """Return whether it shows shapes, one of them near, ahead or behind."""
    ranges = np.asarray(scan.ranges)
    angles = rule.scan_yaw + scan.angle_min + np.arange(len(ranges)) * scan.angle_increment
    is_along = np.abs(np.sin(angles)) < math.sin(_AHEAD_RAD)
    near = np.isfinite(ranges) & (ranges > scan.range_min) & (ranges < min(scan.range_max, _NEAR_M))
    return bool((is_along & near).any()) and _sees_shapes(scan)
