"""Decides by odometry whether the robot does what is commanded: pure rules without a clock."""

import math
from typing import Final

from handsteer.timeouts import NOT_FOLLOWING_S, ODOMETRY_S, OPPOSES_S, STOOD_BY_ITSELF_S
from handsteer.types import ZERO, Velocity

_SLACK_S: Final = 1e-9
_STILL_AS_FAST: Final = 0.9
"""A robot that moves against its command brakes if it loses more than the rest of its speed in the time it is given."""


class Following:
    """Checks by odometry whether the robot does what is commanded; without odometry, it assumes so.

    Args:
        checks_motion: Whether it has to move as commanded; otherwise only that its odometry does not stop.

    Attributes:
        is_silent: Whether its odometry has stopped.
    """

    def __init__(self, *, checks_motion: bool = True) -> None:
        self._checks_motion = checks_motion
        self.is_silent = False
        self._measured: Velocity | None = None
        self._age_s = 0.0
        self._refuses_s = 0.0
        self._follows: Velocity | None = None
        self._opposition = (_Opposition(0.15, 0.1), _Opposition(0.4, 0.25))

    def note(self, measured: Velocity, since_step_s: float = 0.0) -> None:
        """Record a velocity from odometry; one that is not finite only shows that there should be some.

        Args:
            measured: What the robot does now.
            since_step_s: Time since the last :meth:`step`, in seconds, which the next one adds. It does not count for
                the first odometry: a node takes long to start on a busy machine. It does for later odometry, as a node
                that was stalled has missed what the robot did.
        """
        if measured.is_finite:
            self._age_s = 0.0 if self._measured is not None else -since_step_s
            self._measured = measured
        elif self._measured is None:
            self._measured = ZERO

    def step(self, dt_s: float, commanded: Velocity) -> str | None:
        """Advance time by ``dt_s`` seconds of ``commanded``; return what is wrong with the robot, or None."""
        if self._measured is None:
            return None
        self._age_s += dt_s
        self.is_silent = self._age_s >= ODOMETRY_S
        if self.is_silent:
            return "the robot's odometry has stopped"
        if not self._checks_motion:
            return None
        if self._opposes(dt_s, commanded, self._measured):
            return "the robot moved against its commands"
        done = _done(commanded, self._measured)
        turns_round = self._follows is not None and not _same_way(commanded, self._follows)
        if not done or turns_round:
            self._follows = None
        elif max(done) >= 0.5:
            self._follows = commanded
        stands = bool(done) and max(map(abs, done)) <= 0.1
        self._refuses_s = self._refuses_s + dt_s if stands else 0.0
        if self._refuses_s < (STOOD_BY_ITSELF_S if self._follows else NOT_FOLLOWING_S):
            return None
        self._refuses_s = 0.0
        self._follows = None
        return "the robot did not follow its commands"

    def _opposes(self, dt_s: float, commanded: Velocity, measured: Velocity) -> bool:
        linear, angular = self._opposition
        moves_back = linear.step(dt_s, commanded.linear_mps, measured.linear_mps)
        turns_back = angular.step(dt_s, commanded.angular_radps, measured.angular_radps)
        return moves_back or turns_back


class _Opposition:
    """Whether a robot moves against its command along one axis, in m/s or rad/s.

    Not meant are a robot that was moving so when the command came and brakes, one that slips back for a moment or
    slowly as on a slope, and one that is pushed at another speed than the commanded one.

    Args:
        least_commanded: Slower commands are not judged: odometry is noisy there.
        least_measured: Neither is slower motion.
    """

    def __init__(self, least_commanded: float, least_measured: float) -> None:
        self._least_commanded = least_commanded
        self._least_measured = least_measured
        self._way = 0.0
        self._came_so = False
        self._fastest = self._lasts_s = 0.0

    def step(self, dt_s: float, commanded: float, measured: float) -> bool:
        """Advance time by ``dt_s`` seconds; return whether it has moved against the command for too long."""
        against = -math.copysign(measured, measured * commanded) if measured * commanded else 0.0
        if commanded * self._way <= 0.0:
            self._way, self._came_so = commanded, against > 0.0
        elif against <= 0.0:
            self._came_so = False
        is_clear = against >= self._least_measured and 0.5 <= against / abs(commanded) <= 2.0
        if not is_clear or abs(commanded) < self._least_commanded:
            self._fastest = self._lasts_s = 0.0
            return False
        if against < _STILL_AS_FAST * self._fastest:
            self._fastest, self._lasts_s = against, 0.0  # it brakes
        self._fastest = max(self._fastest, against)
        self._lasts_s += dt_s
        return self._lasts_s >= (NOT_FOLLOWING_S if self._came_so else OPPOSES_S) - _SLACK_S


def _done(commanded: Velocity, measured: Velocity) -> list[float]:
    """Return measured over commanded velocity, linear and angular, where the command is large enough to compare."""
    parts = ((commanded.linear_mps, measured.linear_mps, 0.1), (commanded.angular_radps, measured.angular_radps, 0.2))
    return [does / wanted for wanted, does, least in parts if abs(wanted) >= least]


def _same_way(one: Velocity, other: Velocity) -> bool:
    return one.linear_mps * other.linear_mps >= 0 and one.angular_radps * other.angular_radps >= 0
