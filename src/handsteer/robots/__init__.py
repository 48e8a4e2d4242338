"""Robots to drive, a simulated one or one behind a topic, and their interface.

``remote`` is a real robot behind a topic, whose commands a pure part computes (``command_limiter``). ``handsteer run``
joins that robot's graph in addition to its own, in which it is the node ``robot`` like a simulated one. ``world`` is a
world in YAML, and ``course`` counts its gates.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from handsteer.types import Pose2D

if TYPE_CHECKING:
    from handsteer.robots.world import World

Shape = Literal["box", "cylinder", "sphere"]


@dataclass(frozen=True)
class RobotState:
    """The robot at one moment.

    Attributes:
        time_s: Time since the start, in the robot's own seconds.
        odometry: Pose from odometry, in frame ``odom``.
        linear_mps: Forward velocity from odometry, in m/s.
        angular_radps: Angular velocity from odometry, in rad/s.
        truth: The actual pose in the world, or that from odometry if nothing better is known.
        joint_positions: Wheel angles in rad, by joint name.
        joint_velocities: Wheel speeds in rad/s, by joint name.
        contacts: Names of the obstacles that it touches now.
        collisions: How many times it has begun to touch an obstacle since the start; None if unknown.
        located: Whether ``odometry`` and ``truth`` are current; otherwise they are the last known ones.
        trouble: What is wrong, as ``is not there: …``, to be read after "the robot"; empty if nothing is.
    """

    time_s: float
    odometry: Pose2D
    linear_mps: float
    angular_radps: float
    truth: Pose2D
    joint_positions: dict[str, float] = field(default_factory=dict)
    joint_velocities: dict[str, float] = field(default_factory=dict)
    contacts: tuple[str, ...] = ()
    collisions: int | None = None
    located: bool = True
    trouble: str = ""


@dataclass(frozen=True)
class Obstacle:
    """A thing in the robot's world, at its current place.

    Attributes:
        name: Unique name.
        shape: A cylinder's axis is its own z.
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
    """A laser scan: one turn, or a part of one.

    Attributes:
        angle_min: Direction of the first ray in the scanner's frame, in rad, left positive.
        angle_increment: Angle between two rays, in rad.
        range_min: Minimum measurable distance, in metres.
        range_max: Maximum measurable distance, in metres.
        ranges: (N,), in metres by ray; REP 117: +inf for no obstacle, -inf for one that is too near, NaN for no
            reading.
        age_s: Time since the measurement, in seconds.
        frame_id: Of another scanner than the robot's first; empty if it is that one's.
    """

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]
    age_s: float = 0.0
    frame_id: str = ""


class Robot(Protocol):
    """A robot that takes velocity commands.

    Attributes:
        description: Its URDF, as on the topic ``/robot_description``.
    """

    @property
    def description(self) -> str: ...  # noqa: D102

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Command a velocity; the robot's own limits apply, and it brakes if no new one arrives in time."""
        ...

    def step(self, dt_s: float) -> RobotState:
        """Advance time by ``dt_s`` seconds and return the new state."""
        ...

    def obstacles(self) -> list[Obstacle]:
        """Return the things around it at their current places; empty if unknown."""
        ...

    def scan(self) -> RangeScan | None:
        """Return the scan of its laser scanner; None if there is no new one, or no scanner."""
        ...

    def commanders(self) -> list[str]:
        """Return the nodes that command it in a graph of its own, this one included; empty without such a graph."""
        ...

    def close(self) -> None:
        """Stop and release all resources; may be called twice."""
        ...


@runtime_checkable
class Waiting(Robot, Protocol):
    """A robot that waits for a commanded zero after it was away."""

    def stand(self) -> None:
        """Stop, although no zero was commanded."""
        ...


@runtime_checkable
class InWorld(Robot, Protocol):
    """A robot in a world that can be changed, such as a simulated one.

    Attributes:
        world: Its world, with all things in their initial places.
    """

    @property
    def world(self) -> "World": ...  # noqa: D102

    def enter(self, world: "World") -> None:
        """Move the robot to the start of another world; odometry and collisions are reset to 0.

        Raises:
            WorldError: The world cannot be used; nothing has changed.
        """
        ...

    def change(self, world: "World") -> None:
        """Stop the robot where it is, and replace the world around it by ``world``.

        Things that are the same in both worlds stay where they are, even if they were pushed.

        Raises:
            WorldError: Something new would overlap the robot or its start; nothing has changed.
        """
        ...

    def reset(self) -> None:
        """Reset the robot, the obstacles, odometry and collisions; the time continues."""
        ...

    def reset_odometry(self) -> None:
        """Set the odometry to 0 without moving the robot."""
        ...
