"""What every robot offers."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Pose2D:
    """A pose on the floor: x and y in metres, yaw in radians, left positive (REP 103)."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class RobotState:
    """The robot at one moment.

    Attributes:
        time_s: Time since the start, in the robot's own seconds.
        odometry: Where the wheels say that it is, in frame ``odom``.
        linear_mps: Forward velocity that the wheels say, in m/s.
        angular_radps: Turning velocity that the wheels say, in rad/s.
        joint_positions: Wheel angles in rad, by joint name.
        joint_velocities: Wheel speeds in rad/s, by joint name.
        truth: Where it really is, in the world.
        contacts: Names of the obstacles that it touches now.
        collisions: How many times it has begun to touch an obstacle since the start.
    """

    time_s: float
    odometry: Pose2D
    linear_mps: float
    angular_radps: float
    joint_positions: dict[str, float]
    joint_velocities: dict[str, float]
    truth: Pose2D
    contacts: tuple[str, ...]
    collisions: int


class Robot(Protocol):
    """A robot that takes velocity commands."""

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Ask for a velocity; the robot's own limits apply, and it brakes when no new one comes in time."""
        ...

    def step(self, dt_s: float) -> RobotState:
        """Let ``dt_s`` seconds pass and return the state after them."""
        ...

    def reset(self) -> None:
        """Stand still at the start again, obstacles too."""
        ...

    def close(self) -> None:
        """Stop and release what is held; may be called twice."""
        ...
