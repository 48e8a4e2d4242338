"""The simulated operator: sees the robot late, and wants a velocity that follows the ideal path.

The steering is the model that C. Vozar and D. Tilbury fitted to 31 people, "Driver modeling for teleoperation with time
delay" (IFAC World Congress 2014): a PD law on the projected lateral displacement, the distance of the path from a point
ahead of the robot. Here the gains are relative to those that follow an arc exactly (2 v / L², as in pure pursuit), so
that one pair of gains fits all speeds. The operator does not predict: only ``kd`` compensates for the delay.

The speed is as high as the operator's pace, the path's curvature, the displacement, the heading and the distance left
to a stop permit.
"""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from handsteer.plugins.bench.courses import Course, Path, off_stop
from handsteer.types import ZERO, Pose2D, Velocity

DECISION_S = 0.05
"""How often the operator decides. People correct a few times a second; the limb smooths what lies between."""

REACTION_S = 0.25
"""Default delay of what the operator sees: reaction time to a visual change, without the time of the movement."""

_SHORTEST_M = 0.45
_SIDEWAYS_MPS2 = 0.6
_BRAKE_MPS2 = 0.45
_SLOWEST_MPS = 0.12
_CLEAR_S = 0.3
_TURNS_RAD = 0.9
_STUCK_S, _STUCK_M = 1.0, 0.06
_BACK_M, _BACK_MPS = 0.35, 0.25
_PATIENT_S, _HELD_S = 0.7, 6.0
_LOOKS_S, _BETWEEN_GAPS_S = 4.0, 10.0

# Perception: errors of the seen place, heading, and speed, which change slowly (an Ornstein-Uhlenbeck process).
_SEEN_M, _SEEN_RAD, _SEEN_S = 0.02, math.radians(1.5), 0.5


@dataclass(frozen=True)
class Skill:
    """How an operator drives with an interface; chosen for each interface by the same search.

    Attributes:
        pace_mps: Highest speed that is wanted.
        kp: Gain of the displacement, relative to pure pursuit.
        kd: Gain of its rate, in seconds.
        projection_s: How far ahead of the robot the displacement is judged, in seconds of driving.
        reluctance: How small a change is not worth an act, relative; its meaning depends on the interface.
    """

    pace_mps: float = 0.6
    kp: float = 1.0
    kd: float = 0.25
    projection_s: float = 0.9
    reluctance: float = 0.5


@dataclass(frozen=True)
class Seen:
    """What is seen at one moment: pose and velocity of the robot, and whether it touches an obstacle."""

    pose: Pose2D
    velocity: Velocity
    touches: bool = False


_PATIENCE_S = 0.75
"""Delay that halves the operator's pace."""

_LEAD_S, _LEAD = 0.15, 0.85
"""Best ratio kd / kp without delay, and its increase for each second of delay, by ``scripts/bench_operator.py``."""


def adapted(skill: Skill, delay_s: float) -> Skill:
    """Return ``skill`` as used with ``delay_s`` seconds of additional delay in the loop, for every interface alike.

    As in the model of Vozar and Tilbury, the ratio kd / kp rises with the delay: to what is best for it, unless it is
    higher anyway. The operator also slows down, so that the robot drives no further unseen.
    """
    delay_s = max(0.0, delay_s)
    kd = max(skill.kd, skill.kp * (_LEAD_S + _LEAD * delay_s)) if delay_s else skill.kd
    return replace(skill, pace_mps=skill.pace_mps / (1.0 + delay_s / _PATIENCE_S), kd=kd)


class Attention:
    """Whether the operator looks; else what was wanted last is wanted further.

    Args:
        gap_s: Length of a gap; 0 for an operator who always looks.
        random: Source of the times between two gaps, which are 4 s and more, 10 s in the mean.
    """

    def __init__(self, gap_s: float, random: np.random.Generator) -> None:
        self._gap_s, self._random = gap_s, random
        self._left_s = self._next_s()

    def looks(self) -> bool:
        """Advance time by :data:`DECISION_S`; return whether the operator looks."""
        self._left_s -= DECISION_S
        if self._left_s <= -self._gap_s:
            self._left_s = self._next_s()
        return not self._gap_s or self._left_s > 0.0

    def _next_s(self) -> float:
        return _LOOKS_S + float(self._random.exponential(_BETWEEN_GAPS_S - _LOOKS_S))


class Operator:
    """Wants a velocity, from what was seen a delay ago.

    Args:
        course: What to drive.
        skill: Gains and pace.
        delay_s: Reaction time, and how late the picture of the robot is, in seconds.
        random: Source of the errors of perception.
        attention: When the operator looks; always if None.
    """

    def __init__(
        self,
        course: Course,
        skill: Skill,
        delay_s: float,
        random: np.random.Generator,
        attention: Attention | None = None,
    ) -> None:
        self._course, self._path, self._skill = course, course.path, skill
        self._late: deque[Seen] = deque(maxlen=1 + round(delay_s / DECISION_S))
        self._delay_s = delay_s
        self._random = random
        self._attention = attention or Attention(0.0, np.random.default_rng(0))
        self._wanted = ZERO
        self._errors = np.zeros(3)
        self._s_m = 0.0
        self._before: float | None = None
        self._slope = 0.0
        self._stuck_at: Pose2D | None = None
        self._stuck_s = self._stood_s = 0.0
        self._decisions = self._back_until = 0

    def decide(self, seen: Seen) -> Velocity:
        """Return the velocity wanted now; ``seen`` is what happens now, of which the operator learns later.

        Call it every :data:`DECISION_S`.
        """
        self._late.append(seen)
        self._decisions += 1
        if self._attention.looks():
            self._wanted = self._decided()
        return self._wanted

    def _decided(self) -> Velocity:
        if len(self._late) < (self._late.maxlen or 1):
            return ZERO
        then = self._perceived(self._late[0])
        if self._is_backing_off(then):
            self._before = None
            return Velocity(-_BACK_MPS, 0.0)
        return self._impatient(self._follow(then), then)

    def _perceived(self, seen: Seen) -> Seen:
        keep = math.exp(-DECISION_S / _SEEN_S)
        self._errors = keep * self._errors + math.sqrt(1 - keep**2) * self._random.standard_normal(3)
        dx, dy = (self._errors[:2] * _SEEN_M).tolist()
        pose = seen.pose
        yaw = pose.yaw + float(self._errors[2]) * _SEEN_RAD
        return replace(seen, pose=Pose2D(pose.x + dx, pose.y + dy, yaw))

    def _follow(self, seen: Seen) -> Velocity:
        pose, path = seen.pose, self._path
        here = path.nearest(pose.x, pose.y, self._s_m)
        self._s_m = float(path.s[here])
        speed = self._speed(seen, here)
        reach = max(_SHORTEST_M, self._skill.projection_s * max(abs(seen.velocity.linear_mps), abs(speed)))
        displacement = projected_displacement(path, pose, self._s_m, reach)
        if self._before is not None:
            # The rate as people see it: over a few moments.
            self._slope += 0.4 * ((displacement - self._before) / DECISION_S - self._slope)
        self._before = displacement
        gain = 2.0 * max(speed, _SLOWEST_MPS) / reach**2
        skill = self._skill
        turn = gain * (skill.kp * displacement + skill.kd * self._slope)
        off = math.remainder(float(path.headings[path.index(self._s_m + reach / 2)]) - pose.yaw, math.tau)
        if abs(off) > _TURNS_RAD:
            return Velocity(0.0, math.copysign(min(1.0, abs(off)), off))
        if speed <= 0.0:
            turn = 0.0
        return Velocity(speed, max(-2.0, min(2.0, turn)))

    def _speed(self, seen: Seen, here: int) -> float:
        """Return the wanted speed at the index ``here`` of the path; negative after the place to stop at."""
        path, course, pace = self._path, self._course, self._skill.pace_mps
        end = here + 1 + round((0.3 + 0.9 * pace) / float(path.s[1]))
        ahead = slice(here, end if course.stop_m is None else min(end, path.index(course.stop_m)))
        bend = float(np.abs(path.curvatures[ahead]).max(initial=0.0))
        tight = float(course.clearances[ahead].min(initial=1.0))
        x, y = path.points[here].tolist()
        off = math.hypot(seen.pose.x - x, seen.pose.y - y)
        speed = min(
            pace,
            math.sqrt(_SIDEWAYS_MPS2 / max(bend, 1e-6)),
            max(_SLOWEST_MPS, tight / _CLEAR_S),
            max(_SLOWEST_MPS, pace * (1.5 - off / 0.3)),
        )
        if course.stop_m is None:
            return speed
        return self._braked(speed, seen, course.stop_m)

    def _braked(self, speed: float, seen: Seen, stop_m: float) -> float:
        """Return ``speed`` reduced for the place to stop at."""
        assert self._course.world.stop is not None
        stop = self._course.world.stop
        left = -off_stop(stop, seen.pose)[0] if self._s_m > stop_m - 1.0 else stop_m - self._s_m
        left -= self._delay_s * seen.velocity.linear_mps  # people know that they see it late
        if abs(left) < stop.tolerance / 2:
            return 0.0
        # v²/2a + v t = left: what remains after the delay of the hand and of the robot.
        lag = 0.3 * _BRAKE_MPS2
        fastest = math.sqrt(lag**2 + 2 * _BRAKE_MPS2 * abs(left)) - lag
        fastest = max(_SLOWEST_MPS / 2, fastest)
        return min(speed, fastest) if left > 0 else -min(0.2, fastest)

    def _is_backing_off(self, seen: Seen) -> bool:
        """Return whether the robot is stuck at an obstacle, or before it by an assist, and has to back off first."""
        if self._decisions < self._back_until:
            return True
        pose, where = seen.pose, self._stuck_at
        if not seen.touches or where is None or math.hypot(pose.x - where.x, pose.y - where.y) > _STUCK_M:
            self._stuck_at, self._stuck_s = pose, 0.0
        self._stuck_s += DECISION_S
        if self._stuck_s <= _STUCK_S + self._delay_s and self._stood_s <= _HELD_S + self._delay_s:
            return False
        self._stuck_at, self._stood_s = None, 0.0
        self._back_until = self._decisions + round((_BACK_M / _BACK_MPS + self._delay_s) / DECISION_S)
        return True

    def _impatient(self, wanted: Velocity, seen: Seen) -> Velocity:
        """Return ``wanted``, larger the longer the robot has been standing in spite of it."""
        stands = abs(seen.velocity.linear_mps) < 0.02 and abs(seen.velocity.angular_radps) < 0.1
        self._stood_s = self._stood_s + DECISION_S if stands and not wanted.is_zero else 0.0
        urge = 1.0 + max(0.0, self._stood_s - _PATIENT_S)
        linear = math.copysign(min(abs(wanted.linear_mps) * urge, self._skill.pace_mps), wanted.linear_mps)
        return Velocity(linear, max(-2.0, min(2.0, wanted.angular_radps * urge)))


def projected_displacement(path: Path, pose: Pose2D, s_m: float, reach_m: float) -> float:
    """Return how far left of the point ``reach_m`` straight ahead of the robot the path is, in metres.

    Args:
        path: The ideal path.
        pose: The robot's pose.
        s_m: Where along the path the robot is.
        reach_m: Distance of the projected point.
    """
    x, y = path.points[path.index(s_m + reach_m)].tolist()
    return float(-math.sin(pose.yaw) * (x - pose.x) + math.cos(pose.yaw) * (y - pose.y))
