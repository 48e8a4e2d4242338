"""Sign control and safety as pure functions and ``step(input, dt)`` classes, without clock or I/O.

:class:`Control` joins them: it converts signs and steering commands to safe velocities.
"""

import math

from handsteer.config import ControlConfig
from handsteer.control.safety import Ramp, Safety
from handsteer.control.twist_mux import TwistMux
from handsteer.types import NONE, RELEASED, ZERO, Stick, Velocity, action_of


class Control:
    """Combines sign control, twist mux, arming, Stop, and the limits of acceleration and jerk.

    Args:
        config: Limits, steps and timeouts.
        arming: Whether neutral is required before the first movement (:mod:`handsteer.control.safety`).
        engage: Whether an open palm must engage the hand first.

    Attributes:
        safety: Decides whether signs and steering are followed; receives Stop, resets and faults.
        mux: Selects the active input, and explains why the robot is stopped.
    """

    def __init__(self, config: ControlConfig, *, arming: bool, engage: bool = False) -> None:
        self._config = config
        self.safety = Safety(config, arming=arming, engage=engage)
        self.mux = TwistMux(config)
        self._ramp = Ramp(config)
        self._since_command_s = 0.0

    def step(
        self, dt_s: float, *, sign: str | None = None, steering: Velocity | None = None, stick: Stick | None = None
    ) -> Velocity | None:
        """Advance time by ``dt_s``, then process the inputs.

        With ``config.mode`` ``joystick``, signs only engage; with ``signs``, the joystick has no effect.

        Args:
            dt_s: Seconds since the last step, >= 0; any other value is a fault and stops the robot.
            sign: The sign of one frame, if one was received.
            steering: A steering command, if one was received.
            stick: The hand as a joystick in one frame, if that was received.

        Returns:
            The velocity to command now, or None to command nothing new.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            self.safety.fault(f"{dt_s} s is no time between two steps")
            return self.halt()
        self.safety.step(dt_s)
        self._since_command_s += dt_s
        if sign is not None:
            sign = self._admitted(sign)
        if self._config.mode == "signs":
            stick = None
        elif stick is not None and not self.safety.admits_stick(held=stick.held):
            stick = RELEASED
        if steering is not None and not self.safety.admits_steering(is_zero=steering.is_zero):
            steering = ZERO
        velocity = self.mux.step(dt_s, sign=sign, steering=steering, stick=stick)
        if self.mux.source in ("signs", "joystick") and not self.safety.engagement.engaged:
            velocity = self.mux.halt()  # it may be disengaged between two frames
        return self._ramped(velocity)

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

        Another mode or rule stops the robot, and the hand must show neutral first.
        """
        stopped: Velocity | None = None
        if (config.mode, config.rule) != (self._config.mode, self._config.rule):
            self.safety.disarm("its rule has changed")
            stopped = self.halt()
        self._config = config
        self.safety.reconfigure(config)
        self._ramp.reconfigure(config)
        velocity = self._ramped(self.mux.reconfigure(config))
        return stopped if velocity is None else velocity

    def _admitted(self, sign: str) -> str | None:
        """Return the sign to follow: ``NONE`` if none may be, None if signs do not drive."""
        self.safety.engagement.note_sign(sign)
        if self._config.mode == "joystick":
            return None
        stops = action_of(sign, self._config.actions) == "stop"
        return sign if self.safety.admits_sign(sign, stops=stops) else NONE

    def _ramped(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is None:
            return None
        since_s, self._since_command_s = self._since_command_s, 0.0
        return self._ramp.step(velocity, min(since_s, self._config.sign_timeout))
