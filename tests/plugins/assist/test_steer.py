"""``control.assist: steer`` before points, and in histories of random wishes among random points."""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from handsteer.config import CollisionMonitorConfig
from handsteer.control.assist import TURNS_RADPS, Around, is_within
from handsteer.control.footprint import Points, drifted, gaps, seen_from
from handsteer.control.obstacles import ObstacleLimiter, limit
from handsteer.plugins.assist.steer import CLEAR_S, REACH_S, WIDEST_RAD, Steer, steered
from handsteer.types import ZERO, Velocity
from tests.about import about

RULE = CollisionMonitorConfig()
MAX_RADPS = 2.0
CASES = int(os.environ.get("HANDSTEER_STEPS", "4000")) // 4
FORWARD = Velocity(0.5, 0.0)


def around(points: Points, moving: Velocity, max_radps: float = MAX_RADPS, *, drift: Points | None = None) -> Around:
    return Around(points, moving, RULE, max_radps, 0.0, drift)


def at(*points: tuple[float, float]) -> Points:
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def steer(wanted: Velocity, points: Points, moving: Velocity | None = None) -> Velocity:
    return steered(wanted, around(points, wanted if moving is None else moving))[0]


def wall_ahead(gap_m: float) -> Points:
    return at(*((RULE.front + gap_m, y) for y in np.linspace(-3, 3, 301)))


@pytest.mark.parametrize("wanted", [FORWARD, Velocity(-0.4, 0.3), Velocity(1.0, -2.0)])
def test_free_of_obstacles_it_changes_nothing(wanted: Velocity) -> None:
    assert steered(wanted, around(at(), ZERO)) == (wanted, None)
    assert steered(wanted, around(at((4.0, 0.0), (-4.0, 0.0)), ZERO)) == (wanted, None)


@pytest.mark.parametrize(("y", "side"), [(-0.1, 1), (0.1, -1)])
@pytest.mark.parametrize("way", [1, -1], ids=["forward", "backward"])
def test_it_steers_to_the_side_on_which_less_is_in_the_way(y: float, side: int, way: int) -> None:
    post = at((way * 0.75, y))
    velocity, avoided = steered(Velocity(way * 0.5, 0.0), around(post, Velocity(way * 0.5, 0.0)))
    assert velocity.angular_radps * side * way > 0
    assert velocity.linear_mps * way > 0
    assert avoided is not None
    assert (avoided.x, avoided.y) == (way * 0.75, y)


@pytest.mark.parametrize("side", [1, -1])
def test_a_wall_is_passed_where_it_ends_sooner(side: int) -> None:
    """The first turn that is tried and clear is equally far from the wish on both sides."""
    wall = at(*((0.8, side * y) for y in np.linspace(-1.0, 0.2, 121)))
    velocity, _ = steered(Velocity(0.6, 0.0), around(wall, ZERO))
    assert velocity.angular_radps * side > 0


def test_it_keeps_the_side_to_which_the_robot_turns_already() -> None:
    post = at((0.8, 0.0))
    for turn in (0.3, -0.3):
        assert steer(FORWARD, post, Velocity(0.5, turn)).angular_radps * turn > 0


@pytest.mark.parametrize("side", [1, -1])
def test_it_passes_behind_who_crosses(side: int) -> None:
    """Who stands 1 m ahead and walks to the left at 0.2 m/s is passed on the right, and the other way round."""
    person = at(*((1.0, y) for y in np.linspace(-0.2, 0.2, 9)))
    walks = np.tile([0.0, 0.2 * side], (len(person), 1))
    velocity, avoided = steered(FORWARD, around(person, FORWARD, drift=walks))
    assert avoided is not None
    assert velocity.angular_radps * side < 0


def test_who_wants_to_stand_stands_and_who_turns_in_place_only_turns() -> None:
    beside = at((0.2, 0.27), (0.3, 0.0))
    for wanted in (ZERO, Velocity(0.0, 1.0), Velocity(0.0, -1.0)):
        assert steered(wanted, around(beside, Velocity(0.4, 0.2))) == (wanted, None)


@pytest.mark.parametrize("turn", [0.3, -0.3])
def test_it_does_not_turn_against_a_turn_that_the_person_makes(turn: float) -> None:
    """A post on the side to which the person turns: the other side is free."""
    post = at((0.7, math.copysign(0.15, turn)))
    velocity = steer(Velocity(0.5, turn), post)
    assert velocity.angular_radps * turn >= 0


def on_the_arc(wish: Velocity, way_m: float) -> Points:
    """Return where the middle of a robot that drives as ``wish`` is after ``way_m``."""
    turned = wish.angular_radps * way_m / abs(wish.linear_mps)
    radius_m = wish.linear_mps / wish.angular_radps
    return at((radius_m * math.sin(turned), radius_m * (1 - math.cos(turned))))


@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
@pytest.mark.parametrize("way", [1, -1], ids=["forward", "backward"])
def test_a_turn_is_followed_for_a_second_only(way: int, side: int) -> None:
    """Who turns is about to turn less; a post that the arc would meet later is no reason to pass it elsewhere."""
    straight, turn = Velocity(way * 0.8, 0.0), Velocity(way * 0.8, side * 0.6)
    assert steered(straight, around(at((way * 1.25, 0.0)), straight))[1] is not None
    assert steered(turn, around(on_the_arc(turn, 1.25), turn)) == (turn, None)
    assert steered(turn, around(on_the_arc(turn, 1.0), turn))[1] is not None


def test_after_an_abrupt_change_a_wish_is_left_alone_until_it_has_lasted() -> None:
    """A key was released: what is met within 1 s is steered around 0.5 s later, what is met after that later still."""
    near, far, wish = at((1.0, 0.05)), at((1.35, 0.05)), Velocity(0.8, 0.0)
    steers_from_s = {}
    for name, post in (("near", near), ("far", far)):
        assist = Steer()
        assist.step(Velocity(0.8, 1.0), replace(around(post, wish), now_s=-0.05))
        times_s = [number / 20 for number in range(40)]
        steers = [assist.step(wish, replace(around(post, wish), now_s=now_s))[1] is not None for now_s in times_s]
        first = steers.index(True)
        assert all(steers[first:])
        steers_from_s[name] = times_s[first]
    assert steers_from_s == {"near": 0.5, "far": about(0.85, abs=0.1)}


def test_the_control_s_time_passes_for_it() -> None:
    """The same through the limiter, which gives the assist its time."""
    limiter, post, wish = ObstacleLimiter(RULE), at((0.75, 0.1)), Velocity(0.5, 0.0)
    limiter.assist, limiter.max_angular_radps = Steer(), MAX_RADPS
    is_avoided = []
    for now_s, wanted in ((10.0, Velocity(0.5, 1.0)), (10.1, wish), (10.5, wish), (10.7, wish)):
        limiter.see(post, now_s)
        limiter.feel(wish, now_s)
        limiter.limit(wanted, now_s)
        is_avoided.append(limiter.avoided is not None)
    assert is_avoided == [False, False, False, True]


def test_a_wish_that_changes_little_by_little_is_steered_at_once() -> None:
    assist, post = Steer(), at((0.7, 0.1))
    for number, turn in enumerate((0.0, 0.25, 0.5, 0.3, 0.05)):
        wish = Velocity(0.5, turn)
        assert assist.step(wish, replace(around(post, wish), now_s=number / 10)) == steered(wish, around(post, wish))


def test_what_cannot_be_avoided_is_left_to_the_brake() -> None:
    for gap_m in (0.05, 0.1):
        wanted = Velocity(0.6, 0.0)
        assert steered(wanted, around(wall_ahead(gap_m), wanted)) == (wanted, None)
        limiter = ObstacleLimiter(RULE)
        limiter.assist, limiter.max_angular_radps = Steer(), MAX_RADPS
        limiter.see(wall_ahead(gap_m), 0.0)
        limiter.feel(wanted, 0.0)
        assert limiter.limit(wanted, 0.0).linear_mps == 0.0


@pytest.mark.parametrize("y", [-0.15, -0.05, 0.05, 0.1, 0.2])
def test_a_wish_that_turns_is_turned_no_further_than_it_must(y: float) -> None:
    """A wish that turns by what was chosen is clear, and changed no more; one that turns by 0.03 rad/s less is not."""
    post, wish = at((0.8, y)), Velocity(0.5, -math.copysign(0.02, y))
    velocity = steer(wish, post)
    assert velocity != wish
    assert steer(velocity, post, wish) == velocity
    less = Velocity(velocity.linear_mps, velocity.angular_radps - math.copysign(0.03, velocity.angular_radps))
    assert abs(steer(less, post, wish).angular_radps) > abs(less.angular_radps)


def test_a_gap_that_the_collision_monitor_lets_a_robot_through_is_driven_through() -> None:
    """At 0.4 m/s it is slowed for whatever is within 3.2 cm: 4 cm to either side are room enough."""
    slow = Velocity(0.4, 0.0)
    for room_m, goes_through in ((0.04, True), (0.025, False)):
        side = RULE.side + room_m
        posts = at(*((x, y * way) for x in (0.8, 0.85, 0.9) for y in (side, side + 0.1, side + 0.2) for way in (1, -1)))
        assert (steer(slow, posts) == slow) is goes_through
        on_the_way = [posts - (x, 0.0) for x in np.arange(0.0, 1.0, 0.05)]
        assert all(limit(slow, seen, RULE, slow)[0] == slow for seen in on_the_way) is goes_through


def test_the_limit_of_turns_holds() -> None:
    post = at((0.75, 0.05))
    assert abs(steered(FORWARD, around(post, FORWARD, 0.2))[0].angular_radps) <= 0.2


@dataclass(frozen=True)
class Case:
    wanted: Velocity
    moving: Velocity
    points: Points
    drift: Points | None


def cases(count: int, seed: int) -> Iterator[Case]:
    """Yield random wishes and motions among random posts and walls, none nearer than 9 cm; in a quarter posts walk."""
    random = np.random.default_rng(seed)
    for number in range(count):
        wanted = Velocity(float(random.uniform(-1, 1)), float(random.uniform(-2, 2)))
        if number % 3 == 0:
            wanted = Velocity(wanted.linear_mps, 0.0)
        if number % 17 == 0:
            wanted = ZERO if number % 2 else Velocity(0.0, wanted.angular_radps)
        moving = Velocity(
            wanted.linear_mps + float(random.normal(0, 0.2)), wanted.angular_radps + float(random.normal(0, 0.4))
        )
        angles = random.uniform(-math.pi, math.pi, random.integers(1, 8))
        posts = random.uniform(0.3, 2.0, len(angles))[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        if number % 2:
            along = np.linspace(-2, 2, 60)
            turn, off = random.uniform(-math.pi, math.pi), random.uniform(0.3, 1.5)
            wall = np.stack(
                [off * math.cos(turn) - along * math.sin(turn), off * math.sin(turn) + along * math.cos(turn)]
            )
            posts = np.concatenate([posts, wall.T])
        free = gaps(posts[:, 0], posts[:, 1], RULE) > 0.09
        drift = None
        if number % 4 == 1:
            drift = np.zeros_like(posts)
            drift[: len(angles)] = random.uniform(-1, 1, (len(angles), 2))
            drift = drift[free]
        yield Case(wanted, moving, posts[free], drift)


def path(moving: Velocity, target: Velocity, seconds: float) -> Points:
    """Return the poses of a robot that changes its velocity at the guaranteed decelerations, in steps of 5 ms."""
    v, w, x, y, yaw = moving.linear_mps, moving.angular_radps, 0.0, 0.0, 0.0
    poses = []
    for _ in range(round(seconds / 0.005)):
        v += max(-RULE.deceleration * 0.005, min(target.linear_mps - v, RULE.deceleration * 0.005))
        w += max(-RULE.angular_deceleration * 0.005, min(target.angular_radps - w, RULE.angular_deceleration * 0.005))
        x, y, yaw = x + v * 0.005 * math.cos(yaw), y + v * 0.005 * math.sin(yaw), yaw + w * 0.005
        poses.append((x, y, yaw))
    return np.array(poses)


def test_in_random_cases_the_person_keeps_the_say_and_the_path_keeps_clear() -> None:
    """``HANDSTEER_STEPS`` says how many: a quarter of it."""
    steered_cases = 0
    for number, case in enumerate(cases(CASES, 0)):
        wanted, moving = case.wanted, case.moving
        velocity, avoided = steered(wanted, around(case.points, moving, drift=case.drift))
        assert is_within(velocity, wanted, MAX_RADPS)
        assert abs(velocity.linear_mps) <= abs(wanted.linear_mps)
        assert velocity.linear_mps * wanted.linear_mps >= 0.0
        assert not wanted.is_zero or velocity.is_zero
        assert wanted.linear_mps or velocity == wanted
        assert abs(velocity.angular_radps) <= MAX_RADPS
        if abs(wanted.angular_radps) >= TURNS_RADPS:
            assert velocity.angular_radps * wanted.angular_radps >= 0.0
        off_rad = (velocity.angular_radps - wanted.angular_radps) * CLEAR_S / 2
        assert abs(off_rad) <= WIDEST_RAD + 1e-9
        if avoided is None:
            assert velocity == wanted
            continue
        steered_cases += 1
        assert abs(velocity.angular_radps - moving.angular_radps) <= REACH_S * RULE.angular_deceleration + 1e-9
        if number % 5 == 0:
            poses = path(moving, velocity, CLEAR_S)
            seen = seen_from(poses, case.points)
            if case.drift is not None:
                seen = drifted(seen, poses, np.linspace(0.005, 0.005 * len(poses), len(poses)), case.drift)
            assert gaps(*seen, RULE).min() > 0.0, case
    assert steered_cases > CASES / 20


def test_in_random_cases_the_brake_has_the_last_word() -> None:
    """What is commanded in the end is never faster than without the assist's say, and never against the person."""
    for case in cases(CASES // 3, 1):
        limiter = ObstacleLimiter(RULE)
        limiter.assist, limiter.max_angular_radps = Steer(), MAX_RADPS
        limiter.assist.step(case.wanted, replace(around(at(), ZERO), now_s=-5.0))
        limiter.see(case.points, 0.0)
        limiter.feel(case.moving, 0.0)
        allowed = limiter.limit(case.wanted, 0.0)
        assert is_within(allowed, case.wanted, MAX_RADPS)
        if limiter.avoided is not None:
            made, _ = steered(case.wanted, around(case.points, case.moving))
            assert allowed == limit(made, case.points, RULE, case.moving)[0]
        else:
            plain = ObstacleLimiter(RULE)
            plain.see(case.points, 0.0)
            plain.feel(case.moving, 0.0)
            assert allowed == plain.limit(case.wanted, 0.0)
