"""Slows commands so that the robot can stop before what is in its way: pure functions, and what they remember.

A command's way is the circle that it drives the robot along. The robot may be as fast on it as lets it stop in front of
the first obstacle that its footprint would meet, after its reaction time and by its own braking: the square root of the
free way, as brakes have it. What gets farther away, or passes beside the footprint, does not count, so that backing out
and turning away stay free.
"""

import math
from dataclasses import dataclass

import numpy as np

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import braking, fastest_mps, gaps, on_a_circle, reach_m, seen_from
from handsteer.control.scan_points import Points
from handsteer.control.velocity import ZERO, Velocity

_PAD_M = 0.02
"""Nothing is to come nearer to the robot, be it beside it."""

# The faster a robot changes how it moves, the less is sure where that leads.
_PAD_S = 0.03

# Who is nearer already may come no nearer than by this, which is the noise of a scan.
_NOISE_M = 0.01
# Of the robot's own speed: what is near and comes nearer so slowly is passed along.
_GLANCING = 0.05
_CREEP_M = 0.06
_STEP_M = 0.03
_FEWEST_STEPS, _MOST_STEPS = 8, 400
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
    return np.linspace(0.0, seconds, steps + 1)


def _met(
    poses: Points, times_s: Points, points: Points, rule: CollisionMonitorConfig, *, pad_m: float, fastest_mps: float
) -> Hit | None:
    """Return what the footprint meets first on its way by ``poses`` (K, 3) at ``times_s`` (K,); None for nothing."""
    way_m = float(np.hypot(poses[:, 0], poses[:, 1]).max())
    near = points[np.hypot(points[:, 0], points[:, 1]) <= way_m + reach_m(rule) + pad_m]
    if not len(near):
        return None
    gap = gaps(*seen_from(poses, near), rule)
    # Where something is within the pad already, the robot may still pass by what gets no nearer.
    met_s = _met_s(gap, times_s, min(pad_m, float(gap[0].min()) - _NOISE_M))
    comes_nearer = gap[1] - gap[0] < -_GLANCING * fastest_mps * times_s[1]
    met_s[(gap[0] < pad_m) & comes_nearer & np.isfinite(met_s)] = 0.0
    first = int(met_s.argmin())
    if not math.isfinite(met_s[first]):
        return None
    return Hit(float(near[first, 0]), float(near[first, 1]), float(gap[0, first]), float(met_s[first]))


def _met_s(gap: Points, times_s: Points, least_m: float) -> Points:
    """Return when each point first is as near as ``least_m``, (N,), from its gaps at ``times_s``, (K, N); else inf."""
    is_met = gap <= least_m
    step = is_met.argmax(axis=0)
    met_s = np.full(gap.shape[1], np.inf)
    (met,) = np.nonzero(is_met.any(axis=0))
    at = np.maximum(step[met], 1)
    before, after = gap[at - 1, met], gap[at, met]
    part = np.clip((before - least_m) / np.maximum(before - after, 1e-9), 0.0, 1.0)
    met_s[met] = times_s[at - 1] + part * (times_s[at] - times_s[at - 1])
    return met_s


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
        self._told_s = -math.inf
        self.hit: Hit | None = None

    def see(self, points: Points, measured_s: float) -> None:
        """Take a scan that was measured at ``measured_s``, in seconds of the caller's clock."""
        self._points, self._measured_s = points, measured_s

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
        self._moving = self._followed(now_s)
        self.hit, said = None, ZERO
        if self._points is not None and not self.is_blind(now_s):
            moved = on_a_circle(self._moving, np.array([self.silence_s(now_s)]))
            points = np.stack(seen_from(moved, self._points), axis=-1)[0]
            said, self.hit = limit(wanted, points, self.rule, self._moving)
        self._told, self._told_s = said, now_s
        return said

    def _followed(self, now_s: float) -> Velocity:
        """Return how a robot with these brakes moves at ``now_s``, after what it was told."""
        elapsed_s = max(0.0, now_s - self._told_s)
        if not math.isfinite(elapsed_s):
            return ZERO
        return Velocity(
            _towards(self._moving.linear_mps, self._told.linear_mps, self.rule.deceleration * elapsed_s),
            _towards(self._moving.angular_radps, self._told.angular_radps, self.rule.angular_deceleration * elapsed_s),
        )


def _towards(now: float, wanted: float, most: float) -> float:
    return min(max(wanted, now - most), now + most)
