"""How fast a robot moves, by what its odometry says."""

from handsteer.messages import Odometry, Pose
from handsteer.types import Velocity


class MeasuredVelocity:
    """Reads velocities out of odometry, of which some leaves its twist at zero though its pose goes on."""

    def __init__(self) -> None:
        self._pose: Pose | None = None

    def read(self, odometry: Odometry) -> Velocity | None:
        """Return how fast the robot moves; None when it moves, and its twist does not say how fast."""
        twist, pose = odometry.twist.twist, odometry.pose.pose
        velocity = Velocity(twist.linear.x, twist.angular.z)
        has_moved, self._pose = self._pose not in (None, pose), pose
        return None if velocity.is_zero and has_moved else velocity
