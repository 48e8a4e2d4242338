"""Converts where a finger points to a velocity: an arc whose speed grows while it points."""

import math

from handsteer.config import ControlConfig
from handsteer.types import ZERO, Stick, Velocity

IN_A_CURVE = 0.6
"""Share of the speed that a full tilt takes: the tighter the curve, the slower."""


def pointed(stick: Stick, now: Velocity, config: ControlConfig, dt_s: float) -> Velocity:
    """Return the velocity to command, ``dt_s`` seconds after ``now`` was.

    Deflected forward or back, the robot drives an arc: its turn rate is the deflection to a side, and both it and the
    speed grow from zero to the limits in ``config.point_time``. In the middle it keeps its speed, straight on.
    Deflected to a side only, it turns in place. Released, or not finite, it stops at once.

    Args:
        stick: Where the hand points, by :class:`~handsteer.recognition.pointing.Pointing`.
        now: The last velocity.
        config: Limits and times.
        dt_s: Seconds, >= 0.
    """
    if not (stick.held and stick.is_valid):
        return ZERO
    linear, angular = now.linear_mps, 0.0
    if stick.forward:
        full = config.max_linear * (1.0 - IN_A_CURVE * abs(stick.left))
        linear = _grown(linear, stick.forward * full, config.max_linear * dt_s / config.point_time)
        angular = abs(linear) / full * stick.left * config.point_turn
    elif stick.left:
        linear = 0.0
        angular = _grown(
            now.angular_radps, stick.left * config.point_turn, config.point_turn * dt_s / config.point_time
        )
    return Velocity(linear, angular).clamped(config.max_linear, config.max_angular)


def _grown(now: float, wanted: float, step: float) -> float:
    """Return ``now`` moved towards ``wanted`` by ``step``, or from zero if it has the other direction."""
    now = now if now * wanted > 0.0 else 0.0
    return wanted if abs(wanted) <= abs(now) + step else now + math.copysign(step, wanted)
