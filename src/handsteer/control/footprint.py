"""The robot's footprint, a rectangle around its base frame, and the poses it passes through while moving."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.types import Velocity

Array = NDArray[np.float64]

_STRAIGHT_RADPS = 1e-9


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


def braking(moving: Velocity, told: Velocity, rule: CollisionMonitorConfig, delay_s: float, times_s: Array) -> Array:
    """Return the poses of a robot that is commanded ``told``, and zero after ``delay_s`` seconds: (K, 3) x, y and yaw.

    Args:
        moving: Its current velocity, which changes at the deceleration of ``rule``.
        told: The velocity commanded now.
        rule: Decelerations.
        delay_s: When zero is commanded.
        times_s: (K,), at equal intervals from 0.
    """
    early_s = np.minimum(times_s, delay_s)
    late_s = times_s - early_s
    v = _speeds(moving.linear_mps, told.linear_mps, rule.deceleration, early_s, late_s)
    poses = np.zeros((len(times_s), 3))
    half_step_s = times_s[1] / 2
    way = (v[1:] + v[:-1]) * half_step_s
    if not (moving.angular_radps or told.angular_radps):
        way.cumsum(out=poses[1:, 0])
        return poses
    w = _speeds(moving.angular_radps, told.angular_radps, rule.angular_deceleration, early_s, late_s)
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


def after(velocity: Velocity, seconds: float, points: Array) -> Array:
    """Return ``points``, (N, 2), relative to a robot that has moved at constant ``velocity`` for ``seconds``."""
    if velocity.is_zero or not seconds:
        return points
    x, y, yaw = on_a_circle(velocity, np.array([seconds]))[0].tolist()
    cos, sin = math.cos(yaw), math.sin(yaw)
    seen: Array = np.dot(points - (x, y), np.array(((cos, -sin), (sin, cos))))
    return seen


def _speeds(moving: float, told: float, most: float, early_s: Array, late_s: Array) -> Array:
    """Return the speeds on the way to ``told`` for ``early_s``, then braking for ``late_s``, both at rate ``most``."""
    gap, sign = abs(told - moving), math.copysign(most, told - moving)
    speeds: Array = moving + np.minimum(early_s, gap / most) * sign if gap else np.full(len(early_s), told)
    brakes = late_s * most
    return speeds - np.minimum(np.maximum(speeds, -brakes), brakes)
