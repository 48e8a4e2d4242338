"""A robot of 0.52 m by 0.49 m before points; the limits of what may be commanded."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from handsteer.config import CollisionMonitorConfig
from handsteer.control import obstacles
from handsteer.control.footprint import Points, gaps, on_a_circle, seen_from
from handsteer.control.obstacles import ObstacleLimiter, limit
from handsteer.types import ZERO, Velocity

RULE = CollisionMonitorConfig(enabled=True)
FRONT, SIDE = RULE.front, RULE.side

speeds = st.floats(-1.0, 1.0)
turns = st.floats(-2.0, 2.0)
velocities = st.builds(Velocity, speeds, turns)


def at(*points: tuple[float, float]) -> Points:
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def wall_ahead(gap_m: float) -> Points:
    return at(*((FRONT + gap_m, y) for y in np.linspace(-3, 3, 301)))


def around(places: list[tuple[float, float]]) -> Points:
    """Return points that are outside of the robot, in whatever direction and at whatever distance."""
    return at(*((r * math.cos(a), r * math.sin(a)) for r, a in places))


surroundings = st.lists(st.tuples(st.floats(0.37, 6.0), st.floats(-math.pi, math.pi)), max_size=30).map(around)


def speed(wanted: Velocity, points: Points, moving: Velocity = ZERO) -> float:
    return limit(wanted, points, RULE, moving)[0].linear_mps


def braking_way_m(linear_mps: float) -> float:
    return linear_mps * RULE.reaction_time + linear_mps**2 / (2 * RULE.deceleration)


@given(velocities, surroundings, velocities)
def test_it_never_makes_faster_nor_turns_round(wanted: Velocity, points: Points, moving: Velocity) -> None:
    said, hit = limit(wanted, points, RULE, moving)
    for told, asked in ((said.linear_mps, wanted.linear_mps), (said.angular_radps, wanted.angular_radps)):
        assert abs(told) <= abs(asked)
        assert told * asked >= 0
    if hit is None:
        assert said == wanted


@given(velocities, surroundings)
@example(Velocity(0.125, 2.0), around([(0.375, -2.0)]))  # the pad is met however it brakes: the latest is chosen
@example(Velocity(-1.0, 1.0), around([(0.46875, 2.625)]))  # likewise; once it is slower, it can brake
def test_what_it_lets_pass_it_lets_pass_again(wanted: Velocity, points: Points) -> None:
    said, _ = limit(wanted, points, RULE, moving=wanted)
    assume(limit(said, points, RULE, moving=wanted)[0] == said)
    assume(obstacles._met_while_braking(wanted, said, points, RULE, None) is None)
    again, _ = limit(said, points, RULE, moving=said)
    assert again.linear_mps == pytest.approx(said.linear_mps, abs=0.006)


@given(velocities, surroundings)
def test_a_robot_that_follows_brakes_before_it_meets_anything(wanted: Velocity, points: Points) -> None:
    """Goes on for the reaction time, then brakes along its circle; looks at the footprint on the way."""
    said, _ = limit(wanted, points, RULE, moving=wanted)
    assume(not said.is_zero and len(points))
    braking_s = max(abs(said.linear_mps) / RULE.deceleration, abs(said.angular_radps) / RULE.angular_deceleration)
    way = on_a_circle(said, np.linspace(0, RULE.reaction_time + braking_s / 2, 200))
    least_m = gaps(*seen_from(way, points), RULE).min()
    assert least_m > 0


@given(st.floats(-1.0, -0.01), st.floats(0.0, 3.0), st.lists(st.tuples(st.floats(0.0, 3.0), speeds), min_size=1))
def test_backing_out_is_never_hindered(backward: float, gap_m: float, ahead: list[tuple[float, float]]) -> None:
    points = np.concatenate([wall_ahead(gap_m), at(*((FRONT + x, y) for x, y in ahead))])
    assert limit(Velocity(backward, 0.0), points, RULE) == (Velocity(backward, 0.0), None)


@given(st.floats(0.01, 1.0), st.floats(0.0, RULE.margin))
def test_nothing_drives_on_towards_what_is_within_the_margin(forward: float, gap_m: float) -> None:
    assert speed(Velocity(forward, 0.0), wall_ahead(gap_m)) == 0.0
    assert speed(Velocity(-forward, 0.0), -wall_ahead(gap_m)) == 0.0


@pytest.mark.parametrize("deceleration", [0.1, 1e-3, 1e-200])
@pytest.mark.parametrize("gap_m", [0.5, 0.75, 1.0, 1.75, 2.0, 3.25, 4.25, 7.5])
def test_nothing_is_fast_enough_to_leap_over_a_wall(gap_m: float, deceleration: float) -> None:
    rule = RULE.model_copy(update={"deceleration": deceleration})
    for moving in (ZERO, Velocity(10.0, 0.0), Velocity(25.0, 0.0)):
        linear_mps = limit(Velocity(10.0, 0.0), wall_ahead(gap_m), rule, moving)[0].linear_mps
        assert linear_mps**2 <= 2 * deceleration * gap_m


@pytest.mark.parametrize("gap_m", [0.3, 0.5, 0.8, 1.2])
def test_the_speed_is_the_one_that_stops_in_time(gap_m: float) -> None:
    linear_mps = speed(Velocity(2.0, 0.0), wall_ahead(gap_m))
    assert braking_way_m(linear_mps) == pytest.approx(gap_m - RULE.margin - 0.02, abs=0.003)


def test_a_robot_has_come_nearer_since_its_scan_was_measured() -> None:
    said = []
    for age_s in (0.0, 0.3):
        limiter = ObstacleLimiter(RULE)
        limiter.see(at(), 0.0)
        limiter.limit(Velocity(1.0, 0.0), 0.0)
        limiter.see(wall_ahead(1.0), 5.0)
        said.append(limiter.limit(Velocity(1.0, 0.0), 5.0 + age_s).linear_mps)
    assert said[0] > said[1] + 0.2


def test_a_robot_that_turns_round_turns_only_when_it_has_stopped() -> None:
    """It still rolls back, and its rear corner would swing into the post."""
    post = at((-0.6, -SIDE - 0.055))
    wanted, rolls_back = Velocity(0.9, 1.0), Velocity(-0.7, 0.0)
    said, hit = limit(wanted, post, RULE, moving=rolls_back)
    assert hit is not None
    assert abs(said.angular_radps) < 0.6


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_robot_that_has_stopped_before_a_wall_turns_away(turn: float) -> None:
    wall = wall_ahead(RULE.margin)
    assert limit(Velocity(0.0, turn), wall, RULE) == (Velocity(0.0, turn), None)
    said, _ = limit(Velocity(0.5, turn), wall, RULE)
    assert said.angular_radps == turn
    assert said.linear_mps < 0.06


@pytest.mark.parametrize("turn", [0.02, 0.1, 0.5, 2.0])
def test_a_corner_that_nearly_touches_is_turned_no_further(turn: float) -> None:
    nearly = at((FRONT - 0.02, SIDE + 0.015))
    assert limit(Velocity(0.0, turn), nearly, RULE)[0] == ZERO


def test_a_corner_that_would_hit_stops_a_turn_in_place() -> None:
    beside_the_corner = at((FRONT - 0.02, SIDE + 0.03))
    left, right = (limit(Velocity(0.0, turn), beside_the_corner, RULE) for turn in (1.5, -1.5))
    assert left[0].angular_radps < 0.2
    assert right == (Velocity(0.0, -1.5), None)


@pytest.mark.parametrize("gap_m", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("forward", [0.5, -0.5])
def test_a_wall_beside_the_robot_does_not_hinder_driving_along(gap_m: float, forward: float) -> None:
    wall = at(*((x, SIDE + gap_m) for x in np.linspace(-3, 3, 301)))
    assert limit(Velocity(forward, 0.0), wall, RULE) == (Velocity(forward, 0.0), None)


def test_the_circle_counts_not_the_straight_line() -> None:
    post = at((1.0, 0.0))
    turning = Velocity(0.5, 1.0)
    assert limit(turning, post, RULE, moving=turning) == (turning, None)
    on_the_circle = at((0.45, 0.3))
    assert speed(turning, on_the_circle, moving=turning) < 0.4
    assert limit(Velocity(0.5, 0.0), on_the_circle, RULE) == (Velocity(0.5, 0.0), None)


def test_a_robot_that_only_begins_to_turn_still_goes_straight_for_a_while() -> None:
    wall = wall_ahead(0.4)
    turning = Velocity(0.6, 2.0)
    assert speed(turning, wall, moving=Velocity(0.6, 0.0)) < speed(turning, wall, moving=turning)


@pytest.mark.parametrize(
    ("point", "wanted", "said"),
    [
        ((FRONT + 0.1, 0.0), Velocity(0.5, 0.0), "obstacle 0.10 m ahead"),
        ((-FRONT - 0.1, 0.0), Velocity(-0.5, 0.0), "obstacle 0.10 m behind"),
        ((FRONT - 0.02, SIDE + 0.03), Velocity(0.0, 1.5), "obstacle 0.03 m to the left"),
        ((FRONT - 0.02, -SIDE - 0.03), Velocity(0.0, -1.5), "obstacle 0.03 m to the right"),
    ],
)
def test_it_says_where_the_obstacle_is(point: tuple[float, float], wanted: Velocity, said: str) -> None:
    _, hit = limit(wanted, at(point), RULE)
    assert hit is not None
    assert hit.describe(RULE) == said


def test_without_a_scan_and_with_an_old_one_nothing_moves() -> None:
    limiter = ObstacleLimiter(RULE)
    backward = Velocity(-0.5, 0.0)
    assert limiter.limit(backward, 10.0) == ZERO
    limiter.see(at(), 10.0)
    assert limiter.limit(backward, 10.0 + RULE.source_timeout - 0.01) == backward
    assert limiter.limit(backward, 10.0 + RULE.source_timeout + 0.01) == ZERO
    assert limiter.is_blind(11.0)


def test_it_remembers_that_the_robot_still_turns() -> None:
    """A robot that was told to turn goes on turning for a while when it is told to go straight."""
    turned, straight = ObstacleLimiter(RULE), ObstacleLimiter(RULE)
    on_the_left = at((0.5, 0.35))
    for limiter, before in ((turned, Velocity(0.6, 2.0)), (straight, Velocity(0.6, 0.0))):
        limiter.see(at(), 0.0)
        limiter.limit(before, 0.0)
        limiter.see(on_the_left, 1.0)
    assert turned.limit(Velocity(0.6, 0.0), 1.0).linear_mps < straight.limit(Velocity(0.6, 0.0), 1.0).linear_mps


class Driven:
    """A robot among points that stay where they are; it follows commands, and gets faster and slower as it is let."""

    def __init__(self, points: Points, accelerates: float = 1.0) -> None:
        self.points = points
        self.limiter = ObstacleLimiter(RULE)
        self.moving = ZERO
        self.now_s = 0.0
        self.least_gap_m = math.inf
        self._brakes = np.array([RULE.deceleration, RULE.angular_deceleration])
        self._accelerates = accelerates

    def drive(self, wanted: Velocity, seconds: float, *, says_how_it_moves: bool = True) -> None:
        for number in range(round(seconds * 50)):
            if number % 5 == 0:
                self.limiter.see(self.points, self.now_s)
            if says_how_it_moves:
                self.limiter.feel(self.moving, self.now_s)
            told = self.limiter.limit(wanted, self.now_s)
            self._move(np.array([told.linear_mps, told.angular_radps]))

    def _move(self, told: Points) -> None:
        now = np.array([self.moving.linear_mps, self.moving.angular_radps])
        rate = np.where(np.abs(told) > np.abs(now), self._brakes * self._accelerates, self._brakes)
        self.moving = Velocity(*(now + np.clip(told - now, -rate / 50, rate / 50)).tolist())
        self.points = np.stack(seen_from(on_a_circle(self.moving, np.array([0.02])), self.points), axis=-1)[0]
        self.now_s += 0.02
        self.least_gap_m = min(self.least_gap_m, float(gaps(self.points[:, 0], self.points[:, 1], RULE).min()))


def test_a_corner_does_not_creep_to_a_wall_a_little_with_each_command() -> None:
    """Its way is so nearly along the wall that each command by itself seems to be one that passes by."""
    along = np.linspace(-2, 2, 801)[:, None] * [math.cos(0.95), math.sin(0.95)]
    robot = Driven(along + at((-RULE.back - 0.011, SIDE + 0.014)))
    robot.drive(Velocity(-0.4, -1.1), 10.0)
    assert robot.least_gap_m > 0.003
    robot.drive(Velocity(0.0, 1.0), 1.0)
    assert robot.moving.angular_radps > 0.3, "it can turn away"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_robot_that_gets_fast_sooner_than_it_brakes_stops_in_time(side: float) -> None:
    wall = wall_ahead(1.1) * [1.0, side]
    hasty = Driven(wall, accelerates=10.0)
    hasty.drive(Velocity(1.0, 0.0), 3.0)
    assert hasty.least_gap_m > RULE.margin - 0.05


def test_it_believes_odometry_more_than_what_was_commanded() -> None:
    """A robot that does not turn yet goes straight for a while, whatever it was told a moment ago."""
    said = []
    for moving in (Velocity(0.6, 0.0), Velocity(0.6, 2.0)):
        limiter = ObstacleLimiter(RULE)
        limiter.see(wall_ahead(0.4), 0.0)
        limiter.feel(moving, 0.0)
        said.append(limiter.limit(Velocity(0.6, 2.0), 0.0).linear_mps)
    assert said[0] < said[1]
