"""The room that the robot takes up: a rectangle around its base frame, and how it sweeps over the floor."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.sign_control import Velocity

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


def seen_later(x: Array, y: Array, velocity: Velocity, times_s: Array) -> tuple[Array, Array]:
    """Return where a robot that moves at a steady ``velocity`` has points that do not move.

    Args:
        x: (N,), forward of the base frame now, in metres.
        y: (N,), to the left of it now.
        velocity: Along a circle, whose middle is beside the robot.
        times_s: (K,), in seconds from now.

    Returns:
        x and y in the base frame of each time, (K, N) each.
    """
    v, w = velocity.linear_mps, velocity.angular_radps
    turned = (w * times_s)[:, None]
    # sin(a) / a and (1 - cos(a)) / a hold for a straight line, too.
    half = turned / 2
    chord = v * times_s[:, None] * np.sinc(half / np.pi)
    dx, dy = x - chord * np.cos(half), y - chord * np.sin(half)
    return dx * np.cos(turned) + dy * np.sin(turned), dy * np.cos(turned) - dx * np.sin(turned)
