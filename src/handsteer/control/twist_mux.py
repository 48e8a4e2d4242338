"""Selects the active input: steering overrides the hand while it is in use."""

import math
from typing import Literal

from handsteer.config import ControlConfig
from handsteer.control.explain import Reason
from handsteer.control.sign_control import CruiseControl, SignControl
from handsteer.types import NONE, ZERO, Stick, Velocity, action_of

Source = Literal["none", "signs", "joystick", "steering"]


class TwistMux:
    """Merges the hand, as signs or as a joystick, and steering into one stream of velocities.

    A steering command takes over at once and blocks the hand until ``steering_timeout`` has passed without another one.
    Then one zero is commanded, and signs continue from zero. These are the priorities and timeouts of ROS's
    ``twist_mux``, in one place, so that the robot has one source of commands.

    Attributes:
        source: The active input.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._signs = _signs_by_rule(config)
        self._since_input_s = 0.0
        self._is_held = False
        self._last_sign: str | None = None
        self._velocity = ZERO
        self.source: Source = "none"

    @property
    def velocity(self) -> Velocity:
        """The last commanded velocity."""
        return self._velocity

    def step(
        self, dt_s: float, *, sign: str | None = None, steering: Velocity | None = None, stick: Stick | None = None
    ) -> Velocity | None:
        """Advance time by ``dt_s``, then process the inputs.

        Args:
            dt_s: Seconds since the last step, >= 0; any other value is a fault and stops the robot.
            sign: The sign of one message, if one was received.
            steering: A steering command, if one was received; clamped to the limits, and zero if not finite.
            stick: The hand as a joystick, if that was received; full deflection is the highest speed.

        Returns:
            The velocity to command now, or None to command nothing.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            return self.halt()
        if steering is not None:
            return self._steer(steering)
        if self.source == "steering":
            return self._wait(dt_s, self._config.steering_timeout)
        if stick is not None:
            return self._follow(stick)
        if self.source == "joystick":
            return self._wait(dt_s, self._config.sign_timeout)
        velocity = self._signs.step(sign, dt_s)
        if sign is not None:
            self._last_sign = sign
        self.source = "none" if self._signs.silent else "signs"
        return self._take(velocity)

    def reconfigure(self, config: ControlConfig) -> Velocity | None:
        """Change limits, steps, times and actions; no change makes the robot faster.

        Returns:
            The velocity to command now if the last one exceeds the new limits; else None.
        """
        if config.rule == self._config.rule:
            self._signs.reconfigure(config)
        else:
            self._signs = _signs_by_rule(config)
        self._config = config
        within = self._velocity.clamped(config.max_linear, config.max_angular)
        return self._take(within if self.source != "none" and within != self._velocity else None)

    def hold_back(self, velocity: Velocity) -> None:
        """Continue from ``velocity``, a slower one that was commanded instead of the last."""
        self._velocity = velocity
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
            return Reason("steered_at_zero" if self._velocity.is_zero else "steered")
        if self._config.mode == "joystick":
            is_held = self.source == "joystick" and self._is_held
            return Reason("not_held" if not is_held else "held" if self._velocity.is_zero else "joystick")
        return self._reason_of_signs

    @property
    def _reason_of_signs(self) -> Reason:
        if self.source == "none":
            return Reason("no_input", f"{self._config.sign_timeout:g}")
        sign = self._last_sign or NONE
        if not self._velocity.is_zero:
            return Reason("sign", sign)
        if sign == NONE:
            return Reason("no_sign")
        return Reason("stop_sign", sign) if action_of(sign, self._config.actions) == "stop" else Reason("not_started")

    def _steer(self, wanted: Velocity) -> Velocity | None:
        config = self._config
        self._signs.halt()
        self.source = "steering"
        self._since_input_s = 0.0
        return self._take(wanted.clamped(config.max_linear, config.max_angular) if wanted.is_finite else ZERO)

    def _follow(self, stick: Stick) -> Velocity | None:
        self._signs.halt()
        self.source = "joystick"
        self._since_input_s = 0.0
        self._is_held = stick.held
        wanted = Velocity(stick.forward * self._config.max_linear, stick.left * self._config.max_angular)
        is_valid = stick.held and wanted.is_finite
        return self._take(wanted.clamped(self._config.max_linear, self._config.max_angular) if is_valid else ZERO)

    def _wait(self, dt_s: float, timeout_s: float) -> Velocity | None:
        self._since_input_s += dt_s
        return self.halt() if self._since_input_s >= timeout_s else None

    def _take(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is not None:
            self._velocity = velocity
        return velocity


def _signs_by_rule(config: ControlConfig) -> SignControl:
    return CruiseControl(config) if config.rule == "cruise" else SignControl(config)
