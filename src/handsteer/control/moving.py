"""Which obstacles of a scan move, and how: compares a scan with an earlier one of the same scanner."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.control.footprint import Array, Points, after
from handsteer.types import Velocity

BETWEEN_S = 0.25
"""Scans are compared with one that is so much older, in seconds, or a little more: in that time people go 0.3 m."""

_MOST_S = 0.6
_LEAST_S = 0.04  # between two that are remembered: at most 15 of them
_APART_M, _WIDEST_M, _FEWEST = 0.2, 0.9, 3
_SLOWEST_MPS, _FASTEST_MPS = 0.2, 2.0
_ROUNDS = 4
# What is seen where nothing was seen before, by so much at least, has come there.
_FREE_M, _FREE_SHARE = 0.08, 0.2
_BINS = 360


@dataclass
class _Seen:
    measured_s: float
    points: Points
    origin: Points


class MotionOfPoints:
    """Remembers scans, moved with the robot, and finds what of a new one moves."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque()

    def forget(self) -> None:
        """Forget all scans."""
        self._seen.clear()

    def drive(self, velocity: Velocity, seconds: float) -> None:
        """Take that the robot has moved at ``velocity`` for ``seconds``."""
        for each in self._seen:
            each.points = after(velocity, seconds, each.points)
            each.origin = after(velocity, seconds, each.origin)

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
        return found


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
    things = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1) > _APART_M)])
    counts = np.bincount(things)
    came = np.bincount(things, weights=was_free) >= np.maximum(_FREE_SHARE * counts, 1)
    for number in np.flatnonzero(came & (counts >= _FEWEST)):
        part = things == number
        thing = points[part]
        if np.ptp(thing, axis=0).max() > _WIDEST_M:
            continue
        near = before[np.linalg.norm(before - thing.mean(axis=0), axis=1) <= _WIDEST_M + _FASTEST_MPS * seconds]
        if len(near):
            velocity = -_moved_onto(thing, near) / seconds
            speed = float(np.linalg.norm(velocity))
            if _SLOWEST_MPS <= speed <= _FASTEST_MPS:
                found[part] = velocity
    return found


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
