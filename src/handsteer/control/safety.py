"""Decides when the robot may move, and how fast it may accelerate: pure rules without a clock.

A robot moves only while there is a current reason. :class:`Safety` decides whether inputs are followed,
:class:`Allowance` limits the rate of signs, and :class:`Ramp` acceleration and jerk. The times are in
:mod:`handsteer.timeouts`.
"""

import math

from handsteer.config import ControlConfig
from handsteer.control.engagement import Engagement, Renewal, Steered, SteeredBy
from handsteer.timeouts import (
    ARMING_S,
    FAULT_GAP_S,
    MOST_OF_ONE_NONE_S,
    NEUTRAL_S,
)
from handsteer.types import NONE, Velocity

_SLACK_S = 1e-9


class Release:
    """Whether a pad or stick was seen released: since the start, since each fault, and since it fell silent deflected.

    Only a zero is a release: a pause may be a cut link, and what comes first may have been held since long before.

    Attributes:
        waits: Whether it has to be released first.
    """

    def __init__(self) -> None:
        self.waits = True
        self._age_s = 0.0
        self._was_zero = True

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        self._age_s += dt_s

    def admits(self, *, is_zero: bool, is_valid: bool, timeout_s: float) -> bool:
        """Record a command; return whether it may be followed.

        Args:
            is_zero: Whether it is a zero.
            is_valid: Whether it is a velocity at all; if not, it is a fault.
            timeout_s: After a longer pause that began at another command, it has to be released.
        """
        is_lost = self._age_s >= timeout_s and not self._was_zero
        self.waits = not is_zero and (self.waits or is_lost or not is_valid)
        self._age_s, self._was_zero = 0.0, is_zero
        return not self.waits


class Safety:
    """Keeps the robot stopped until neutral was seen.

    Neutral for signs is a sign that stops, or no hand for :data:`~handsteer.timeouts.NEUTRAL_S`; a ``NONE`` caused by a
    fault does not count. Both signs and steering must show neutral after a Stop was reset and after another robot was
    selected; signs with ``arming`` also after the start and after each fault. So a hand that is already up does not
    start the robot.

    Steering, a gamepad and the hand as a joystick must always be seen released (:class:`Release`) before they are
    followed: at the start, and after each fault. The hand also after steering.

    Args:
        config: Timeouts of signs and steering.
        arming: Whether signs must show neutral after the start and after faults.
        engage: Whether the hand must also be engaged.
        renew: Whether what drives without any change must be shown again.

    Attributes:
        is_stopped: Whether a Stop is active, until :meth:`reset`.
        signs_wait: Why signs have to show neutral first, as ``no sign came``; empty after a reset, None if they need
            not.
        engagement: The clutch.
        renewal: Whether what drives has changed lately.
    """

    def __init__(self, config: ControlConfig, *, arming: bool, engage: bool = False, renew: bool = False) -> None:
        self._config = config
        self._arming = arming
        self.engagement = Engagement(enabled=engage, by=config.engage_by)
        self.renewal = Renewal(enabled=renew, limit_s=config.renew_time)
        self._renews: set[Steered] = set()
        self._stick_waits = True
        self._age_s = 0.0
        self._sign_age_s = math.inf
        self._releases: dict[SteeredBy, Release] = {"steering": Release(), "gamepad": Release()}
        self._steered_by: SteeredBy = "steering"
        self._neutral_s = 0.0
        self._was_fault = False
        self.signs_wait: str | None = "has just started" if arming else None
        self.is_stopped = False

    @property
    def steering_waits(self) -> bool:
        """Whether what steered last has to be released first."""
        return self._releases[self._steered_by].waits

    @property
    def steered_by(self) -> SteeredBy:
        """What steered last."""
        return self._steered_by

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds, >= 0; a timeout of signs is a fault."""
        self._age_s += dt_s
        self._sign_age_s += dt_s
        for release in self._releases.values():
            release.step(dt_s)
        self.engagement.step(dt_s)
        self.renewal.step(dt_s)
        if self._config.sign_timeout <= self._sign_age_s < math.inf:
            self.fault("no sign came")

    def stop(self) -> None:
        """Stop the robot until :meth:`reset`."""
        self.is_stopped = True
        self.engagement.disengage()

    def reset(self) -> None:
        """End a Stop; each input must show neutral before it is followed again. Without a Stop it changes nothing."""
        if self.is_stopped:
            self.is_stopped = False
            self.disarm()

    def disarm(self, why: str = "") -> None:
        """Require neutral of signs and steering before either is followed again."""
        self.signs_wait = why
        self._neutral_s = 0.0
        self._require_release()
        self._disengage()

    def stall(self, why: str) -> None:
        """Record that time was lost, for all inputs; what was held during it has to be released."""
        self.fault(why)
        self._require_release()

    def fault(self, why: str) -> None:
        """Record a fault of the hand's input; with ``arming``, signs have to show neutral again."""
        self._neutral_s = 0.0
        self._was_fault = True
        self._disengage()
        if self._arming and not self.signs_wait:
            self.signs_wait = why

    def robot_is_away(self, why: str) -> None:
        """Record that no robot follows the commands; steering, with ``arming`` also signs, must show neutral again."""
        if self._arming:
            self.disarm(why)
        else:
            self._require_release()
            self._disengage()

    def require_renewal(self, by: Steered) -> None:
        """Record that ``by`` has driven for too long without any change: it must show neutral before it is followed."""
        self._renews.add(by)
        if by == "signs":
            self.signs_wait = f"the same sign for {self.renewal.limit_s:g} s"
        elif by == "joystick":
            self._stick_waits = True
        else:
            self._releases[by].waits = True

    def must_renew(self, by: Steered) -> bool:
        """Return whether ``by`` waits for neutral since :meth:`require_renewal`."""
        return by in self._renews

    def admits_sign(self, sign: str, *, stops: bool) -> bool:
        """Record a sign, and whether it ``stops``; return whether the robot may follow it."""
        self._note(sign, stops=stops)
        return self.signs_wait is None and self.engagement.engaged and not self.is_stopped

    def admits_stick(self, *, held: bool) -> bool:
        """Record the state of the hand as a joystick; return whether the robot may follow it."""
        self._note("" if held else NONE, stops=not held)
        if not held:
            self._stick_waits = False
            self._renews.discard("joystick")
        waits = self._stick_waits or self.signs_wait is not None
        return self.engagement.engaged and not (waits or self.is_stopped)

    def admits_steering(self, *, is_zero: bool, is_valid: bool = True, by: SteeredBy = "steering") -> bool:
        """Record a steering command, and whether it ``is_valid``; return whether the robot may follow it."""
        self._stick_waits = True
        self._steered_by = by
        timeout_s = self._config.steering_timeout
        return self._releases_by(by, is_zero=is_zero, is_valid=is_valid, timeout_s=timeout_s) and not self.is_stopped

    def note_rest(self, by: SteeredBy) -> None:
        """Record that what could steer is at rest, which leaves the robot to others."""
        self._releases_by(by, is_zero=True, is_valid=True, timeout_s=math.inf)

    def reconfigure(self, config: ControlConfig) -> None:
        """Change the timeouts."""
        self._config = config
        self.renewal.limit_s = config.renew_time
        self.engagement.by = config.engage_by

    def _releases_by(self, by: SteeredBy, *, is_zero: bool, is_valid: bool, timeout_s: float) -> bool:
        if is_zero:
            self._renews.discard(by)
            self.renewal.note(by, (0.0, 0.0))
        return self._releases[by].admits(is_zero=is_zero, is_valid=is_valid, timeout_s=timeout_s)

    def _note(self, sign: str, *, stops: bool) -> None:
        gap_s, self._sign_age_s = self._sign_age_s, 0.0
        if sign == NONE:
            self._note_none(gap_s)
        elif stops:
            self._neutral_s = math.inf
        else:
            self._neutral_s = 0.0
        if self._neutral_s >= NEUTRAL_S - _SLACK_S and not (self._arming and self._age_s < ARMING_S):
            self.signs_wait = None
            self._renews.discard("signs")

    def _note_none(self, gap_s: float) -> None:
        if gap_s >= FAULT_GAP_S:
            self.fault("recognition had no frame")
        elif not self._was_fault:
            self._neutral_s += min(gap_s, MOST_OF_ONE_NONE_S)
        else:
            self._was_fault = False  # what happened since the fault was not observed

    def _require_release(self) -> None:
        for release in self._releases.values():
            release.waits = True

    def _disengage(self) -> None:
        self._stick_waits = True
        self.engagement.disengage()


class Allowance:
    """Limits how many signs may accelerate the robot, so that extra messages beyond a camera's rate have no effect.

    Signs may come in bursts; allowance beyond :data:`BURST_S` expires.
    """

    BURST_S = 0.25

    def __init__(self, rate: float) -> None:
        self.rate = rate
        self._left = math.inf

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        self._left = min(self._left + self.rate * dt_s, max(1.0, self.rate * self.BURST_S))

    def take(self) -> bool:
        """Use one sign of the allowance; return whether there was one."""
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Ramp:
    """Limits acceleration and jerk of commands; deceleration, also for a change of direction, is not limited.

    Args:
        config: Limits of acceleration and jerk; 0 is unlimited.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._linear = _Axis()
        self._angular = _Axis()

    def reconfigure(self, config: ControlConfig) -> None:
        """Change the limits."""
        self._config = config

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, a slower one that was commanded instead of the last."""
        self._linear.hold_back(velocity.linear_mps)
        self._angular.hold_back(velocity.angular_radps)

    def step(self, wanted: Velocity, dt_s: float) -> Velocity:
        """Return the velocity to command ``dt_s`` seconds after the last step."""
        config = self._config
        return Velocity(
            self._linear.step(wanted.linear_mps, dt_s, config.max_linear_acceleration, config.max_linear_jerk),
            self._angular.step(wanted.angular_radps, dt_s, config.max_angular_acceleration, config.max_angular_jerk),
        )


class _Axis:
    def __init__(self) -> None:
        self._now = 0.0
        self._acceleration = 0.0

    def hold_back(self, now: float) -> None:
        if abs(now) < abs(self._now):
            self._now, self._acceleration = now, 0.0

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
