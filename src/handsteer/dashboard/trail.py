"""The robot's path, reduced to few points."""

import math
from dataclasses import dataclass, replace

from handsteer.types import Pose2D

MOST_POINTS = 1000
"""The oldest points beyond these are dropped."""

STEP_M = 0.08
"""Distance between points."""

LEAP_M = 0.5
"""A robot farther than this from the last point was repositioned, which starts a new trail."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Trail:
    """The path so far.

    Attributes:
        points: x and y in metres, oldest first.
        count: Total number of points, including dropped ones.
        number: Number of earlier trails.
    """

    points: tuple[Point, ...] = ()
    count: int = 0
    number: int = 0

    def to(self, pose: Pose2D) -> "Trail":
        """Return the trail extended to ``pose``."""
        point = (pose.x, pose.y)
        distance_m = math.dist(self.points[-1], point) if self.points else math.inf
        if distance_m < STEP_M:
            return self
        if LEAP_M < distance_m < math.inf:
            return self.anew().to(pose)
        return replace(self, points=(*self.points[-MOST_POINTS + 1 :], point), count=self.count + 1)

    def anew(self) -> "Trail":
        """Return an empty trail with another number."""
        return Trail(number=self.number + 1)

    def since(self, shown: "Trail") -> tuple[Point, ...]:
        """Return the points added since ``shown``, an earlier state of the same trail."""
        new = self.count - shown.count
        return self.points[-new:] if new else ()
