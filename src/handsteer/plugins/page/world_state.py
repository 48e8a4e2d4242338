"""What the 3D view and the plot show: robot, obstacles, laser scan, the path so far, and the last velocities."""

import math
import threading
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from handsteer.messages import LaserScan, Marker
from handsteer.types import Pose2D, Velocity

TRAIL_POINTS = 1000
"""The oldest points of a trail beyond these are dropped."""

STEP_M = 0.08
"""Distance between the points of a trail."""

LEAP_M = 0.5
"""A robot farther than this from the last point was repositioned, which starts a new trail."""

_START = Pose2D(0.0, 0.0, 0.0)

SCAN_POINTS = 180

ARC_S, ARC_POINTS = 1.0, 10
"""Time of the drawn arc in seconds, and its number of points."""
_DRIVES_MPS = 0.02

"""Longer scans are subsampled."""

Point = tuple[float, float]
"""x and y in metres."""

SPAN_S = 30.0
"""Length of the plot."""

PERIOD_S = 0.05
"""Time between samples."""


@dataclass(frozen=True)
class Trail:
    """The path so far.

    Attributes:
        points: Oldest first.
        count: Total number of points, including dropped ones.
        number: Number of earlier trails.
    """

    points: tuple[Point, ...] = ()
    count: int = 0
    number: int = 0

    def to(self, pose: Pose2D) -> "Trail":
        """Return the trail extended to ``pose``."""
        point = (pose.x, pose.y)
        distance_m = math.dist(self.points[-1], point) if self.points else math.inf
        if distance_m < STEP_M:
            return self
        if LEAP_M < distance_m < math.inf:
            return self.restarted().to(pose)
        return replace(self, points=(*self.points[-TRAIL_POINTS + 1 :], point), count=self.count + 1)

    def restarted(self) -> "Trail":
        """Return an empty trail with another number."""
        return Trail(number=self.number + 1)

    def since(self, shown: "Trail") -> tuple[Point, ...]:
        """Return the points added since ``shown``, an earlier state of the same trail."""
        new = self.count - shown.count
        return self.points[-new:] if new else ()


@dataclass(frozen=True)
class WorldState:
    """The contents of the 3D view.

    Attributes:
        robot: Pose of the robot in the world.
        joints: Joint angles in rad by name.
        markers: The obstacles by namespace and id.
        description: The robot's URDF; empty until it is known.
        trail: The robot's path while the page was viewed.
        scan: Points of the laser scan in the world.
        arc: Points in the world that the robot will pass in the next second, if it follows its command; none if it
            stands.
    """

    robot: Pose2D = _START
    joints: tuple[tuple[str, float], ...] = ()
    markers: tuple[Marker, ...] = ()
    description: str = ""
    trail: Trail = Trail()
    scan: tuple[Point, ...] = ()
    arc: tuple[Point, ...] = ()


def arc_points(command: Velocity, robot: Pose2D) -> tuple[Point, ...]:
    """Return the points that ``robot``, its pose in the world, passes in the next second if it follows ``command``.

    None if it is not to drive: a robot that turns in place passes none.
    """
    if abs(command.linear_mps) < _DRIVES_MPS:
        return ()
    times_s = np.linspace(0.0, ARC_S, ARC_POINTS + 1)[1:]
    turns = command.angular_radps * times_s
    # The chord of an arc: its length is that of the way times sin(x) / x, with x half of the turn.
    chords = command.linear_mps * times_s * np.sinc(turns / math.tau)
    angles = robot.yaw + turns / 2
    points = np.stack([robot.x + chords * np.cos(angles), robot.y + chords * np.sin(angles)], axis=1)
    return tuple((x, y) for x, y in points.round(2).tolist())


def scan_points(scan: LaserScan, robot: Pose2D) -> tuple[Point, ...]:
    """Return the points of ``scan`` in the world; rays without a return are left out.

    ``robot`` is the robot's pose at the time of the scan. The scanner is assumed at its centre, facing forward, as on
    the simulated robot.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    step = max(1, math.ceil(len(ranges) / SCAN_POINTS))
    numbers = np.arange(0, len(ranges), step)
    ranges = ranges[::step]
    meets = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    angles = robot.yaw + scan.angle_min + numbers[meets] * scan.angle_increment
    points = np.stack([robot.x + ranges[meets] * np.cos(angles), robot.y + ranges[meets] * np.sin(angles)], axis=1)
    return tuple((x, y) for x, y in points[np.isfinite(points).all(axis=1)].round(2).tolist())


@dataclass(frozen=True)
class Sample:
    """Both velocities at one moment.

    Attributes:
        at_s: Seconds of the graph's clock.
        commanded: The commanded velocity; None without a command.
        measured: The velocity from odometry; None without odometry.
    """

    at_s: float
    commanded: Velocity | None
    measured: Velocity | None


class VelocityHistory:
    """Keeps the samples of the last :data:`SPAN_S` seconds; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._samples: deque[Sample] = deque(maxlen=round(SPAN_S / PERIOD_S) + 1)
        self._count = 0

    def add(self, sample: Sample) -> None:
        """Append ``sample``, unless the last one is younger than half of :data:`PERIOD_S`."""
        with self._lock:
            if not self._samples or sample.at_s - self._samples[-1].at_s >= PERIOD_S / 2:
                self._samples.append(sample)
                self._count += 1

    def since(self, count: int, now_s: float) -> tuple[int, list[Sample]]:
        """Return the total number of samples so far, and the recent ones after the first ``count``."""
        with self._lock:
            fresh = min(self._count - count, len(self._samples))
            samples = list(self._samples)[len(self._samples) - fresh :] if fresh > 0 else []
            return self._count, [sample for sample in samples if now_s - sample.at_s <= SPAN_S]


def place_in_world(truth: Pose2D, odometry_then: Pose2D, odometry_now: Pose2D) -> Pose2D:
    """Return the robot's current pose in the world: ``truth``, moved by the odometry since.

    These are the transforms ``map`` to ``odom`` to ``base_link`` of REP 105: the step is rotated from the odometry
    frame, which drifts, into the world. ``odometry_then`` is of the same time as ``truth``.
    """
    turn = truth.yaw - odometry_then.yaw
    dx, dy = odometry_now.x - odometry_then.x, odometry_now.y - odometry_then.y
    return Pose2D(
        truth.x + math.cos(turn) * dx - math.sin(turn) * dy,
        truth.y + math.sin(turn) * dx + math.cos(turn) * dy,
        odometry_now.yaw + turn,
    )
