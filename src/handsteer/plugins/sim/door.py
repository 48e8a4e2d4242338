"""The door of the simulated robot."""

from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import needing
from handsteer.robots import Robot


def open_robot(config: Config, _clock: Clock) -> Robot:
    """Return the simulated robot in its world.

    Raises:
        WorldError: The world cannot be used.
        PackageMissing: The simulator is not installed.
    """
    with needing("the simulated robot", "sim", "mujoco", "xacro"):
        from handsteer.plugins.sim.simulated import SimulatedRobot

    return SimulatedRobot(config.robot)
