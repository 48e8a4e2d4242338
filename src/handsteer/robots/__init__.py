"""What is driven: a simulated robot, or one behind a topic."""

from collections.abc import Callable

from handsteer.config import RobotConfig
from handsteer.robots.protocol import Robot


def open_robot(config: RobotConfig) -> Robot:
    """Return the robot that ``config.kind`` names.

    Raises:
        WorldError: The world of a simulated robot cannot be used.
    """
    return _KINDS[config.kind](config)


def _simulated(config: RobotConfig) -> Robot:
    # MuJoCo is loaded only when it is used.
    from handsteer.robots.simulated import SimulatedRobot  # noqa: PLC0415

    return SimulatedRobot(config)


_KINDS: dict[str, Callable[[RobotConfig], Robot]] = {"sim": _simulated}
