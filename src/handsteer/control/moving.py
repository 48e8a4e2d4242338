"""Which obstacles of a scan move, and how: compares a scan with an earlier one of the same scanner."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import Array, Points, after, gaps
from handsteer.types import Velocity

BETWEEN_S = 0.25
"""Scans are compared with one that is so much older, in seconds, or a little more: in that time people go 0.3 m."""

PAUSE_S = 3.0
"""Who has walked, and stands for less than this, in seconds, may set out again at any moment."""

ROOM_M = 0.25
"""The most room, in metres, that the robot leaves to someone who may set out again."""

_ROOM_S = 0.4  # a person who sets out is seen to walk after so long
_MOST_S = 0.6
_LEAST_S = 0.04  # between two that are remembered: at most 15 of them
_APART_M, _WIDEST_M, _FEWEST = 0.2, 0.9, 3
_SLOWEST_MPS, _FASTEST_MPS = 0.2, 2.0
_ROUNDS = 4
_MOST_WALKERS = 32
# Between two scans nothing goes further than this.
_SAME_M = 0.4
# What is seen where nothing was seen before, by so much at least, has come there.
_FREE_M, _FREE_SHARE = 0.08, 0.2
_BINS = 360


@dataclass
class _Seen:
    measured_s: float
    points: Points
    origin: Points


@dataclass(eq=False)
class _Walker:
    place: Points
    speed_mps: float
    walked_s: float


class MotionOfPoints:
    """Remembers scans, moved with the robot, and finds what of a new one moves.

    Attributes:
        paused_mps: Of each point of the newest scan, (N,), how fast it was before it stood, less than
            :data:`PAUSE_S` ago; 0 for what moves, or has not moved.
    """

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque()
        self._walkers: list[_Walker] = []
        self.paused_mps: Array = np.empty(0)

    def forget(self) -> None:
        """Forget all scans."""
        self._seen.clear()
        self._walkers.clear()

    def drive(self, velocity: Velocity, seconds: float) -> None:
        """Take that the robot has moved at ``velocity`` for ``seconds``."""
        for each in self._seen:
            each.points = after(velocity, seconds, each.points)
            each.origin = after(velocity, seconds, each.origin)
        for walker in self._walkers:
            walker.place = after(velocity, seconds, walker.place)

    def see(self, points: Points, measured_s: float) -> Points:
        """Return the (N, 2) velocities of ``points``, x and y in m/s; zero for all that does not move, or is new."""
        while self._seen and not measured_s - _MOST_S <= self._seen[0].measured_s < measured_s:
            self._seen.popleft()
        while len(self._seen) > 1 and measured_s - self._seen[1].measured_s >= BETWEEN_S - 1e-6:
            self._seen.popleft()
        found = np.zeros_like(points)
        if self._seen and measured_s - self._seen[0].measured_s >= BETWEEN_S / 2:
            before = self._seen[0]
            found = drift(points, before.points, before.origin, measured_s - before.measured_s)
        if not self._seen or measured_s - self._seen[-1].measured_s >= _LEAST_S:
            self._seen.append(_Seen(measured_s, points, np.zeros((1, 2))))
        self.paused_mps = self._paused(points, found, measured_s)
        return found

    def _paused(self, points: Points, velocities: Points, measured_s: float) -> Array:
        """Remember who walks, and return the earlier speeds of who does not any more, (N,)."""
        paused = np.zeros(len(points))
        before = [walker for walker in self._walkers if 0.0 <= measured_s - walker.walked_s <= PAUSE_S]
        now: list[_Walker] = []
        for part in _things(points) if before or velocities.any() else []:
            place = points[part].mean(axis=0, keepdims=True)
            same = [walker for walker in before if math.dist(walker.place[0], place[0]) <= _SAME_M]
            speed_mps = math.hypot(*velocities[part.start])
            if speed_mps:
                now.append(_Walker(place, speed_mps, measured_s))
            elif same:
                now.append(_Walker(place, same[0].speed_mps, same[0].walked_s))
                paused[part] = same[0].speed_mps
            before = [walker for walker in before if walker not in same]
        self._walkers = [*now, *before][:_MOST_WALKERS]
        return paused


def with_room(points: Points, drift: Points, paused_mps: Array, rule: CollisionMonitorConfig) -> tuple[Points, Points]:
    """Return ``points`` and ``drift`` as if all who stand for a moment were about to come to the robot.

    People who let a robot pass walk on before it has passed, and are seen to walk only then. Until they have stood for
    longer, they count as nearer by the way that they go in that time; a robot that is nearer stands, as if they came.

    Args:
        points: Of a scan, (N, 2).
        drift: Velocities of the points, (N, 2) in m/s.
        paused_mps: As of :class:`MotionOfPoints`.
        rule: Size of the robot.
    """
    if not paused_mps.any():
        return points, drift
    far_m = np.maximum(np.linalg.norm(points, axis=1), 1e-9)
    to_robot = -points / far_m[:, None]
    room_m = np.minimum(_ROOM_S * paused_mps, ROOM_M)
    is_near = (paused_mps > 0.0) & (gaps(points[:, 0], points[:, 1], rule) < room_m)
    nearer = points + np.where(is_near, 0.0, room_m)[:, None] * to_robot
    return nearer, np.where(is_near[:, None], paused_mps[:, None] * to_robot, drift)


def drift(points: Points, before: Points, origin: Points, seconds: float) -> Points:
    """Return the (N, 2) velocities of ``points`` in m/s, zero where nothing moves.

    Points next to each other are one thing. A thing not wider than 0.9 m moves if a part of it is where the earlier
    scan saw further; by how much is found by moving it onto the earlier points (iterative closest points).

    Args:
        points: Of a scan, (N, 2), in the order of its rays.
        before: Of an earlier one, (M, 2), in the same frame.
        origin: Where the robot was then, (1, 2).
        seconds: Time between them, above 0.
    """
    found = np.zeros_like(points)
    if len(points) < _FEWEST or len(before) < _FEWEST:
        return found
    was_free = _was_free(points, before, origin)
    if not was_free.any():
        return found
    for part in _things(points, was_free):
        thing = points[part]
        near = before[np.linalg.norm(before - thing.mean(axis=0), axis=1) <= _WIDEST_M + _FASTEST_MPS * seconds]
        if len(near):
            velocity = -_moved_onto(thing, near) / seconds
            speed = float(np.linalg.norm(velocity))
            if _SLOWEST_MPS <= speed <= _FASTEST_MPS:
                found[part] = velocity
    return found


def _things(points: Points, which: NDArray[np.bool_] | None = None) -> list[slice]:
    """Return where in ``points``, (N, 2) in the order of their rays, things are that are not wider than 0.9 m.

    With ``which``, (N,), only those of which it holds for a fifth of the points.
    """
    if not len(points):
        return []
    begins = np.concatenate([[0], np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) > _APART_M) + 1])
    counts = np.diff([*begins, len(points)])
    sizes = np.maximum.reduceat(points, begins) - np.minimum.reduceat(points, begins)
    found = (counts >= _FEWEST) & (sizes.max(axis=1) <= _WIDEST_M)
    if which is not None:
        found &= np.add.reduceat(which, begins, dtype=int) >= np.maximum(_FREE_SHARE * counts, 1)
    return [slice(begins[number], begins[number] + counts[number]) for number in np.flatnonzero(found)]


def _was_free(points: Points, before: Points, origin: Points) -> NDArray[np.bool_]:
    """Return which of ``points`` (N, 2) are where the earlier scan saw further, and away from all that it saw."""
    free = _beyond(points - origin, before - origin) > _FREE_M
    # The next ray on a wall that is seen at a flat angle goes much further, too.
    free[free] = _squares(points[free], before).min(axis=1) > _FREE_M**2
    return free


def _squares(points: Points, others: Points) -> Array:
    """Return the (N, M) squares of the distances of ``points`` from ``others``."""
    x, y = (points[:, axis, None] - others[None, :, axis] for axis in range(2))
    x *= x
    y *= y
    x += y
    found: Array = x
    return found


def _beyond(points: Points, before: Points) -> Array:
    """Return how much farther than each of ``points`` the earlier scan saw in its direction; both seen from there."""
    ranges = np.full(_BINS, np.inf)
    np.minimum.at(ranges, _bins(before), np.linalg.norm(before, axis=1))
    nearest = np.minimum(ranges, np.minimum(np.roll(ranges, 1), np.roll(ranges, -1)))
    return np.asarray(nearest[_bins(points)] - np.linalg.norm(points, axis=1))


def _bins(points: Points) -> NDArray[np.int64]:
    angles = np.arctan2(points[:, 1], points[:, 0])
    return np.floor((angles / math.tau) * _BINS).astype(int) % _BINS


def _moved_onto(thing: Points, before: Points) -> Array:
    """Return the (2,) way that moves ``thing`` onto ``before``."""
    way = np.zeros(2)
    for _ in range(_ROUNDS):
        here = thing + way
        way = way + (before[_squares(here, before).argmin(axis=1)] - here).mean(axis=0)
    return way
