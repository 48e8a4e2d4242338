"""Speed of the simulation relative to real time, for each shipped world.

Run ``python benchmarks/simulation.py``; it takes some seconds, on one core.
"""

import time

from handsteer.config import RobotConfig
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.world import shipped_worlds

_SIMULATED_S = 60.0
_PERIOD_S = 0.02
_ROUNDS = 3

_DRIVES = {"standing": (0.0, 0.0), "straight": (0.05, 0.0), "circling": (0.5, 1.0), "fast ahead": (2.0, 0.0)}
"""Linear m/s and angular rad/s; going straight, it soon pushes against the island of the world obstacles."""


def real_time_factor(world: str, linear_mps: float, angular_radps: float) -> float:
    """Return simulated seconds per second, the best of some rounds."""
    return max(_one_round(SimulatedRobot(RobotConfig(world=world)), linear_mps, angular_radps) for _ in range(_ROUNDS))


def _one_round(robot: SimulatedRobot, linear_mps: float, angular_radps: float) -> float:
    started = time.perf_counter()
    for _ in range(round(_SIMULATED_S / _PERIOD_S)):
        robot.command(linear_mps, angular_radps)
        robot.step(_PERIOD_S)
    return _SIMULATED_S / (time.perf_counter() - started)


def main() -> None:
    print("Simulated seconds per second, commands and states at 50 Hz, one core")
    print(f"{'world':<12}" + "".join(f"{name:>14}" for name in _DRIVES))
    for world in shipped_worlds():
        factors = (real_time_factor(world, *drive) for drive in _DRIVES.values())
        print(f"{world:<12}" + "".join(f"{factor:>14.0f}" for factor in factors))


if __name__ == "__main__":
    main()
