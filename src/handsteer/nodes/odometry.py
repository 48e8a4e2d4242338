"""The velocity of a robot from its odometry."""

from handsteer.messages import Odometry, Pose
from handsteer.types import Velocity


class MeasuredVelocity:
    """Reads velocities from odometry, including sources that leave the twist at zero while the pose changes."""

    def __init__(self) -> None:
        self._pose: Pose | None = None

    def read(self, odometry: Odometry) -> Velocity | None:
        """Return the robot's velocity; None if it moves but its twist does not give the velocity."""
        twist, pose = odometry.twist.twist, odometry.pose.pose
        velocity = Velocity(twist.linear.x, twist.angular.z)
        has_moved, self._pose = self._pose not in (None, pose), pose
        return None if velocity.is_zero and has_moved else velocity
