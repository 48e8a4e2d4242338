"""Who drives: steering by hand goes before signs, for as long as it is used."""

import math
from typing import Literal

from handsteer.config import ControlConfig
from handsteer.control.sign_control import SignControl
from handsteer.types import NONE, ZERO, Velocity, action_of

Source = Literal["nobody", "signs", "steering"]


class TwistMux:
    """Joins signs and steering to one stream of velocities.

    A steering command takes over at once and keeps the signs out until ``steering_timeout`` has passed without
    another one. Then one zero goes out, and signs start again from standing still (the priorities and timeouts of
    ROS's ``twist_mux``, in one place, so that the robot hears one voice).

    Attributes:
        source: Who drives now.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._signs = SignControl(config)
        self._since_steering_s = 0.0
        self._last_sign: str | None = None
        self._velocity = ZERO
        self.source: Source = "nobody"

    @property
    def velocity(self) -> Velocity:
        """What was commanded last."""
        return self._velocity

    def step(self, dt_s: float, *, sign: str | None = None, steering: Velocity | None = None) -> Velocity | None:
        """Let ``dt_s`` seconds pass, then take what has come.

        Args:
            dt_s: Seconds since the last step, >= 0; anything else counts as a fault and stops the robot.
            sign: The sign of one message, if one came.
            steering: A velocity asked for by hand, if one came; it is clamped to the limits, and zero if not finite.

        Returns:
            The velocity to command now, or None to command nothing.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            return self.halt()
        if steering is not None:
            return self._steer(steering)
        if self.source == "steering":
            return self._wait_for_steering(dt_s)
        velocity = self._signs.step(sign, dt_s)
        if sign is not None:
            self._last_sign = sign
        self.source = "nobody" if self._signs.silent else "signs"
        return self._say(velocity)

    def reconfigure(self, config: ControlConfig) -> Velocity | None:
        """Go on with other limits, steps, times and actions; nothing gets faster by it.

        Returns:
            The velocity to command now, where the one commanded last is beyond the limits; else None.
        """
        self._config = config
        self._signs.reconfigure(config)
        within = self._velocity.clamped(config.max_linear, config.max_angular)
        return self._say(within if self.source != "nobody" and within != self._velocity else None)

    def hold_back(self, velocity: Velocity) -> None:
        """Go on from ``velocity``, a slower one that was commanded instead of the last."""
        self._velocity = velocity
        self._signs.hold_back(velocity)

    def halt(self) -> Velocity | None:
        """Stop whoever drives; return one zero, or None when nobody does."""
        was_driving = self.source != "nobody"
        self._signs.halt()
        self.source = "nobody"
        return self._say(ZERO if was_driving else None)

    @property
    def reason(self) -> str:
        """A sentence on what the robot is told to do, and why it stands when it does."""
        if self.source == "steering":
            return "standing: steered by hand, at zero" if self._velocity.is_zero else "driving: steered by hand"
        if self.source == "nobody":
            return f"standing: no sign has come for {self._config.sign_timeout:g} s"
        if not self._velocity.is_zero:
            return f"driving: {self._last_sign}"
        sign = self._last_sign or NONE
        if sign == NONE:
            return "standing: no sign is seen"
        stops = action_of(sign, self._config.actions) == "stop"
        return f"standing: the {sign} sign is shown" if stops else "standing: no sign has set it in motion yet"

    def _steer(self, wanted: Velocity) -> Velocity | None:
        config = self._config
        self._signs.halt()
        self.source = "steering"
        self._since_steering_s = 0.0
        return self._say(wanted.clamped(config.max_linear, config.max_angular) if wanted.is_finite else ZERO)

    def _wait_for_steering(self, dt_s: float) -> Velocity | None:
        self._since_steering_s += dt_s
        return self.halt() if self._since_steering_s >= self._config.steering_timeout else None

    def _say(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is not None:
            self._velocity = velocity
        return velocity
