"""Sign control and safety as pure functions and ``step(input, dt)`` classes, without clock or I/O.

:class:`Control` joins them: it converts signs and steering commands to safe velocities.

Its twist mux selects the active input. ``safety`` decides when the robot may start, and how fast it may accelerate,
``following`` by its odometry whether it does what is commanded; :mod:`handsteer.timeouts` has all times of it, and the
defaults of configurable ones. ``actions`` are those of plug-ins. ``explain`` has the sentences on why the robot drives
or stands, which the page, ``/diagnostics`` and ``Teleop`` share. ``obstacles`` slows commands for obstacles in the
laser scan (docs/safety.md).
"""

import math
from typing import Literal

from handsteer.config import ControlConfig
from handsteer.control.engagement import Steered, SteeredBy
from handsteer.control.explain import Reason
from handsteer.control.pointing import pointed
from handsteer.control.safety import Ramp, Safety
from handsteer.control.sign_control import SignControl
from handsteer.types import NONE, RELEASED, ZERO, Stick, Velocity, action_of

_SLACK_S = 1e-6

Source = Literal["none", "signs", "joystick", "steering"]


class Control:
    """Combines sign control, twist mux, arming, Stop, and the limits of acceleration and jerk.

    Args:
        config: Limits, steps and timeouts.
        arming: Whether signs must show neutral before the first movement (:mod:`handsteer.control.safety`).
        engage: Whether the hand must engage first.
        renew: Whether what drives without any change for ``config.renew_time`` must be shown again.

    Attributes:
        safety: Decides whether signs and steering are followed; receives Stop, resets and faults.
        mux: Selects the active input, and explains why the robot is stopped.
    """

    def __init__(self, config: ControlConfig, *, arming: bool, engage: bool = False, renew: bool = False) -> None:
        self._config = config
        self.safety = Safety(config, arming=arming, engage=engage, renew=renew)
        self.mux = TwistMux(config)
        self._ramp = Ramp(config)
        self._since_command_s = 0.0
        self._since_sign_s = math.inf
        self._stop_is_shown = True

    def step(
        self,
        dt_s: float,
        *,
        sign: str | None = None,
        steering: Velocity | None = None,
        by: SteeredBy = "steering",
        stick: Stick | None = None,
    ) -> Velocity | None:
        """Advance time by ``dt_s``, then process the inputs.

        With ``config.mode`` ``joystick``, signs only engage; with ``signs``, the joystick has no effect.

        Args:
            dt_s: Seconds since the last step, >= 0; any other value is a fault and stops the robot.
            sign: The sign of one frame, if one was received.
            steering: A steering command, if one was received.
            by: What steers; each has to be released on its own.
            stick: The hand as a joystick in one frame, if that was received.

        Returns:
            The velocity to command now, or None to command nothing new.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            self.safety.stall(f"{dt_s} s is not a valid time between two steps")
            return self.halt()
        self.safety.step(dt_s)
        self._since_command_s += dt_s
        self._since_sign_s += dt_s
        if self._config.points:
            stick = self._agreeing(sign, stick)
        self._note(sign, steering, by, stick)
        if sign is not None:
            sign = self._admitted(sign)
        if not self._config.by_stick:
            stick = None
        elif stick is not None and not stick.is_valid:
            self.safety.fault("a state of the joystick was not valid")
            stick = RELEASED
        elif stick is not None and not self.safety.admits_stick(held=stick.held):
            stick = RELEASED
        if steering is not None and not self.safety.admits_steering(
            is_zero=steering.is_zero, is_valid=steering.is_finite, by=by
        ):
            steering = ZERO
        velocity = self.mux.step(dt_s, sign=sign, steering=steering, stick=stick)
        if self._has_lost_the_hand:
            velocity = self.mux.halt()
        if self.renew_left_s <= _SLACK_S:
            velocity = self._end_unchanged(self._driven_by)
        return self._ramped(velocity)

    @property
    def renew_left_s(self) -> float:
        """Seconds until what drives must be shown again, unless it changes; infinite if nothing moves."""
        return self.safety.renewal.left_s(self._driven_by) if self._is_driven else math.inf

    @property
    def _is_driven(self) -> bool:
        return self.mux.source != "none" and not self.mux.velocity.is_zero

    @property
    def reason(self) -> Reason:
        """Why this velocity is commanded, or what has to be shown again first."""
        if not self.must_renew:
            return self.mux.reason
        is_sign = self.mux.source != "steering" and self._config.mode == "signs"
        return Reason("renew" if is_sign else "renew_stick", f"{self._config.renew_time:g}")

    @property
    def must_renew(self) -> bool:
        """Whether what would drive has to be shown again first."""
        by_hand: Steered = "joystick" if self._config.by_stick else "signs"
        return self.safety.must_renew(self._driven_by if self.mux.source == "steering" else by_hand)

    @property
    def _driven_by(self) -> Steered:
        source = self.mux.source
        return source if source in ("signs", "joystick") else self.safety.steered_by

    def _end_unchanged(self, by: Steered) -> Velocity | None:
        """Command zero as if ``by`` had shown neutral, and require that it does."""
        self.safety.require_renewal(by)
        if by == "signs":
            return self.mux.step(0.0, sign=NONE)
        return self.mux.step(0.0, stick=RELEASED) if by == "joystick" else self.mux.step(0.0, steering=ZERO)

    def _note(self, sign: str | None, steering: Velocity | None, by: SteeredBy, stick: Stick | None) -> None:
        """Record what is shown, whether it is followed or not."""
        renewal, config = self.safety.renewal, self._config
        if sign is not None:
            renewal.note("signs", sign)
        if stick is not None:
            # A fist that is held in the middle keeps the speed of pointing: that is not a release.
            renewal.note("joystick", (float(stick.held), stick.forward, stick.left))
        if steering is not None:
            renewal.note(by, (steering.linear_mps / config.max_linear, steering.angular_radps / config.max_angular))

    def note_gesture(self, *, is_done: bool) -> None:
        """Record of a frame whether the hand has just made the gesture that engages."""
        if not self.safety.is_stopped:
            self.safety.engagement.note_gesture(is_done=is_done)

    def halt(self) -> Velocity | None:
        """Stop the active input; return one zero, or None if there is none."""
        return self._ramped(self.mux.halt())

    def stop(self) -> Velocity | None:
        """Stop until :meth:`reset`; return one zero, or None if no input is active."""
        self.safety.stop()
        return self.halt()

    def reset(self) -> None:
        """End a Stop; each input must show neutral before it is followed again."""
        self.safety.reset()

    def reconfigure(self, config: ControlConfig) -> Velocity | None:
        """Change limits, steps and times; return the velocity to command now if the last one exceeds the new limits.

        Another mode or rule, or another action of the sign that is shown, stops the robot, and the hand must show
        neutral first; so does what would make faster what drives, such as a higher limit.
        """
        stopped: Velocity | None = None
        if self._way_to_drive(config) != self._way_to_drive(self._config):
            self.safety.disarm("its rule has changed")
            stopped = self.halt()
        elif self._is_driven and is_faster(self.mux.source, config, self._config):
            self.safety.disarm("its limits have changed")
            stopped = self.halt()
        self._config = config
        self.safety.reconfigure(config)
        self._ramp.reconfigure(config)
        velocity = self._ramped(self.mux.reconfigure(config))
        return stopped if velocity is None else velocity

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, a slower one that was commanded instead of the last; from zero if not finite."""
        velocity = velocity if velocity.is_finite else ZERO
        self.mux.hold_back(velocity)
        self._ramp.hold_back(velocity)

    def _way_to_drive(self, config: ControlConfig) -> tuple[str, ...]:
        return config.mode, config.rule, action_of(self.mux.shown, config.actions)

    @property
    def _has_lost_the_hand(self) -> bool:
        """Whether the hand still drives that was disengaged between two frames, or points where no signs come."""
        is_by_hand, engaged = self.mux.source in ("signs", "joystick"), self.safety.engagement.engaged
        return is_by_hand and (not engaged or (self.mux.source == "joystick" and self._lacks_signs))

    @property
    def _lacks_signs(self) -> bool:
        """Whether the hand points without signs, which say when it stops."""
        return self._config.points and self._since_sign_s >= self._config.sign_timeout

    def _agreeing(self, sign: str | None, stick: Stick | None) -> Stick | None:
        """Return the stick that counts: released, at once, by a sign that stops, whatever it says until another one.

        Where no signs come, none does: that is a fault, not a release.
        """
        if sign is not None:
            self._since_sign_s = 0.0
            self._stop_is_shown = action_of(sign, self._config.actions) == "stop"
            self.mux.shown = sign or NONE
        elif self._lacks_signs:
            if self._since_sign_s < math.inf:
                self.safety.fault("no sign came")
            return None
        is_asked = sign is not None or stick is not None
        return RELEASED if is_asked and self._stop_is_shown else stick

    def _admitted(self, sign: str) -> str | None:
        """Return the sign to follow: ``NONE`` if none may be, None if signs do not drive."""
        self.safety.engagement.note_sign(sign)
        if self._config.by_stick:
            return None
        stops = action_of(sign, self._config.actions) == "stop"
        return sign if self.safety.admits_sign(sign, stops=stops) else NONE

    def _ramped(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is None:
            return None
        since_s, self._since_command_s = self._since_command_s, 0.0
        ramped = self._ramp.step(velocity, min(since_s, self._config.sign_timeout))
        if ramped != velocity and (self.mux.source == "signs" or self._config.points):
            self.mux.hold_back(ramped)  # what is kept, by Go or in a turn, is the speed that was reached
        return ramped


_LIMITS = ("max_linear", "max_angular")
_RAMPS = ("max_linear_acceleration", "max_angular_acceleration", "max_linear_jerk", "max_angular_jerk")
_STEPS = {
    "per_message": ("linear_step", "angular_step", "max_sign_rate"),
    "per_second": ("linear_acceleration", "angular_acceleration"),
}


def is_faster(source: Source, config: ControlConfig, than: ControlConfig) -> bool:
    """Return whether what drives by ``source`` would be faster, or become so sooner, with ``config``."""

    def grows(name: str) -> bool:
        return bool(getattr(config, name) > getattr(than, name))

    def loosens(name: str) -> bool:  # zero is unlimited
        return bool((getattr(config, name) or math.inf) > (getattr(than, name) or math.inf))

    limits = any(map(grows, _LIMITS)) or any(map(loosens, _RAMPS))
    if source == "signs":
        return limits or config.ramp != than.ramp or any(map(grows, _STEPS[config.ramp]))
    if source == "joystick" and config.points:
        # The turn is in proportion to the share of the highest speed that has been reached.
        is_other = config.max_linear != than.max_linear or config.point_time < than.point_time
        return limits or is_other or grows("point_turn")
    return limits


class TwistMux:
    """Merges the hand, as signs or as a joystick, and steering into one stream of velocities.

    A steering command takes over at once and blocks the hand until ``steering_timeout`` has passed without another one.
    Then one zero is commanded, and signs continue from zero. These are the priorities and timeouts of ROS's
    ``twist_mux``, in one place, so that the robot has one source of commands.

    Attributes:
        source: The active input.
        velocity: The last commanded velocity.
        shown: The last sign, whether it is followed or not; ``NONE`` before the first one.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._signs = SignControl(config)
        self._since_input_s = 0.0
        self._is_held = False
        self.shown = NONE
        self.velocity = ZERO
        self.source: Source = "none"

    def step(
        self, dt_s: float, *, sign: str | None = None, steering: Velocity | None = None, stick: Stick | None = None
    ) -> Velocity | None:
        """Process what :meth:`Control.step` admits.

        Steering is clamped to the limits, and zero if not finite. Full deflection of the joystick is the highest speed.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            return self.halt()
        if steering is not None:
            return self._follow("steering", steering)
        if self.source == "steering":
            return self._wait(dt_s, self._config.steering_timeout)
        if stick is not None:
            return self._follow_stick(stick, dt_s)
        if self.source == "joystick":
            return self._wait(dt_s, self._config.sign_timeout)
        velocity = self._signs.step(sign, dt_s)
        if sign is not None:
            self.shown = sign or NONE
        self.source = "none" if self._signs.silent else "signs"
        return self._take(velocity)

    def reconfigure(self, config: ControlConfig) -> Velocity | None:
        """Change limits, steps, times and actions; no change makes the robot faster.

        Returns:
            The velocity to command now if the last one exceeds the new limits; else None.
        """
        self._signs.reconfigure(config)
        self._config = config
        within = self.velocity.clamped(config.max_linear, config.max_angular)
        return self._take(within if self.source != "none" and within != self.velocity else None)

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, a slower one that was commanded instead of the last."""
        self.velocity = velocity
        self._signs.hold_back(velocity)

    def halt(self) -> Velocity | None:
        """Stop the active input; return one zero, or None if there is none."""
        was_driving = self.source != "none"
        self._signs.halt()
        self.source = "none"
        return self._take(ZERO if was_driving else None)

    @property
    def reason(self) -> Reason:
        """Why this velocity is commanded."""
        if self.source == "steering":
            return Reason("steered_at_zero" if self.velocity.is_zero else "steered")
        if self._config.mode == "joystick":
            is_held = self.source == "joystick" and self._is_held
            return Reason("not_held" if not is_held else "held" if self.velocity.is_zero else "joystick")
        return self._reason_of_pointing if self._config.points else self._reason_of_signs

    @property
    def _reason_of_pointing(self) -> Reason:
        if self.source == "joystick" and not self.velocity.is_zero:
            return Reason("pointed")
        return self._reason_of_signs if self.source == "none" else self._reason_without_motion

    @property
    def _reason_of_signs(self) -> Reason:
        if self.source == "none":
            return Reason("no_input", f"{self._config.sign_timeout:g}")
        if not self.velocity.is_zero:
            return Reason("sign", self.shown)
        return self._reason_without_motion

    @property
    def _reason_without_motion(self) -> Reason:
        sign = self.shown
        if sign == NONE:
            return Reason("no_sign")
        action = action_of(sign, self._config.actions)
        if action == "stop":
            return Reason("stop_sign", sign)
        return Reason("not_started", sign if action == "go" else "")

    def _follow_stick(self, stick: Stick, dt_s: float) -> Velocity | None:
        config, self._is_held = self._config, stick.held
        if config.points:
            # The time before the first state does not count.
            since_s = self._since_input_s + dt_s if self.source == "joystick" else 0.0
            return self._follow("joystick", pointed(stick, self.velocity, config, since_s))
        wanted = Velocity(stick.forward * config.max_linear, stick.left * config.max_angular)
        return self._follow("joystick", wanted if stick.held else ZERO)

    def _follow(self, source: Source, wanted: Velocity) -> Velocity | None:
        config = self._config
        self._signs.halt()
        self.source = source
        self._since_input_s = 0.0
        return self._take(wanted.clamped(config.max_linear, config.max_angular) if wanted.is_finite else ZERO)

    def _wait(self, dt_s: float, timeout_s: float) -> Velocity | None:
        self._since_input_s += dt_s
        return self.halt() if self._since_input_s >= timeout_s else None

    def _take(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is not None:
            self.velocity = velocity
        return velocity
