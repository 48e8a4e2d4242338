"""When a robot may be set in motion, and how fast it may get faster: pure rules, told what happens and how time passes.

A robot moves only while there is a live reason for it. :class:`Safety` says whether who drives may be followed,
:class:`Following` whether the robot does what it is told, :class:`Allowance` how many signs count, and :class:`Ramp`
how fast what is commanded may grow. How long each waits stands in :mod:`handsteer.timeouts`.
"""

import math

from handsteer.config import ControlConfig
from handsteer.timeouts import (
    ARMING_S,
    FAULT_GAP_S,
    MOST_OF_ONE_NONE_S,
    NEUTRAL_S,
    NOT_FOLLOWING_S,
    ODOMETRY_S,
    STEERING_AT_START_S,
    STOOD_BY_ITSELF_S,
)
from handsteer.types import NONE, Velocity

_SLACK_S = 1e-9


class Safety:
    """Keeps the robot standing until neutral was seen.

    Neutral, for signs, is a sign that stops, or an empty picture for :data:`~handsteer.timeouts.NEUTRAL_S`; a ``NONE``
    that a fault has made is neither. For steering it is a zero, or a pause. After a Stop was reset, or another robot
    was chosen, each has to show it once. With ``arming`` each has to do so after the start too, and after every fault;
    a pause of steering that was not at zero is then a fault as well. So a hand that is up already, or a stick that
    is held, moves nothing.

    Args:
        config: How long signs and steering may pause.
        arming: Whether neutral has to be seen after the start and after faults.

    Attributes:
        is_stopped: Whether somebody has stopped the robot until it is reset.
    """

    def __init__(self, config: ControlConfig, *, arming: bool) -> None:
        self._config = config
        self._arming = arming
        self._age_s = 0.0
        self._sign_age_s = math.inf
        self._steering_age_s = math.inf
        self._last_steering_was_zero = True
        self._neutral_s = 0.0
        self._was_fault = False
        self._signs_wait: str | None = "has just started" if arming else None
        self._steering_waits = arming
        self.is_stopped = False

    @property
    def signs_wait(self) -> str | None:
        """Why signs have to show neutral first, as ``no sign came``; empty after a reset, None when they need not."""
        return self._signs_wait

    @property
    def steering_waits(self) -> bool:
        """Whether steering has to let go first."""
        return self._steering_waits

    def step(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, >= 0; signs that do not come for as long as they may are a fault."""
        self._age_s += dt_s
        self._sign_age_s += dt_s
        self._steering_age_s += dt_s
        if self._config.sign_timeout <= self._sign_age_s < math.inf:
            self.fault("no sign came")

    def stop(self) -> None:
        """Stop the robot until :meth:`reset`."""
        self.is_stopped = True

    def reset(self) -> None:
        """End a Stop; who drives has to show neutral first. Without a Stop it changes nothing."""
        if self.is_stopped:
            self.is_stopped = False
            self.disarm()

    def disarm(self, why: str = "") -> None:
        """Let signs and steering show neutral before either is followed again."""
        self._signs_wait, self._steering_waits = why, True
        self._neutral_s = 0.0

    def fault(self, why: str) -> None:
        """Note that something failed; with ``arming``, signs have to show neutral again."""
        self._neutral_s = 0.0
        self._was_fault = True
        if self._arming and not self._signs_wait:
            self._signs_wait = why

    def robot_is_away(self, why: str) -> None:
        """Note that nobody follows what is commanded; with ``arming``, it goes no further than standing."""
        if self._arming:
            self.disarm(why)

    def admits_sign(self, sign: str, *, stops: bool) -> bool:
        """Note a sign that came, and whether it ``stops``; return whether the robot may follow it."""
        gap_s, self._sign_age_s = self._sign_age_s, 0.0
        if sign == NONE:
            self._note_none(gap_s)
        elif stops:
            self._neutral_s = math.inf
        else:
            self._neutral_s = 0.0
        if self._neutral_s >= NEUTRAL_S - _SLACK_S and not (self._arming and self._age_s < ARMING_S):
            self._signs_wait = None
        return self._signs_wait is None and not self.is_stopped

    def admits_steering(self, *, is_zero: bool) -> bool:
        """Note a steering command, zero or not; return whether the robot may follow it."""
        age_s, self._steering_age_s = self._steering_age_s, 0.0
        # What is heard for the first time soon after the start may have been held since before it.
        is_first_at_start = math.isinf(age_s) and self._arming and self._age_s < STEERING_AT_START_S
        after_pause = age_s >= self._config.steering_timeout and not is_first_at_start
        is_lost = after_pause and self._arming and not self._last_steering_was_zero
        self._last_steering_was_zero = is_zero
        if is_lost:
            self._steering_waits = True
        if is_zero or (after_pause and not is_lost):
            self._steering_waits = False
        return not (self._steering_waits or self.is_stopped)

    def reconfigure(self, config: ControlConfig) -> None:
        """Go on with other times."""
        self._config = config

    def _note_none(self, gap_s: float) -> None:
        if gap_s >= FAULT_GAP_S:
            self.fault("recognition had no frame")
        elif not self._was_fault:
            self._neutral_s += min(gap_s, MOST_OF_ONE_NONE_S)
        else:
            self._was_fault = False  # what passed since the fault was not looked at


class Following:
    """Whether a robot whose odometry is heard does what it is told; nothing is known of one that gives none."""

    def __init__(self) -> None:
        self._measured: Velocity | None = None
        self._age_s = 0.0
        self._refuses_s = 0.0
        self._follows: Velocity | None = None

    def note(self, measured: Velocity) -> None:
        """Take what odometry says that the robot does; what is not finite says nothing."""
        if measured.is_finite:
            self._measured = measured
            self._age_s = 0.0

    def step(self, dt_s: float, commanded: Velocity) -> str | None:
        """Let ``dt_s`` seconds pass in which ``commanded`` held; return what is wrong with the robot, or None."""
        if self._measured is None:
            return None
        self._age_s += dt_s
        if self._age_s >= ODOMETRY_S:
            return "the robot's odometry has stopped"
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
        return "the robot stood though it was told to move"


class Allowance:
    """How many signs may make the robot faster, so that it gets no faster by more messages than a camera has frames.

    Signs may come in bursts; what was not used within :data:`BURST_S` is gone.
    """

    BURST_S = 0.25

    def __init__(self, rate: float) -> None:
        self.rate = rate
        self._left = math.inf

    def step(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass."""
        self._left = min(self._left + self.rate * dt_s, max(1.0, self.rate * self.BURST_S))

    def take(self) -> bool:
        """Return whether one more sign counts."""
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Ramp:
    """Limits how fast a commanded velocity grows; it falls, and changes sides through zero, as fast as it is asked to.

    Args:
        config: Limits of acceleration and jerk; 0 is none.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._linear = _Axis()
        self._angular = _Axis()

    def reconfigure(self, config: ControlConfig) -> None:
        """Go on with other limits."""
        self._config = config

    def step(self, wanted: Velocity, dt_s: float) -> Velocity:
        """Return what to command ``dt_s`` seconds after the last step."""
        config = self._config
        return Velocity(
            self._linear.step(wanted.linear_mps, dt_s, config.max_linear_acceleration, config.max_linear_jerk),
            self._angular.step(wanted.angular_radps, dt_s, config.max_angular_acceleration, config.max_angular_jerk),
        )


class _Axis:
    def __init__(self) -> None:
        self._now = 0.0
        self._acceleration = 0.0

    def step(self, wanted: float, dt_s: float, max_acceleration: float, max_jerk: float) -> float:
        if not (max_acceleration or max_jerk):
            self._now = wanted
            return wanted
        same_way = abs(self._now) if self._now * wanted > 0 else 0.0
        acceleration = max_acceleration or math.inf
        if max_jerk:
            acceleration = min(acceleration, self._acceleration + max_jerk * dt_s)
        grown = min(abs(wanted), same_way + acceleration * dt_s)
        self._acceleration = (grown - same_way) / dt_s if dt_s > 0 and grown > same_way else 0.0
        self._now = math.copysign(grown, wanted)
        return self._now


def _done(commanded: Velocity, measured: Velocity) -> list[float]:
    """Return how much of what it is told the robot does, 1 for all, a part for each way that it is told enough of."""
    parts = ((commanded.linear_mps, measured.linear_mps, 0.1), (commanded.angular_radps, measured.angular_radps, 0.2))
    return [does / wanted for wanted, does, least in parts if abs(wanted) >= least]


def _same_way(one: Velocity, other: Velocity) -> bool:
    return one.linear_mps * other.linear_mps >= 0 and one.angular_radps * other.angular_radps >= 0
