"""Limits commands so that the robot can stop before obstacles: pure functions, and a class with their state.

The path of a command is the arc that it drives the robot along. The speed on it is limited so that the robot stops
before the first obstacle that its footprint would hit, after its reaction time and with its deceleration; the limit
therefore grows with the square root of the free distance. Obstacles that get farther away, or that the footprint
passes, are ignored, so that the robot can always back out and turn away.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.config import CollisionMonitorConfig
from handsteer.control.assist import Around, assisted
from handsteer.control.footprint import (
    Points,
    after,
    braking,
    drifted,
    fastest_mps,
    gaps,
    least_gaps,
    on_a_circle,
    quickest_mps,
    reach_m,
    seen_from,
)
from handsteer.control.moving import MotionOfPoints, with_room
from handsteer.doors import Assist
from handsteer.types import ZERO, Velocity, changed_towards

_PAD_M = 0.02
"""Minimum distance of obstacles from the robot, on all sides."""

# The pad grows with speed, because the predicted path becomes less certain.
_PAD_S = 0.03

# The noise of a scan: something already inside the pad may come nearer by at most this.
_NOISE_M = 0.01
# If the robot turns by more than this, something so near may come nearer only by ``_NEARER_M``.
_SWING_RAD = 0.03
_NEARER_M = 0.001
# Share of the robot's own speed: something near that approaches more slowly is being passed.
_GLANCING = 0.05
_CREEP_M = 0.06
_STEP_M = 0.03
_FEWEST_STEPS, _MOST_STEPS = 8, 400
# Of longer ways the end is left out: with longer steps, the robot would step over a wall.
_LONGEST_STEP_M = 0.1
# Only every third pose is checked: the others are within two steps of one, slightly more by rounding of the summed
# poses.
_ROUGHLY = 2.1
_SLOWEST = 0.005
_NOTHING_MPS = 1e-6
# After so long without odometry or commands, and with another clock, earlier scans say nothing of what moves.
_LOST_S = 1.0
# Shares of linear and angular velocity to try if a velocity is too fast. Those that keep the turn come first, because
# turning leads away from most obstacles.
_LESS = ((1.0, 1.0), (0.75, 1.0), (0.5, 1.0), (0.25, 1.0), (0.0, 1.0), (1.0, 0.5), (1.0, 0.0), (0.5, 0.5), (0.0, 0.5))


@dataclass(frozen=True)
class Hit:
    """An obstacle in the robot's path.

    Attributes:
        x: Forward of the base frame, in metres.
        y: To the left of the base frame, in metres.
        gap_m: Current distance from the footprint.
        time_s: Time until the robot would hit it, in seconds.
    """

    x: float
    y: float
    gap_m: float
    time_s: float

    def describe(self, rule: CollisionMonitorConfig) -> str:
        """Return its position in words, such as ``obstacle 0.42 m ahead``."""
        side = "to the left" if self.y > 0 else "to the right"
        where = "ahead" if self.x >= rule.front else "behind" if self.x <= -rule.back else side
        return f"obstacle {max(0.0, self.gap_m):.2f} m {where}"


def limit(
    wanted: Velocity,
    points: Points,
    rule: CollisionMonitorConfig,
    moving: Velocity = ZERO,
    drift: Points | None = None,
) -> tuple[Velocity, Hit | None]:
    """Return the velocity to command instead of ``wanted``, and the obstacle that limits it, or None.

    The result is never faster than ``wanted`` and never changes direction. A slowed robot may still turn as fast as it
    could in place, so its path becomes tighter. While the robot changes its velocity, it does not yet follow the path
    of the command: obstacles on the path until then, and on the braking path from there, count too. If a collision
    cannot be avoided, the velocity with the latest one is returned; zero, if something comes.

    Args:
        wanted: Velocity requested by signs or steering; finite.
        points: Current obstacles.
        rule: Footprint, margin and decelerations.
        moving: Current velocity of the robot.
        drift: Velocities of the points, (N, 2) in m/s; None if none moves. Of what moves, the robot keeps clear until
            it stands.
    """
    if wanted.is_zero or not len(points):
        return wanted, None
    points, drift = _within_reach(wanted, points, rule, moving, drift)
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
        met = _met_while_braking(moving, slower, points, rule, drift)
        if met is None:
            return slower, None if slower == wanted else hit
        hit = hit or met
        # Whatever it does, it is met by what comes: then it had better stand.
        if met.time_s > latest_s and drift is None:
            best, latest_s = slower, met.time_s
    return best, None if best == wanted else hit


def _within_reach(
    wanted: Velocity, points: Points, rule: CollisionMonitorConfig, moving: Velocity, drift: Points | None
) -> tuple[Points, Points | None]:
    """Return those of ``points``, and of ``drift``, that the robot could reach, even if it is slowed."""
    highest = _highest(moving, wanted)
    way_m = highest.linear_mps * (rule.reaction_time + _braking_s(highest, rule))
    far_m = way_m + rule.margin + _CREEP_M + reach_m(rule) + pad_m(fastest_mps(highest, rule)) + _NOISE_M
    x, y = points[:, 0], points[:, 1]
    if drift is None or not drift.any():
        return points[x * x + y * y <= far_m * far_m], None
    comes_m = np.linalg.norm(drift, axis=1) * (rule.reaction_time + _braking_s(highest, rule))
    near = x * x + y * y <= (far_m + comes_m) ** 2
    return points[near], drift[near] if drift[near].any() else None


def _highest(one: Velocity, other: Velocity) -> Velocity:
    """Return the higher linear and angular speeds of the two."""
    linear = max(abs(one.linear_mps), abs(other.linear_mps))
    return Velocity(linear, max(abs(one.angular_radps), abs(other.angular_radps)))


def _braking_s(velocity: Velocity, rule: CollisionMonitorConfig) -> float:
    return max(abs(velocity.linear_mps) / rule.deceleration, abs(velocity.angular_radps) / rule.angular_deceleration)


def _scaled(velocity: Velocity, linear: float, angular: float) -> Velocity:
    if linear == angular == 1.0:
        return velocity
    v, w = velocity.linear_mps * linear, velocity.angular_radps * angular
    return Velocity(v if abs(v) >= _SLOWEST else 0.0, w if abs(w) >= _SLOWEST else 0.0)


def _share(velocity: Velocity, points: Points, rule: CollisionMonitorConfig) -> tuple[float, Hit | None]:
    """Return the share of ``velocity``, 0 to 1, at which the robot can stop in time, and the obstacle that limits it.

    Times are at the full velocity: a share s takes s * delay + s² * braking / 2.
    """
    delay_s = rule.reaction_time
    fastest = fastest_mps(velocity, rule)
    if fastest < _NOTHING_MPS:
        return 1.0, None
    braking_s = _braking_s(velocity, rule)
    # The margin applies to driving only; a turn in place may end at the pad, so that a robot at a wall can turn away.
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
    """Return the first obstacle hit at constant ``velocity`` within ``horizon_s`` seconds, or None."""
    fastest = fastest_mps(velocity, rule)
    if fastest < _NOTHING_MPS or horizon_s <= 0:
        return None
    # At low speed too, the prediction must reach far enough to show that something near comes nearer.
    seen_s = max(horizon_s, _CREEP_M / fastest)
    times_s = steps_s(fastest, seen_s)
    poses = on_a_circle(velocity, times_s)
    hit = met(poses, times_s, points, rule, pad_m=_PAD_M, fastest_mps=fastest)
    return hit if hit and hit.time_s <= horizon_s else None


def _met_while_braking(
    moving: Velocity, target: Velocity, points: Points, rule: CollisionMonitorConfig, drift: Points | None
) -> Hit | None:
    """Return the first obstacle hit if ``target`` is commanded now and zero one reaction time later, or None."""
    highest = _highest(moving, target)
    fastest = fastest_mps(highest, rule)
    if fastest < _NOTHING_MPS:
        return None
    # A robot that reverses its direction stops on the way, and has to stop again.
    times_s = steps_s(fastest + quickest_mps(drift), rule.reaction_time + _braking_s(highest, rule))
    poses = braking(moving, target, rule, rule.reaction_time, times_s)
    return met(poses, times_s, points, rule, pad_m=pad_m(fastest), fastest_mps=fastest, drift=drift)


def pad_m(fastest_mps: float) -> float:
    """Return the distance kept on all sides of a robot whose fastest corner moves at ``fastest_mps``, in metres."""
    return _PAD_M + _PAD_S * fastest_mps


def steps_s(fastest_mps: float, seconds: float) -> Points:
    """Return times from 0 on, (K,), between which the fastest corner moves by 3 cm; by up to 10 cm if it is far.

    They end at ``seconds``, or after 40 m.

    Args:
        fastest_mps: Speed of the fastest corner, above 0; plus that of what comes, if anything moves.
        seconds: The last of them, above 0.
    """
    seconds = min(seconds, _MOST_STEPS * _LONGEST_STEP_M / fastest_mps)
    steps = min(max(math.ceil(fastest_mps * seconds / _STEP_M), _FEWEST_STEPS), _MOST_STEPS)
    return np.arange(steps + 1, dtype=np.float64) * (seconds / steps)


def met(
    poses: Points,
    times_s: Points,
    points: Points,
    rule: CollisionMonitorConfig,
    *,
    pad_m: float,
    fastest_mps: float,
    drift: Points | None = None,
) -> Hit | None:
    """Return the first obstacle that the footprint hits along ``poses`` (K, 3) at ``times_s`` (K,), or None.

    Args:
        poses: x, y and yaw in the base frame of now; the first is zero.
        times_s: Of the poses, at equal intervals from 0.
        points: Current obstacles.
        rule: Size of the footprint.
        pad_m: How near is a hit; something nearer already is one only if it comes nearer.
        fastest_mps: Speed of the fastest corner.
        drift: Velocities of the points, (N, 2) in m/s; None if none moves.
    """
    # Most points stay far away, which a few poses are enough to show.
    beyond_m = pad_m + _NOISE_M + _ROUGHLY * fastest_mps * times_s[1]
    seen = seen_from(poses[1::3], points)
    if drift is not None:
        seen = drifted(seen, poses[1::3], times_s[1::3], drift)
        beyond_m += _ROUGHLY * quickest_mps(drift) * float(times_s[1])
    is_near = least_gaps(*seen, rule).min(axis=0) <= beyond_m
    near = points[is_near]
    if not len(near):
        return None
    seen = seen_from(poses, near)
    if drift is not None:
        seen = drifted(seen, poses, times_s, drift[is_near])
    gap = gaps(*seen, rule)
    gap_m = float(gap[0].min())
    # If something is inside the pad already, the robot may still pass obstacles that come no nearer. A corner that
    # swings towards a wall comes nearer by less than a scan's noise, but does so in every step.
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
    """Return the index of the first point in ``is_met`` (K, N), and when, interpolated between ``times_s`` (K,)."""
    at = max(1, int(is_met.any(axis=1).argmax()))
    met = np.flatnonzero(is_met[: at + 1].any(axis=0))
    before, after = gap[at - 1, met], gap[at, met]
    parts = np.minimum(np.maximum((before - least_m) / np.maximum(before - after, 1e-9), 0.0), 1.0)
    first = int(parts.argmin())
    return int(met[first]), float(times_s[at - 1] + parts[first] * (times_s[at] - times_s[at - 1]))


class ObstacleLimiter:
    """Keeps the newest scan, and an estimate of the robot's velocity.

    Args:
        rule: Footprint, margin, decelerations and timeout; may be changed later.

    Attributes:
        rule: As above.
        hit: The obstacle that limited the last command; None if it was not limited, or without a scan.
        assist: Changes commands before they are limited; None for none.
        max_angular_radps: The limit of the turns of ``assist``.
        avoided: The obstacle that ``assist`` steered around; None if it did not.
    """

    def __init__(self, rule: CollisionMonitorConfig) -> None:
        self.rule = rule
        self._points: Points | None = None
        self._drift: Points | None = None
        self._motion = MotionOfPoints()
        self._driven_s = -math.inf
        self._measured_s = -math.inf
        self._moving = self._commanded = ZERO
        self._moving_s = self._commanded_s = -math.inf
        self.hit: Hit | None = None
        self.assist: Assist | None = None
        self.max_angular_radps = 0.0
        self.avoided: Hit | None = None

    def see(self, points: Points, measured_s: float) -> None:
        """Store a scan measured at ``measured_s``, in seconds of the caller's clock."""
        self._measured_s = measured_s
        # Earlier scans are seen from where the robot is by now.
        late_s, turning = max(0.0, self._driven_s - measured_s), Velocity(0.0, self._moving.angular_radps)
        drift = self._motion.see(after(self._moving, late_s, points), measured_s)
        drift = after(turning, -late_s, drift)
        self._points, self._drift = with_room(points, drift, self._motion.paused_mps, self.rule)

    def forget(self) -> None:
        """Forget the scan: nothing is known until the next one."""
        self._points = None
        self._motion.forget()

    def feel(self, moving: Velocity, measured_s: float) -> None:
        """Store the robot's velocity from odometry, measured at ``measured_s``; finite.

        Without odometry, the robot is assumed to change its velocity at its guaranteed deceleration; most robots
        accelerate faster.
        """
        self._drive(measured_s)
        self._moving, self._moving_s = moving, measured_s

    def _drive(self, until_s: float) -> None:
        """Move the earlier scans; a time that has been driven, as odometry comes late, is not driven again."""
        seconds = until_s - self._driven_s
        if abs(seconds) > _LOST_S:
            self._motion.forget()
        elif seconds > 0.0:
            self._motion.drive(self._moving, seconds)
        else:
            return
        self._driven_s = until_s

    def silence_s(self, now_s: float) -> float:
        """Return the age of the newest scan at ``now_s``; infinity if there is none."""
        return max(0.0, now_s - self._measured_s)

    def is_blind(self, now_s: float) -> bool:
        """Return whether there is no scan, or only a stale one, at ``now_s``."""
        return self._points is None or self.silence_s(now_s) > self.rule.source_timeout

    def limit(self, wanted: Velocity, now_s: float) -> Velocity:
        """Return the velocity to command at ``now_s``: zero without a valid scan, else as :func:`limit`.

        With ``assist`` it is a limit of what that makes of ``wanted``. The points are moved by the robot's estimated
        motion since the scan.
        """
        self.feel(self._followed(now_s), now_s)
        self.hit, self.avoided, velocity = None, None, ZERO
        if self._points is not None and not self.is_blind(now_s):
            points, drift = self._points_at(now_s, self._points)
            if self.assist is not None:
                around = Around(points, self._moving, self.rule, self.max_angular_radps, now_s, drift)
                wanted, self.avoided = assisted(self.assist, wanted, around)
            velocity, self.hit = limit(wanted, points, self.rule, self._moving, drift)
        self._commanded, self._commanded_s = velocity, now_s
        return velocity

    def _points_at(self, now_s: float, points: Points) -> tuple[Points, Points | None]:
        """Return where the ``points`` of the newest scan are at ``now_s``, and their velocities."""
        silence_s, drift = self.silence_s(now_s), self._drift
        if drift is None or not drift.any():
            return after(self._moving, silence_s, points), None
        turned = Velocity(0.0, self._moving.angular_radps)
        return after(self._moving, silence_s, points + silence_s * drift), after(turned, silence_s, drift)

    def _followed(self, now_s: float) -> Velocity:
        """Return the velocity at ``now_s`` of a robot that follows the last command at the configured decelerations."""
        elapsed_s = max(0.0, now_s - max(self._moving_s, self._commanded_s))
        if not math.isfinite(elapsed_s):
            return ZERO
        change = Velocity(self.rule.deceleration * elapsed_s, self.rule.angular_deceleration * elapsed_s)
        return changed_towards(self._commanded, self._moving, change)
