"""The room that the robot takes up: a rectangle around its base frame, and how it sweeps over the floor."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.velocity import Velocity

Array = NDArray[np.float64]


def gaps(x: Array, y: Array, rule: CollisionMonitorConfig) -> Array:
    """Return how far points at ``x`` and ``y`` in the base frame are from the robot, in metres; within, it is below 0.

    Args:
        x: Forward, in metres, of any shape.
        y: To the left, of the same shape.
        rule: How far the robot reaches.
    """
    along = np.maximum(x - rule.front, -x - rule.back)
    across = np.abs(y) - rule.side
    outside: Array = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return outside + np.minimum(np.maximum(along, across), 0.0)


def reach_m(rule: CollisionMonitorConfig) -> float:
    """Return how far the robot's farthest corner is from its base frame."""
    return math.hypot(max(rule.front, rule.back), rule.side)


def fastest_mps(velocity: Velocity, rule: CollisionMonitorConfig) -> float:
    """Return the speed of the corner that is the fastest, for a robot that moves at ``velocity``."""
    v, w = velocity.linear_mps, velocity.angular_radps
    return max(math.hypot(abs(v) + abs(w) * rule.side, w * x) for x in (rule.front, rule.back))


def on_a_circle(velocity: Velocity, times_s: Array) -> Array:
    """Return where a robot that goes on at a steady ``velocity`` is at ``times_s``, (K,): (K, 3) x, y and yaw."""
    turned = velocity.angular_radps * times_s
    # sin(a) / a holds for a straight line, too.
    chord = velocity.linear_mps * times_s * np.sinc(turned / math.tau)
    return np.stack([chord * np.cos(turned / 2), chord * np.sin(turned / 2), turned], axis=1)


def braking(moving: Velocity, told: Velocity, rule: CollisionMonitorConfig, delay_s: float, times_s: Array) -> Array:
    """Return where a robot is that is told ``told``, and to stand after ``delay_s`` seconds: (K, 3) x, y and yaw.

    Args:
        moving: How it moves now; it changes that as fast as it brakes.
        told: What it is told now.
        rule: Its brakes.
        delay_s: When it is told to stand.
        times_s: (K,), at equal intervals from 0.
    """
    v = _speeds(moving.linear_mps, told.linear_mps, rule.deceleration, delay_s, times_s)
    w = _speeds(moving.angular_radps, told.angular_radps, rule.angular_deceleration, delay_s, times_s)
    step_s = times_s[1]
    yaw = np.concatenate([[0.0], np.cumsum((w[1:] + w[:-1]) / 2 * step_s)])
    way, middle = (v[1:] + v[:-1]) / 2 * step_s, (yaw[1:] + yaw[:-1]) / 2
    x, y = np.cumsum(way * np.cos(middle)), np.cumsum(way * np.sin(middle))
    return np.stack([np.concatenate([[0.0], x]), np.concatenate([[0.0], y]), yaw], axis=1)


def seen_from(poses: Array, points: Array) -> tuple[Array, Array]:
    """Return x and y, (K, N) each, of ``points`` (N, 2) as a robot sees them from ``poses`` (K, 3) x, y and yaw."""
    x, y, yaw = (poses[:, number, None] for number in range(3))
    dx, dy = points[:, 0] - x, points[:, 1] - y
    return dx * np.cos(yaw) + dy * np.sin(yaw), dy * np.cos(yaw) - dx * np.sin(yaw)


def _speeds(moving: float, told: float, most: float, delay_s: float, times_s: Array) -> Array:
    before, after = most * np.minimum(times_s, delay_s), most * np.maximum(times_s - delay_s, 0.0)
    speeds: Array = moving + np.clip(told - moving, -before, before)
    return speeds - np.clip(speeds, -after, after)
