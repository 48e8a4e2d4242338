"""Converts signs to velocities by the tutorial's rule, with limits and a watchdog."""

import math

from handsteer.config import ControlConfig
from handsteer.control.actions import AddedActions
from handsteer.control.safety import Allowance
from handsteer.types import ACTIONS, ZERO, Action, Velocity, action_of

_DIGITS = 9
_TURBO = 2.0


class SignControl:
    """Keeps the commanded velocity and changes it by one step per sign.

    ``Forward`` and ``Backward`` change the linear velocity and end turning; ``Turn Left`` and ``Turn Right`` change the
    angular velocity and keep the linear one; ``Stop`` and ``NONE`` set both to zero; ``Go`` and unknown signs change
    nothing (the rule of the ROS 101 course, chapter 12). ``config.actions`` defines further signs. The stored velocity
    itself is clamped, so that it does not wind up beyond the limits.

    A ``turbo`` sign doubles the linear velocity, within the limit, while it is shown, and keeps the angular one. The
    next sign continues from the original velocity. A stopped robot remains stopped. After an action of a plug-in has
    failed, nothing moves before a sign that stops.

    Raises:
        PluginError: An action of ``config.actions`` is of a plug-in, and cannot be made.

    Attributes:
        velocity: Sum of the signs so far; it is what is commanded, except for ``turbo``.
        silent: True after a timeout: nothing is commanded until the next sign.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config
        self._since_sign_s = 0.0
        self._allowance = Allowance(config.max_sign_rate)
        self._added = AddedActions()
        self._added.make(config.actions.values())
        self._has_failed = False
        self.velocity = ZERO
        self.silent = True

    def step(self, sign: str | None, dt_s: float) -> Velocity | None:
        """Advance time by ``dt_s``, then process ``sign``.

        Args:
            sign: The sign of one message, or None if only time has passed.
            dt_s: Seconds since the last step, >= 0; any other value is a fault.

        Returns:
            The velocity to command now; None to command nothing. Exactly one velocity per sign; after ``sign_timeout``
            without a sign, or at a fault, one zero and then None.
        """
        if not (math.isfinite(dt_s) and dt_s >= 0):
            return self.halt()
        self._since_sign_s += dt_s
        self._allowance.step(dt_s)
        if sign is None:
            timed_out = not self.silent and self._since_sign_s >= self._config.sign_timeout
            return self.halt() if timed_out else None
        # After silence, it is unknown how long the sign was shown before: its time counts from now.
        interval_s = 0.0 if self.silent else min(self._since_sign_s, self._config.sign_timeout)
        self._since_sign_s = 0.0
        self.silent = False
        action = action_of(sign, self._config.actions)
        self._has_failed = self._has_failed and action != "stop"
        self.velocity = ZERO if self._has_failed else self._after(action, interval_s)
        commanded = self._boosted() if action == "turbo" else self.velocity
        return commanded if commanded.is_finite else self.halt()

    def reconfigure(self, config: ControlConfig) -> None:
        """Change the configuration; :attr:`velocity` is clamped to the new limits."""
        self._added.make(config.actions.values())
        self._config = config
        self._allowance.rate = config.max_sign_rate
        self.velocity = self.velocity.clamped(config.max_linear, config.max_angular)

    def hold_back(self, velocity: Velocity) -> None:
        """Clamp :attr:`velocity` to the magnitudes in ``velocity``, so that steps do not wind up at an active limit."""
        self.velocity = self.velocity.clamped(abs(velocity.linear_mps), abs(velocity.angular_radps))

    def halt(self) -> Velocity | None:
        """Set the velocity to zero; return one zero, or None if already silent."""
        was_silent = self.silent
        self.velocity = ZERO
        self.silent = True
        self._since_sign_s = 0.0
        return None if was_silent else ZERO

    def _after(self, action: str, interval_s: float) -> Velocity:
        if action in ACTIONS:
            return self._next(action, interval_s)
        wanted = self._added.velocity(action, self.velocity, interval_s)
        self._has_failed = wanted is None
        return ZERO if wanted is None else self._allowed(wanted)

    def _next(self, action: Action, interval_s: float) -> Velocity:
        now = self.velocity
        linear, angular = self._growth(interval_s)
        match action:
            case "stop":
                return ZERO
            case "forward" | "backward":
                after = now.linear_mps + (linear if action == "forward" else -linear), 0.0
            case "turn_left" | "turn_right":
                after = now.linear_mps, now.angular_radps + (angular if action == "turn_left" else -angular)
            case _:
                after = now.linear_mps, now.angular_radps
        # Sums of steps are to be the expected decimals: 0.22, not 0.22000000000000006.
        summed = Velocity(round(after[0], _DIGITS), round(after[1], _DIGITS))
        return self._allowed(summed)

    def _allowed(self, wanted: Velocity) -> Velocity:
        """Return ``wanted`` within the limits; no faster than now if there are too many signs."""
        now, limited = self.velocity, wanted.clamped(self._config.max_linear, self._config.max_angular)
        if not _is_faster(limited, now) or self._config.ramp == "per_second" or self._allowance.take():
            return limited
        return Velocity(now.linear_mps, limited.angular_radps if limited.angular_radps == 0.0 else now.angular_radps)

    def _boosted(self) -> Velocity:
        doubled = Velocity(_TURBO * self.velocity.linear_mps, self.velocity.angular_radps)
        return doubled.clamped(self._config.max_linear, self._config.max_angular)

    def _growth(self, interval_s: float) -> tuple[float, float]:
        config = self._config
        if config.ramp == "per_message":
            return config.linear_step, config.angular_step
        return config.linear_acceleration * interval_s, config.angular_acceleration * interval_s


def _is_faster(after: Velocity, before: Velocity) -> bool:
    grows = abs(after.linear_mps) > abs(before.linear_mps)
    return grows or abs(after.angular_radps) > abs(before.angular_radps)
