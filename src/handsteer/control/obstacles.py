"""Slows commands so that the robot can stop before what is in its way: pure functions, and what they remember.

A command's way is the circle that it drives the robot along. The robot may be as fast on it as lets it stop in front of
the first obstacle that its footprint would meet, after its reaction time and by its own braking: the square root of the
free way, as brakes have it. What gets farther away, or passes beside the footprint, does not count, so that backing out
and turning away stay free.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import after, braking, fastest_mps, gaps, least_gaps, on_a_circle, reach_m, seen_from
from handsteer.control.scan_points import Points
from handsteer.types import ZERO, Velocity

_PAD_M = 0.02
"""Nothing is to come nearer to the robot, be it beside it."""

# The faster a robot changes how it moves, the less is sure where that leads.
_PAD_S = 0.03

# Who is nearer already may come no nearer than by this, which is the noise of a scan.
_NOISE_M = 0.01
# But a robot that turns by more than this, so near to something, is to come no nearer than by this.
_SWING_RAD = 0.03
_NEARER_M = 0.001
# Of the robot's own speed: what is near and comes nearer so slowly is passed along.
_GLANCING = 0.05
_CREEP_M = 0.06
_STEP_M = 0.03
_FEWEST_STEPS, _MOST_STEPS = 8, 400
# Of every third pose, none between is farther away than two steps; a hair more, as the poses are added up.
_ROUGHLY = 2.1
_SLOWEST = 0.005
_NOTHING_MPS = 1e-6
# Which shares of a velocity that is too fast are tried, of driving and of turning: those first that turn as they were
# told, as turning leads away from most things.
_LESS = ((1.0, 1.0), (0.75, 1.0), (0.5, 1.0), (0.25, 1.0), (0.0, 1.0), (1.0, 0.5), (1.0, 0.0), (0.5, 0.5), (0.0, 0.5))


@dataclass(frozen=True)
class Hit:
    """What is in the way.

    Attributes:
        x: Forward of the base frame, in metres.
        y: To the left of it.
        gap_m: How far it is from the robot now.
        time_s: When the robot would meet it, in seconds.
    """

    x: float
    y: float
    gap_m: float
    time_s: float

    def describe(self, rule: CollisionMonitorConfig) -> str:
        """Return where it is, as ``obstacle 0.42 m ahead``."""
        beside = "to the left" if self.y > 0 else "to the right"
        where = "ahead" if self.x >= rule.front else "behind" if self.x <= -rule.back else beside
        return f"obstacle {max(0.0, self.gap_m):.2f} m {where}"


def limit(
    wanted: Velocity,
    points: Points,
    rule: CollisionMonitorConfig,
    moving: Velocity = ZERO,
) -> tuple[Velocity, Hit | None]:
    """Return the velocity to command instead of ``wanted``, and what it is slowed for; None where it is not.

    It is never faster, and never turns or drives the other way. A robot that is slowed may turn as fast as it could in
    place; its way becomes tighter. A robot that has to change how it moves does not go the way of its command at once:
    what it would meet meanwhile, and while it brakes then, counts too. Where that cannot be avoided, as late as can be.

    Args:
        wanted: What signs or steering ask for; finite.
        points: The obstacles, now.
        rule: Footprint, margin and brakes.
        moving: How the robot moves now.
    """
    if wanted.is_zero or not len(points):
        return wanted, None
    points = _within_reach(wanted, points, rule, moving)
    if not len(points):
        return wanted, None
    share, hit = turn, _ = _share(wanted, points, rule)
    if hit and wanted.linear_mps and wanted.angular_radps:
        turn, _ = _share(Velocity(0.0, wanted.angular_radps), points, rule)
    best, latest_s = ZERO, 0.0
    for linear, angular in _LESS:
        slower = _scaled(wanted, share * linear, turn * angular)
        if hit and _share(slower, points, rule)[1]:
            continue
        met = _met_while_braking(moving, slower, points, rule)
        if met is None:
            return slower, None if slower == wanted else hit
        hit = hit or met
        if met.time_s > latest_s:
            best, latest_s = slower, met.time_s
    return best, None if best == wanted else hit


def _within_reach(wanted: Velocity, points: Points, rule: CollisionMonitorConfig, moving: Velocity) -> Points:
    """Return those of ``points`` that a robot could meet, however it is slowed."""
    v = max(abs(moving.linear_mps), abs(wanted.linear_mps))
    w = max(abs(moving.angular_radps), abs(wanted.angular_radps))
    way_m = v * (rule.reaction_time + max(v / rule.deceleration, w / rule.angular_deceleration))
    pad_m = _PAD_M + _PAD_S * fastest_mps(Velocity(v, w), rule) + _NOISE_M
    far_m = way_m + rule.margin + _CREEP_M + reach_m(rule) + pad_m
    x, y = points[:, 0], points[:, 1]
    return points[x * x + y * y <= far_m**2]


def _scaled(velocity: Velocity, linear: float, angular: float) -> Velocity:
    if linear == angular == 1.0:
        return velocity
    v, w = velocity.linear_mps * linear, velocity.angular_radps * angular
    return Velocity(v if abs(v) >= _SLOWEST else 0.0, w if abs(w) >= _SLOWEST else 0.0)


def _share(velocity: Velocity, points: Points, rule: CollisionMonitorConfig) -> tuple[float, Hit | None]:
    """Return which share of ``velocity`` lets the robot stop in time, 0 to 1, and what it has to stop for.

    Times are those at the full velocity: a share s takes s * delay + s² * braking / 2 of it.
    """
    delay_s = rule.reaction_time
    fastest = fastest_mps(velocity, rule)
    if fastest < _NOTHING_MPS:
        return 1.0, None
    braking_s = max(
        abs(velocity.linear_mps) / rule.deceleration, abs(velocity.angular_radps) / rule.angular_deceleration
    )
    # The margin is for driving; a turn in place may end at the pad, so that a robot before a wall can turn away.
    margin_s = rule.margin * abs(velocity.linear_mps) / fastest**2
    needed_s = delay_s + braking_s / 2
    hit = first_hit(velocity, points, rule, needed_s + margin_s)
    free_s = math.inf if hit is None else hit.time_s - margin_s
    if free_s >= needed_s * (1 - 1e-6):
        return 1.0, None
    if free_s <= 0:
        return 0.0, hit
    root = math.sqrt(delay_s**2 + 2 * braking_s * free_s)
    return min(1.0, 2 * free_s / (delay_s + root)), hit


def first_hit(velocity: Velocity, points: Points, rule: CollisionMonitorConfig, horizon_s: float) -> Hit | None:
    """Return what a robot that goes on at ``velocity`` meets first within ``horizon_s`` seconds; None for nothing."""
    fastest = fastest_mps(velocity, rule)
    if fastest < _NOTHING_MPS or horizon_s <= 0:
        return None
    # A creeping robot, too, is to see that it comes nearer to what is near already.
    seen_s = max(horizon_s, _CREEP_M / fastest)
    times_s = _times(fastest, seen_s)
    poses = on_a_circle(velocity, times_s)
    hit = _met(poses, times_s, points, rule, pad_m=_PAD_M, fastest_mps=fastest)
    return hit if hit and hit.time_s <= horizon_s else None


def _met_while_braking(moving: Velocity, told: Velocity, points: Points, rule: CollisionMonitorConfig) -> Hit | None:
    """Return what a robot meets first that is told ``told``, and to stand one reaction time later; None for nothing."""
    fastest = fastest_mps(
        Velocity(
            max(abs(moving.linear_mps), abs(told.linear_mps)), max(abs(moving.angular_radps), abs(told.angular_radps))
        ),
        rule,
    )
    if fastest < _NOTHING_MPS:
        return None
    # Who turns round stops on the way, and has to stop again.
    stop_s = max(
        max(abs(moving.linear_mps), abs(told.linear_mps)) / rule.deceleration,
        max(abs(moving.angular_radps), abs(told.angular_radps)) / rule.angular_deceleration,
    )
    times_s = _times(fastest, rule.reaction_time + stop_s)
    poses = braking(moving, told, rule, rule.reaction_time, times_s)
    return _met(poses, times_s, points, rule, pad_m=_PAD_M + _PAD_S * fastest, fastest_mps=fastest)


def _times(fastest_mps: float, seconds: float) -> Points:
    steps = min(max(math.ceil(fastest_mps * seconds / _STEP_M), _FEWEST_STEPS), _MOST_STEPS)
    return np.arange(steps + 1, dtype=np.float64) * (seconds / steps)


def _met(
    poses: Points, times_s: Points, points: Points, rule: CollisionMonitorConfig, *, pad_m: float, fastest_mps: float
) -> Hit | None:
    """Return what the footprint meets first on its way by ``poses`` (K, 3) at ``times_s`` (K,); None for nothing."""
    # Most points stay far away, which a few poses tell.
    beyond_m = pad_m + _NOISE_M + _ROUGHLY * fastest_mps * times_s[1]
    near = points[least_gaps(*seen_from(poses[1::3], points), rule).min(axis=0) <= beyond_m]
    if not len(near):
        return None
    gap = gaps(*seen_from(poses, near), rule)
    gap_m = float(gap[0].min())
    # Where something is within the pad already, the robot may still pass by what gets no nearer. A corner that swings
    # towards a wall gets nearer by less than a scan's noise each time, but each time again.
    swings = gap_m < _NOISE_M and float(np.abs(poses[:, 2]).max()) > _SWING_RAD
    least_m = min(pad_m, gap_m - (_NEARER_M if swings else _NOISE_M))
    is_met = gap <= least_m
    met = is_met.any(axis=0)
    if not met.any():
        return None
    comes_nearer = (gap[0] < pad_m) & (gap[1] - gap[0] < -_GLANCING * fastest_mps * times_s[1])
    at_once = met if swings else met & comes_nearer
    if at_once.any():
        first, time_s = int(at_once.argmax()), 0.0
    else:
        first, time_s = _first(gap, is_met, times_s, least_m)
    return Hit(float(near[first, 0]), float(near[first, 1]), float(gap[0, first]), time_s)


def _first(gap: Points, is_met: NDArray[np.bool_], times_s: Points, least_m: float) -> tuple[int, float]:
    """Return which point is met first, ``is_met`` (K, N), and when, between the steps of ``times_s`` (K,)."""
    at = max(1, int(is_met.any(axis=1).argmax()))
    met = np.flatnonzero(is_met[: at + 1].any(axis=0))
    before, after = gap[at - 1, met], gap[at, met]
    parts = np.minimum(np.maximum((before - least_m) / np.maximum(before - after, 1e-9), 0.0), 1.0)
    first = int(parts.argmin())
    return int(met[first]), float(times_s[at - 1] + parts[first] * (times_s[at] - times_s[at - 1]))


class ObstacleLimiter:
    """Remembers the newest scan, and how the robot moves as far as commands tell.

    Args:
        rule: Footprint, margin, brakes and timeout; may be set later, too.

    Attributes:
        rule: As above.
        hit: What the last command was slowed for; None where it was not, or where there was no scan.
    """

    def __init__(self, rule: CollisionMonitorConfig) -> None:
        self.rule = rule
        self._points: Points | None = None
        self._measured_s = -math.inf
        self._moving = self._told = ZERO
        self._moving_s = self._told_s = -math.inf
        self.hit: Hit | None = None

    def see(self, points: Points, measured_s: float) -> None:
        """Take a scan that was measured at ``measured_s``, in seconds of the caller's clock."""
        self._points, self._measured_s = points, measured_s

    def feel(self, moving: Velocity, measured_s: float) -> None:
        """Take how the robot moved at ``measured_s``, as its odometry says; finite.

        Without it, the robot is taken to follow commands as hard as it surely brakes: most get faster sooner.
        """
        self._moving, self._moving_s = moving, measured_s

    def silence_s(self, now_s: float) -> float:
        """Return how old the newest scan is at ``now_s``; infinity when there is none."""
        return max(0.0, now_s - self._measured_s)

    def is_blind(self, now_s: float) -> bool:
        """Return whether there is no scan that could be trusted at ``now_s``."""
        return self._points is None or self.silence_s(now_s) > self.rule.source_timeout

    def limit(self, wanted: Velocity, now_s: float) -> Velocity:
        """Return what to command at ``now_s`` instead of ``wanted``: zero without a scan; else as :func:`limit`.

        The robot has gone on since the scan was measured, and so the points are taken to be elsewhere.
        """
        self._moving, self._moving_s = self._followed(now_s), now_s
        self.hit, said = None, ZERO
        if self._points is not None and not self.is_blind(now_s):
            points = after(self._moving, self.silence_s(now_s), self._points)
            said, self.hit = limit(wanted, points, self.rule, self._moving)
        self._told, self._told_s = said, now_s
        return said

    def _followed(self, now_s: float) -> Velocity:
        """Return how a robot with these brakes moves at ``now_s``, after what it did last and was told."""
        elapsed_s = max(0.0, now_s - max(self._moving_s, self._told_s))
        if not math.isfinite(elapsed_s):
            return ZERO
        return Velocity(
            _towards(self._moving.linear_mps, self._told.linear_mps, self.rule.deceleration * elapsed_s),
            _towards(self._moving.angular_radps, self._told.angular_radps, self.rule.angular_deceleration * elapsed_s),
        )


def _towards(now: float, wanted: float, most: float) -> float:
    return min(max(wanted, now - most), now + most)
