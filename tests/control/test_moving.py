"""Which obstacles of a scan move: people who walk, seen by a robot that drives, among walls that do not."""

import math

import numpy as np
import pytest

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import Points, on_a_circle
from handsteer.control.moving import PAUSE_S, ROOM_M, MotionOfPoints, drift
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.types import ZERO, Velocity

PERIOD_S = 0.1
ANGLES = np.radians(np.arange(-180, 180))


NOISE_M = 0.02
"""Standard deviation of the ranges, as of cheap scanners."""


def scan(
    x: float, y: float, yaw: float, people: list[tuple[float, float]], *, walls: bool = True, seed: int = 0
) -> Points:
    """Return what a scanner at a pose sees of people of 0.25 m radius between walls at y = -1.5 and 1.5."""
    ways = np.stack([np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)], axis=1)
    ranges = np.full(len(ANGLES), np.inf)
    if walls:
        for wall in (-1.5, 1.5):
            with np.errstate(divide="ignore"):
                far = (wall - y) / ways[:, 1]
            ranges = np.minimum(ranges, np.where(far > 0, far, np.inf))
    for person in people:
        to = np.array(person) - (x, y)
        along = ways @ to
        across = np.abs(ways[:, 0] * to[1] - ways[:, 1] * to[0])
        hits = (along > 0) & (across < 0.25)
        ranges = np.where(hits, np.minimum(ranges, along - np.sqrt(np.maximum(0.25**2 - across**2, 0.0))), ranges)
    ranges += np.random.default_rng(seed).normal(0.0, NOISE_M, len(ranges))
    seen = ranges < 8.0
    points: Points = ranges[seen, None] * np.stack([np.cos(ANGLES[seen]), np.sin(ANGLES[seen])], axis=1)
    return points


def found(
    people: list[tuple[float, float]], walk: tuple[float, float], robot: Velocity = ZERO, seed: int = 0
) -> tuple[Points, Points]:
    """Return the points, and their velocities, of the last of five scans of people who walk alike."""
    motion, x, y, yaw = MotionOfPoints(), 0.0, 0.0, 0.0
    for number in range(5):
        seconds = number * PERIOD_S
        now = [(px + walk[0] * seconds, py + walk[1] * seconds) for px, py in people]
        points = scan(x, y, yaw, now, seed=10 * seed + number)
        velocities = motion.see(points, seconds)
        motion.drive(robot, PERIOD_S)
        half = yaw + robot.angular_radps * PERIOD_S / 2
        x += robot.linear_mps * PERIOD_S * math.cos(half)
        y += robot.linear_mps * PERIOD_S * math.sin(half)
        yaw += robot.angular_radps * PERIOD_S
    return points, velocities


@pytest.mark.parametrize("walk", [(-0.8, 0.0), (0.0, 0.6), (-0.5, -0.5), (-1.4, 0.0)])
def test_who_comes_near_or_crosses_is_found_with_their_velocity(walk: tuple[float, float]) -> None:
    points, velocities = found([(2.5, 0.2)], walk)
    moves = velocities.any(axis=1)
    assert moves.sum() >= 5
    assert np.all(np.linalg.norm(points[moves] - (2.5 + 0.4 * walk[0], 0.2 + 0.4 * walk[1]), axis=1) < 0.35)
    assert np.linalg.norm(np.median(velocities[moves], axis=0) - walk) < 0.25


@pytest.mark.parametrize(
    "robot", [ZERO, Velocity(0.8, 0.0), Velocity(0.0, 1.5), Velocity(0.6, -1.0)], ids=["still", "on", "turns", "curve"]
)
@pytest.mark.parametrize("seed", range(10))
def test_walls_and_people_who_stand_do_not_move_whatever_the_robot_does(robot: Velocity, seed: int) -> None:
    _, velocities = found([(2.5, 0.2), (1.5, -0.9), (4.0, 1.0)], (0.0, 0.0), robot, seed)
    assert not velocities.any()


def test_who_walks_is_found_by_a_robot_that_drives() -> None:
    points, velocities = found([(3.0, 0.2)], (-0.6, 0.0), Velocity(0.8, 0.0))
    moves = velocities.any(axis=1)
    assert moves.sum() >= 5
    assert np.median(velocities[moves, 0]) == pytest.approx(-0.6, abs=0.2)
    assert np.all(points[moves, 0] < 3.0)


def test_old_and_absent_scans_tell_nothing() -> None:
    near, far = scan(0, 0, 0, [(2.0, 0.0)], walls=False), scan(0, 0, 0, [(2.5, 0.0)], walls=False)
    motion = MotionOfPoints()
    assert not motion.see(far, 0.0).any()
    assert not motion.see(near, 5.0).any()
    motion.forget()
    assert not motion.see(near, 5.2).any()
    assert not drift(near, np.empty((0, 2)), np.zeros((1, 2)), 0.2).any()
    assert not drift(np.empty((0, 2)), near, np.zeros((1, 2)), 0.2).any()


def test_no_more_than_a_few_scans_are_remembered_however_many_come() -> None:
    motion = MotionOfPoints()
    for number in range(2000):
        velocities = motion.see(scan(0, 0, 0, [(2.5 - 0.8e-3 * number, 0.2)], walls=False), 1e-3 * number)
    assert np.median(velocities[velocities.any(axis=1), 0]) == pytest.approx(-0.8, abs=0.2)
    assert len(motion._seen) <= 15


def test_the_robot_stops_for_who_comes_before_it_would_for_who_stands() -> None:
    """Two metres away: nothing to brake for if it stands, and a hit if it comes at 1.4 m/s."""
    wanted = Velocity(1.0, 0.0)
    allowed = {}
    for walk in (0.0, -1.4):
        limiter = ObstacleLimiter(CollisionMonitorConfig())
        for number in range(5):
            limiter.feel(ZERO, number * PERIOD_S)
            limiter.see(scan(0, 0, 0, [(2.0 + walk * (number - 4) * PERIOD_S, 0.0)]), number * PERIOD_S)
        limiter.feel(wanted, 0.4)
        allowed[walk] = limiter.limit(wanted, 0.4).linear_mps
    assert allowed[0.0] == 1.0
    assert allowed[-1.4] < 0.5


WALKS_S = 1.0


def beside_who_stands(gap_m: float, stood_s: float, *, walks: bool = True) -> ObstacleLimiter:
    """Return what a robot that stands knows of a person beside it, who walked there and has stood for ``stood_s``."""
    limiter = ObstacleLimiter(CollisionMonitorConfig())
    y = limiter.rule.side + gap_m + 0.25
    for number in range(round((WALKS_S + stood_s) / PERIOD_S) + 1):
        seconds = number * PERIOD_S
        x = 0.15 + (0.6 * max(0.0, WALKS_S - seconds) if walks else 0.0)
        limiter.feel(ZERO, seconds)
        limiter.see(scan(0, 0, 0, [(x, y)], walls=False, seed=number), seconds)
    limiter.limit(ZERO, WALKS_S + stood_s)
    return limiter


@pytest.mark.parametrize("way", [1, -1], ids=["ahead", "back"])
def test_a_robot_stands_beside_who_stood_a_moment_ago_until_they_have_stood_for_longer(way: int) -> None:
    """They let it pass, and may walk on into its side: seen only when that is too late."""
    for stood_s, moves in ((0.5, False), (PAUSE_S - 0.5, False), (PAUSE_S + 1.0, True)):
        limiter = beside_who_stands(0.1, stood_s)
        allowed = limiter.limit(Velocity(0.3 * way, 0.0), WALKS_S + stood_s)
        assert (allowed.linear_mps != 0.0) == moves, stood_s


def test_who_has_not_walked_is_passed() -> None:
    limiter = beside_who_stands(0.1, 0.5, walks=False)
    assert limiter.limit(Velocity(0.3, 0.0), WALKS_S + 0.5).linear_mps == 0.3


def test_who_stood_a_moment_ago_is_passed_with_room() -> None:
    """So far to the side that nothing else would slow it."""
    limiter = beside_who_stands(ROOM_M + 0.1, 0.5)
    assert limiter.limit(Velocity(0.3, 0.0), WALKS_S + 0.5).linear_mps == 0.3


def test_who_stood_a_moment_ago_counts_as_nearer_by_what_they_go_before_that_is_seen() -> None:
    """In the last moment before they stand, they seem slower than they are."""

    def nearest_m(walks: bool) -> float:
        limiter = beside_who_stands(ROOM_M + 0.2, 0.5, walks=walks)
        assert limiter._points is not None
        return float(np.linalg.norm(limiter._points, axis=1).min())

    assert 0.07 < nearest_m(walks=False) - nearest_m(walks=True) <= ROOM_M + 0.05


def test_who_walked_is_forgotten_with_the_scans_and_no_more_than_a_few_are_remembered() -> None:
    points = np.concatenate([(x, 0.0) + 0.05 * np.array([(0, -1), (0, 0), (0, 1)]) for x in range(1, 101)])
    motion = MotionOfPoints()
    motion._paused(points, np.ones_like(points), 0.0)
    still = motion._paused(points, np.zeros_like(points), 0.1)
    assert 0 < np.count_nonzero(still) <= 3 * 32
    motion.forget()
    assert not motion._paused(points, np.zeros_like(points), 0.2).any()


@pytest.mark.parametrize("late_s", [0.0, 0.03, 0.08])
@pytest.mark.parametrize("robot", [Velocity(1.0, 0.0), Velocity(0.3, 1.2)], ids=["on", "curve"])
def test_odometry_and_scans_that_come_late_make_nothing_move(robot: Velocity, late_s: float) -> None:
    """Commands between them are for now: the way that they move the scans by is not counted again."""
    limiter = ObstacleLimiter(CollisionMonitorConfig())
    for tick in range(100):
        now_s = tick * 0.01
        measured_s = now_s - late_s
        if tick % 2 == 0:
            limiter.feel(robot, measured_s)
        if tick % 10 == 0:
            x, y, yaw = on_a_circle(robot, np.array([measured_s]))[0].tolist()
            limiter.see(scan(x, y, yaw, [(2.5, 0.3), (1.8, -0.9)], seed=tick), measured_s)
        limiter.limit(robot, now_s)
        assert not np.any(limiter._drift), tick
