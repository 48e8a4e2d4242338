"""Where the robot has gone, in few points: pure."""

import math
from dataclasses import dataclass, replace

from handsteer.types import Pose2D

MOST_POINTS = 1000
"""Older ones are forgotten."""

STEP_M = 0.08
"""Points are so far apart."""

LEAP_M = 0.5
"""Whoever is so far from the last point was put there, and begins a new trail."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Trail:
    """The way so far.

    Attributes:
        points: x and y in metres, oldest first.
        count: How many points there have been, those that were forgotten too.
        number: How many trails there were before.
    """

    points: tuple[Point, ...] = ()
    count: int = 0
    number: int = 0

    def to(self, pose: Pose2D) -> "Trail":
        """Return the trail as it is when the robot is at ``pose``."""
        point = (pose.x, pose.y)
        distance_m = math.dist(self.points[-1], point) if self.points else math.inf
        if distance_m < STEP_M:
            return self
        if LEAP_M < distance_m < math.inf:
            return self.anew().to(pose)
        return replace(self, points=(*self.points[-MOST_POINTS + 1 :], point), count=self.count + 1)

    def anew(self) -> "Trail":
        """Return an empty trail that others can tell from this one."""
        return Trail(number=self.number + 1)

    def since(self, shown: "Trail") -> tuple[Point, ...]:
        """Return the points that are new since ``shown``, an earlier state of the same trail."""
        new = self.count - shown.count
        return self.points[-new:] if new else ()
