"""What every robot offers."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from handsteer.types import Pose2D

Shape = Literal["box", "cylinder", "sphere"]


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
        collisions: How many times it has begun to touch an obstacle since the start; None where nobody can tell.
        located: Whether ``odometry`` and ``truth`` are those of now; otherwise they are the last that were known.
        trouble: What is wrong, as ``is not there: …``, to be read after "the robot"; empty when nothing is.
    """

    time_s: float
    odometry: Pose2D
    linear_mps: float
    angular_radps: float
    joint_positions: dict[str, float]
    joint_velocities: dict[str, float]
    truth: Pose2D
    contacts: tuple[str, ...]
    collisions: int | None
    located: bool = True
    trouble: str = ""


@dataclass(frozen=True)
class Obstacle:
    """A thing in the robot's world, where it is now.

    Attributes:
        name: What it is called; no other has this name.
        shape: A cylinder stands along its own z.
        size: Extent along its own x, y and z in metres: a sphere has its diameter three times.
        rgba: Red, green, blue and opacity, 0 to 1.
        position: Its centre in the world, in metres.
        orientation: Unit quaternion x, y, z, w, from its own axes to the world's.
    """

    name: str
    shape: Shape
    size: tuple[float, float, float]
    rgba: tuple[float, float, float, float]
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class RangeScan:
    """What a laser scanner has measured: one turn, or a part of one.

    Attributes:
        angle_min: Direction of the first ray in the scanner's frame, in rad, left positive.
        angle_increment: From one ray to the next, in rad.
        range_min: The shortest distance that it measures, in metres.
        range_max: The longest, in metres.
        ranges: (N,), in metres by ray; REP 117: +inf where nothing is, -inf where something is too near, NaN where
            nothing is known.
        age_s: How long ago it was measured, in seconds.
    """

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]
    age_s: float = 0.0


class Robot(Protocol):
    """A robot that takes velocity commands.

    Attributes:
        description: Its URDF, as on the topic ``/robot_description``.
    """

    @property
    def description(self) -> str: ...  # noqa: D102

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Ask for a velocity; the robot's own limits apply, and it brakes when no new one comes in time."""
        ...

    def step(self, dt_s: float) -> RobotState:
        """Let ``dt_s`` seconds pass and return the state after them."""
        ...

    def obstacles(self) -> list[Obstacle]:
        """Return the things around it, where they are now; an empty list if it knows of none."""
        ...

    def scan(self) -> RangeScan | None:
        """Return what its laser scanner sees; None when nothing new has come, or there is no scanner."""
        ...

    def commanders(self) -> list[str]:
        """Return the nodes that command it in a graph of its own, this one among them; none where it has none."""
        ...

    def reset(self) -> None:
        """Stand still at the start again, obstacles too."""
        ...

    def close(self) -> None:
        """Stop and release what is held; may be called twice."""
        ...
