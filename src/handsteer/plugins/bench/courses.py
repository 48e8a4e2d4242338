"""Courses of the bench: the ideal path through the gates of a world, free space next to it, and its difficulty."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import BenchError
from handsteer.robots.world import Gate, Stop, Thing, World, load_world
from handsteer.types import Pose2D

Array = NDArray[np.float64]

COURSES = ("slalom", "figure-eight", "stop-line", "parking", "maze")
"""The shipped worlds that the bench drives by default."""

HALF_WIDTH_M = 0.245
"""Half the robot's width, wheels included."""

_STEP_M = 0.02
_RUN_OUT_M = 1.0
_WIDEST_M = 1.0
_BACK_M, _AHEAD_M = 0.6, 1.5


@dataclass(frozen=True)
class Path:
    """A curve on the floor in steps of 2 cm.

    Attributes:
        points: (N, 2) metres.
        headings: (N,) radians, without jumps.
        curvatures: (N,) 1/m, left positive.
        s: (N,) metres along the curve.
    """

    points: Array
    headings: Array
    curvatures: Array
    s: Array

    @classmethod
    def through(cls, corners: Array) -> "Path":
        """Return a smooth curve (a cubic spline with continuous curvature) through (K, 2) points, K >= 2."""
        chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        fine = _spline(chord, corners, np.linspace(0.0, chord[-1], max(2, int(chord[-1] / _STEP_M * 4))))
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
        s = np.linspace(0.0, lengths[-1], max(3, round(lengths[-1] / _STEP_M)))
        points = np.stack([np.interp(s, lengths, fine[:, axis]) for axis in range(2)], axis=1)
        slope = np.gradient(points, s, axis=0)
        headings = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))
        return cls(points, headings, np.gradient(headings, s), s)

    @property
    def length_m(self) -> float:
        """Length in metres."""
        return float(self.s[-1])

    def index(self, s_m: float) -> int:
        """Return the index of the point ``s_m`` along the curve."""
        return min(max(0, round(s_m / float(self.s[1]))), len(self.s) - 1)

    def nearest(self, x: float, y: float, near_m: float) -> int:
        """Return the index of the point nearest to x, y, among those 0.6 m before to 1.5 m after ``near_m``."""
        low, high = self.index(near_m - _BACK_M), self.index(near_m + _AHEAD_M) + 1
        part = self.points[low:high]
        return low + int(np.argmin((part[:, 0] - x) ** 2 + (part[:, 1] - y) ** 2))


@dataclass(frozen=True)
class Course:
    """A world with gates, as the bench drives it.

    Attributes:
        name: Its name, or the path of its file.
        world: The world.
        path: The ideal path, from the robot's start.
    """

    name: str
    world: World
    path: Path

    @property
    def gates(self) -> tuple[Gate, ...]:
        """The gates, in order."""
        return self.world.gates

    @property
    def stop_m(self) -> float | None:
        """Where on the path the robot has to stop, in metres; None if the course ends at its last gate."""
        return self.path.length_m - _RUN_OUT_M if self.world.stop else None

    @cached_property
    def ends_m(self) -> tuple[float, float]:
        """Where on the path the measured part starts and ends, in metres."""
        start = self._on_path(self.gates[0])
        return start, self.stop_m if self.stop_m is not None else self._on_path(self.gates[-1])

    @cached_property
    def length_m(self) -> float:
        """Length of the measured part of the ideal path, in metres."""
        return self.ends_m[1] - self.ends_m[0]

    @cached_property
    def clearances(self) -> Array:
        """(N,) free width between robot and obstacles on the nearer side of each point of the path, 0 to 1 m."""
        free = np.full(len(self.path.s), _WIDEST_M)
        for thing in self.world.obstacles:
            free = np.minimum(free, _distances(self.path.points, thing) - HALF_WIDTH_M)
        return np.asarray(np.maximum(free, 0.0))

    @cached_property
    def difficulty(self) -> float:
        """Index of difficulty of the measured part: the integral of ds over the free width for the robot's centre.

        The steering law (J. Accot and S. Zhai, CHI 1997) applied to the path of a robot between obstacles, as the
        index of J. Storms and D. Tilbury, "A new difficulty index for teleoperated robots driving through obstacles"
        (Journal of Intelligent & Robotic Systems 90, 2018), which also grows with narrower and longer ways; without
        dimension.
        """
        low, high = (self.path.index(end) for end in self.ends_m)
        widths = np.maximum(2 * self.clearances[low:high], 0.05)
        return float(np.sum(float(self.path.s[1]) / widths))

    def _on_path(self, gate: Gate) -> float:
        middle = (np.array(gate.left) + np.array(gate.right)) / 2
        return float(self.path.s[int(np.argmin(np.linalg.norm(self.path.points - middle, axis=1)))])


def open_course(name_or_path: str) -> Course:
    """Return a course by the name of a shipped world, or from a world file with gates.

    Raises:
        BenchError: The world has no gates.
        WorldError: There is no such world, or it cannot be read.
    """
    world = load_world(name_or_path)
    if len(world.gates) < 2:
        raise BenchError(f"world {name_or_path!r} is not a course: it needs at least two gates, a start and a finish")
    return Course(name_or_path, world, Path.through(_corners(world)))


def off_stop(stop: Stop, pose: Pose2D) -> tuple[float, float]:
    """Return how far beyond the place to stop at, and how far left of it, ``pose`` is, in metres."""
    x, y = pose.x - stop.position[0], pose.y - stop.position[1]
    cosine, sine = math.cos(stop.yaw), math.sin(stop.yaw)
    return x * cosine + y * sine, y * cosine - x * sine


def _corners(world: World) -> Array:
    """Return the (K, 2) points that the ideal path goes through, from the robot's start to a little after the end."""
    if world.path:
        way = [np.array(point) for point in world.path]
    else:
        way = [(np.array(gate.left) + np.array(gate.right)) / 2 for gate in world.gates]
    if world.stop:
        end, forward = np.array(world.stop.position), _unit(world.stop.yaw)
        if np.linalg.norm(way[-1] - end) > 1e-6:
            way.append(end)
    else:
        left, right = (np.array(side) for side in (world.gates[-1].left, world.gates[-1].right))
        across = (left - right) / np.linalg.norm(left - right)
        end, forward = way[-1], np.array([across[1], -across[0]])
    return np.stack([np.zeros(2), *way, end + _RUN_OUT_M * forward])


def _unit(yaw: float) -> Array:
    return np.array([math.cos(yaw), math.sin(yaw)])


def _spline(knots: Array, values: Array, at: Array) -> Array:
    """Return the natural cubic spline through (K, 2) ``values`` at (K,) ``knots``, evaluated at (M,) ``at``."""
    count, gaps = len(knots), np.diff(knots)
    matrix, right = np.eye(count), np.zeros((count, 2))
    slopes = np.diff(values, axis=0) / gaps[:, None]
    for row in range(1, count - 1):
        matrix[row, row - 1 : row + 2] = gaps[row - 1], 2 * (gaps[row - 1] + gaps[row]), gaps[row]
        right[row] = 6 * (slopes[row] - slopes[row - 1])
    bends = np.linalg.solve(matrix, right)
    part = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, count - 2)
    gap, before, after = gaps[part, None], (at - knots[part])[:, None], (knots[part + 1] - at)[:, None]
    curve: Array = (bends[part] * after**3 + bends[part + 1] * before**3) / (6 * gap)
    curve += (values[part] / gap - bends[part] * gap / 6) * after
    curve += (values[part + 1] / gap - bends[part + 1] * gap / 6) * before
    return curve


def _distances(points: Array, thing: Thing) -> Array:
    """Return the (N,) distances of (N, 2) points on the floor to the outline of ``thing``, in metres; 0 inside."""
    offset = points - np.array(thing.position)
    if thing.shape != "box":
        return np.asarray(np.linalg.norm(offset, axis=1) - thing.extent[0] / 2)
    forward, left = _unit(thing.yaw), _unit(thing.yaw + math.pi / 2)
    own = np.abs(np.stack([offset @ forward, offset @ left], axis=1)) - np.array(thing.extent[:2]) / 2
    return np.asarray(np.linalg.norm(np.maximum(own, 0.0), axis=1))
