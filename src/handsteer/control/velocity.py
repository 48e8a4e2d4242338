"""What a robot on a plane is told."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Velocity:
    """Forward velocity in m/s and turning velocity in rad/s, left positive (REP 103)."""

    linear_mps: float = 0.0
    angular_radps: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Whether the robot is to stand still."""
        return self.linear_mps == 0.0 and self.angular_radps == 0.0

    @property
    def is_finite(self) -> bool:
        """Whether both parts are numbers that a robot can follow."""
        return math.isfinite(self.linear_mps) and math.isfinite(self.angular_radps)

    def clamped(self, max_linear_mps: float, max_angular_radps: float) -> "Velocity":
        """Return the nearest velocity within the limits."""
        return Velocity(
            max(-max_linear_mps, min(self.linear_mps, max_linear_mps)),
            max(-max_angular_radps, min(self.angular_radps, max_angular_radps)),
        )


ZERO = Velocity()
