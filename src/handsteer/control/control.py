"""Signs and steering in, safe velocities out: the part of ``hand_sign_control`` that knows nothing of nodes."""

from handsteer.config import ControlConfig
from handsteer.control.safety import Ramp, Safety
from handsteer.control.twist_mux import TwistMux
from handsteer.types import NONE, ZERO, Velocity, action_of


class Control:
    """Joins the rule of the signs, the priority of steering, arming, Stop, and the limits of acceleration and jerk.

    Args:
        config: Limits, steps and timeouts.
        arming: Whether nothing moves before neutral was seen (:mod:`handsteer.control.safety`).

    Attributes:
        safety: Says whether signs and steering are followed, and takes Stop, resets and faults.
        mux: Says who drives, and why the robot stands when it does.
    """

    def __init__(self, config: ControlConfig, *, arming: bool) -> None:
        self._config = config
        self.safety = Safety(config, arming=arming)
        self.mux = TwistMux(config)
        self._ramp = Ramp(config)
        self._since_command_s = 0.0

    def step(self, dt_s: float, *, sign: str | None = None, steering: Velocity | None = None) -> Velocity | None:
        """Let ``dt_s`` seconds pass, then take what has come.

        Args:
            dt_s: Seconds since the last step, >= 0; anything else counts as a fault and stops the robot.
            sign: The sign of one frame, if one came.
            steering: A velocity asked for by hand, if one came.

        Returns:
            The velocity to command now, or None to command nothing new.
        """
        self.safety.step(dt_s)
        self._since_command_s += dt_s
        if sign is not None:
            stops = action_of(sign, self._config.actions) == "stop"
            sign = sign if self.safety.admits_sign(sign, stops=stops) else NONE
        if steering is not None and not self.safety.admits_steering(is_zero=steering.is_zero):
            steering = ZERO
        return self._ramped(self.mux.step(dt_s, sign=sign, steering=steering))

    def halt(self) -> Velocity | None:
        """Stop whoever drives; return one zero, or None when nobody does."""
        return self._ramped(self.mux.halt())

    def stop(self) -> Velocity | None:
        """Stop until :meth:`reset`; return one zero, or None when nobody drives."""
        self.safety.stop()
        return self.halt()

    def reset(self) -> None:
        """End a Stop; who drives has to show neutral first."""
        self.safety.reset()

    def reconfigure(self, config: ControlConfig) -> Velocity | None:
        """Go on with other limits, steps and times; return the velocity to command now, if the last is beyond them."""
        self._config = config
        self.safety.reconfigure(config)
        self._ramp.reconfigure(config)
        return self._ramped(self.mux.reconfigure(config))

    def _ramped(self, velocity: Velocity | None) -> Velocity | None:
        if velocity is None:
            return None
        since_s, self._since_command_s = self._since_command_s, 0.0
        return self._ramp.step(velocity, min(since_s, self._config.sign_timeout))
