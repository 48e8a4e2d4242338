"""Robots to drive: a simulated one, or one behind a topic."""

from typing import Any

from handsteer.config import RobotConfig
from handsteer.errors import ConfigError, needing
from handsteer.messages import CMD_VEL, Topic
from handsteer.robots.protocol import Robot
from handsteer.transports.base import Session


def open_robot(
    config: RobotConfig, link: Session | None = None, cmd_vel: Topic[Any] = CMD_VEL, frame_id: str = "base_link"
) -> Robot:
    """Return the robot that ``config.kind`` names.

    Args:
        config: Names and configures the robot.
        link: This process in the graph of a real robot; not needed by a simulated one.
        cmd_vel: Topic of a real robot's commands, with Twist or TwistStamped.
        frame_id: Coordinate frame of a TwistStamped.

    Raises:
        ConfigError: It is a real robot, and there is no link to it.
        WorldError: The world of a simulated robot cannot be used.
        PackageMissing: The simulator is not installed.
    """
    # All nodes import this module; only the process that has a robot loads its libraries (xacro, MuJoCo).
    if config.kind != "sim":
        if link is None:
            raise ConfigError(f"robot.kind is {config.kind}: only `handsteer run` drives a real robot; here it is sim")
        from handsteer.robots.remote import RemoteRobot  # noqa: PLC0415

        return RemoteRobot(config, cmd_vel, frame_id, link)
    with needing("the simulated robot", "sim", "mujoco", "xacro"):
        from handsteer.robots.simulated import SimulatedRobot  # noqa: PLC0415

    return SimulatedRobot(config)
