"""The robot's footprint, a rectangle around its base frame: its poses while moving, and points of a scan near it."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.messages import LaserScan
from handsteer.types import Velocity

Array = NDArray[np.float64]
Points = NDArray[np.float64]
"""(N, 2): x forward and y left in the robot's base frame, in metres."""

MOST_POINTS = 1440
"""Limit for one scan; of a longer one, the nearest of each few neighbouring rays is kept."""

# A reading deeper inside the footprint is a part of the robot, such as a post in view of the scanner.
_SKIN_M = 0.05

_STRAIGHT_RADPS = 1e-9

# Three turns; scanners make one at most, from any direction.
_MOST_RAD = 6 * math.pi


def gaps(x: Array, y: Array, rule: CollisionMonitorConfig) -> Array:
    """Return the distances of points from the footprint, in metres; negative inside it.

    Args:
        x: Forward in the base frame, in metres, of any shape.
        y: To the left, of the same shape.
        rule: Size of the footprint.
    """
    along, across = _beyond(x, y, rule)
    ahead, aside = np.maximum(along, 0.0), np.maximum(across, 0.0)
    outside: Array = np.sqrt(ahead * ahead + aside * aside)  # same as np.hypot, in a third of the time
    return outside + np.minimum(np.maximum(along, across), 0.0)


def least_gaps(x: Array, y: Array, rule: CollisionMonitorConfig) -> Array:
    """Return lower bounds of :func:`gaps`, in a third of the time."""
    along, across = _beyond(x, y, rule)
    return np.maximum(along, across, out=along)


def _beyond(x: Array, y: Array, rule: CollisionMonitorConfig) -> tuple[Array, Array]:
    """Return the distances of points beyond the front or back, and beyond the sides."""
    along, across = np.abs(x - (rule.front - rule.back) / 2), np.abs(y)
    along -= (rule.front + rule.back) / 2
    across -= rule.side
    return along, across


def reach_m(rule: CollisionMonitorConfig) -> float:
    """Return the distance of the farthest corner from the base frame, in metres."""
    return math.hypot(max(rule.front, rule.back), rule.side)


def fastest_mps(velocity: Velocity, rule: CollisionMonitorConfig) -> float:
    """Return the speed of the fastest corner of a robot that moves at ``velocity``, in m/s."""
    v, w = velocity.linear_mps, velocity.angular_radps
    return max(math.hypot(abs(v) + abs(w) * rule.side, w * x) for x in (rule.front, rule.back))


def on_a_circle(velocity: Velocity, times_s: Array) -> Array:
    """Return the poses at ``times_s``, (K,), at constant ``velocity``: (K, 3) x, y and yaw."""
    v, w = velocity.linear_mps, velocity.angular_radps
    poses = np.zeros((len(times_s), 3))
    if abs(w) < _STRAIGHT_RADPS:
        poses[:, 0] = v * times_s
        return poses
    half = (w / 2) * times_s
    sine = np.sin(half)
    chord = sine * (2 * v / w)
    np.multiply(chord, np.cos(half), out=poses[:, 0])
    np.multiply(chord, sine, out=poses[:, 1])
    np.add(half, half, out=poses[:, 2])
    return poses


def braking(moving: Velocity, target: Velocity, rule: CollisionMonitorConfig, delay_s: float, times_s: Array) -> Array:
    """Return the poses of a robot commanded ``target``, and zero after ``delay_s`` seconds: (K, 3) x, y and yaw.

    Args:
        moving: Its current velocity, which changes at the deceleration of ``rule``.
        target: The velocity commanded now.
        rule: Decelerations.
        delay_s: When zero is commanded.
        times_s: (K,), at equal intervals from 0.
    """
    early_s = np.minimum(times_s, delay_s)
    late_s = times_s - early_s
    v = _speeds(moving.linear_mps, target.linear_mps, rule.deceleration, early_s, late_s)
    poses = np.zeros((len(times_s), 3))
    half_step_s = times_s[1] / 2
    way = (v[1:] + v[:-1]) * half_step_s
    if not (moving.angular_radps or target.angular_radps):
        way.cumsum(out=poses[1:, 0])
        return poses
    w = _speeds(moving.angular_radps, target.angular_radps, rule.angular_deceleration, early_s, late_s)
    turned = (w[1:] + w[:-1]) * half_step_s
    yaw = turned.cumsum(out=poses[1:, 2])
    middle = yaw - turned / 2
    (way * np.cos(middle)).cumsum(out=poses[1:, 0])
    (way * np.sin(middle)).cumsum(out=poses[1:, 1])
    return poses


def seen_from(poses: Array, points: Array) -> tuple[Array, Array]:
    """Transform ``points`` (N, 2) to the frames of ``poses`` (K, 3) x, y and yaw; return x and y, (K, N) each."""
    x, y, yaw = poses[:, 0], poses[:, 1], poses[:, 2]
    cos, sin = np.cos(yaw), np.sin(yaw)
    turns = np.empty((2 * len(poses), 2))
    turns[: len(poses), 0] = turns[len(poses) :, 1] = cos
    turns[: len(poses), 1] = sin
    turns[len(poses) :, 0] = -sin
    seen = np.dot(turns, points.T)
    seen[: len(poses)] -= (x * cos + y * sin)[:, None]
    seen[len(poses) :] -= (y * cos - x * sin)[:, None]
    return seen[: len(poses)], seen[len(poses) :]


def drifted(seen: tuple[Array, Array], poses: Array, times_s: Array, drift: Points) -> tuple[Array, Array]:
    """Return what :func:`seen_from` returned, of points that move at ``drift`` (N, 2) m/s, at ``times_s`` (K,)."""
    x, y = seen_from(np.stack([np.zeros(len(poses)), np.zeros(len(poses)), poses[:, 2]], axis=1), drift)
    return seen[0] + times_s[:, None] * x, seen[1] + times_s[:, None] * y


def quickest_mps(drift: Points | None) -> float:
    """Return the speed of the quickest of points that move at ``drift`` (N, 2) m/s; 0 if it is None."""
    return 0.0 if drift is None or not len(drift) else float(np.sqrt((drift * drift).sum(axis=1).max()))


def after(velocity: Velocity, seconds: float, points: Array) -> Array:
    """Return ``points``, (N, 2), relative to a robot that has moved at constant ``velocity`` for ``seconds``."""
    if velocity.is_zero or not seconds:
        return points
    x, y, yaw = on_a_circle(velocity, np.array([seconds]))[0].tolist()
    cos, sin = math.cos(yaw), math.sin(yaw)
    seen: Array = np.dot(points - (x, y), np.array(((cos, -sin), (sin, cos))))
    return seen


def _speeds(moving: float, target: float, most: float, early_s: Array, late_s: Array) -> Array:
    """Return the speeds on the way to ``target`` for ``early_s``, then braking for ``late_s``, at rate ``most``."""
    gap, sign = abs(target - moving), math.copysign(most, target - moving)
    speeds: Array = moving + np.minimum(early_s, gap / most) * sign if gap else np.full(len(early_s), target)
    brakes = late_s * most
    return speeds - np.minimum(np.maximum(speeds, -brakes), brakes)


def points_of(scan: LaserScan, rule: CollisionMonitorConfig) -> Points | None:
    """Return the points that the scanner measured; None if the scan is invalid or empty.

    Ranges follow REP 117 and ``sensor_msgs/LaserScan``: beyond ``range_max`` and +inf is free; -inf is too near to be
    measured, so it counts as touching the robot; NaN and values below ``range_min`` are not readings.

    Args:
        scan: The message, of any size.
        rule: Pose of the scanner on the robot, and size of the footprint.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64).reshape(-1)
    figures = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
    if not all(map(math.isfinite, figures)) or not scan.angle_increment or scan.range_max <= max(0.0, scan.range_min):
        return None
    if max(abs(scan.angle_min), abs(scan.angle_increment) * len(ranges)) > _MOST_RAD:
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
