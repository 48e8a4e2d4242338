"""Number of collisions of a randomly steered robot, with and without the collision monitor.

Run ``python benchmarks/obstacles.py``. Each drive has 60 commands of up to 1 m/s and 2 rad/s, of 0.2 to 2 s each, among
eight posts within four walls; in every second drive the scans are 0.1 s late with newer stamps. It also measures the
CPU time of a command.
"""

import time

import numpy as np

from handsteer.clock import SteppedClock
from handsteer.config import CollisionMonitorConfig, ControlConfig, RobotConfig
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.robot import RobotNode
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RangeScan
from handsteer.robots.world import World
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import Velocity

DRIVES, COMMANDS, POSTS = 30, 60, 8
WALLS = [
    {"name": "front", "shape": "box", "size": [0.2, 6.4, 0.5], "position": [3.1, 0]},
    {"name": "back", "shape": "box", "size": [0.2, 6.4, 0.5], "position": [-3.1, 0]},
    {"name": "left", "shape": "box", "size": [6, 0.2, 0.5], "position": [0, 3.1]},
    {"name": "right", "shape": "box", "size": [6, 0.2, 0.5], "position": [0, -3.1]},
]


class LateRobot(SimulatedRobot):
    """Returns the previous scan as if it were new."""

    _before: RangeScan | None = None

    def scan(self) -> RangeScan:
        before, self._before = self._before, super().scan()
        return before or self._before


class TimedLimiter(ObstacleLimiter):
    """Records the CPU time of each command, in seconds."""

    spent_s: list[float] = []  # noqa: RUF012 - for all of them

    def limit(self, wanted: Velocity, now_s: float) -> Velocity:
        began_s = time.thread_time()
        said = super().limit(wanted, now_s)
        TimedLimiter.spent_s.append(time.thread_time() - began_s)
        return said


def world(rng: np.random.Generator) -> World:
    places: list[list[float]] = []
    while len(places) < POSTS:
        place = rng.uniform(-2.5, 2.5, 2)
        if np.hypot(*place) > 0.6:
            places.append(place.tolist())
    posts = [
        {"name": f"post {number}", "shape": "cylinder", "radius": 0.08, "height": 0.5, "position": place}
        for number, place in enumerate(places)
    ]
    return World.model_validate({"obstacles": [*WALLS, *posts]})


def run(nodes: list[Node], clock: SteppedClock, seconds: float) -> None:
    end_s = clock.now() + seconds
    while (due_s := min(node.next_due_s or 0.0 for node in nodes)) <= end_s:
        clock.advance_to(due_s)
        while any([node.spin_once() for node in nodes]):
            pass
    clock.advance_to(end_s)


def drive(seed: int, *, enabled: bool) -> tuple[int, float, float]:
    """Return touches, metres and seconds of one drive."""
    rng = np.random.default_rng(seed)
    wires = (InProcessTransport(), SteppedClock())
    kind = LateRobot if seed % 2 else SimulatedRobot
    robot = RobotNode(*wires, kind(RobotConfig(), world(rng)), RobotConfig())
    rule = CollisionMonitorConfig(enabled=enabled)
    control = HandSignControlNode(*wires, ControlConfig(), collision_monitor=rule)
    steering = SteeringNode(*wires)
    nodes: list[Node] = [steering, robot, control]
    run(nodes, wires[1], 0.2)
    for linear_mps, angular_radps, seconds in rng.uniform([-1, -2, 0.2], [1, 2, 2], (COMMANDS, 3)).tolist():
        steering.steer(linear_mps, angular_radps if rng.random() < 0.6 else 0.0)
        run(nodes, wires[1], seconds)
    return robot.state.collisions or 0, robot.path_length_m, wires[1].now()


def main() -> None:
    from handsteer.nodes import collision_monitor  # noqa: PLC0415

    collision_monitor.ObstacleLimiter = TimedLimiter  # type: ignore[attr-defined]
    print("| collision_monitor.enabled | touches | drives with any | metres | seconds |\n|---|---|---|---|---|")
    for enabled in (False, True):
        drives = [drive(100 + number, enabled=enabled) for number in range(DRIVES)]
        touches, metres, seconds = (sum(column) for column in zip(*drives, strict=True))
        touched = sum(one[0] > 0 for one in drives)
        print(f"| {str(enabled).lower()} | {touches} | {touched} of {DRIVES} | {metres:.0f} | {seconds:.0f} |")
    median, high = np.percentile(TimedLimiter.spent_s, [50, 99]) * 1000
    print(f"\na command takes {median:.2f} ms (median), {high:.2f} ms (99th percentile) of CPU time")


if __name__ == "__main__":
    main()
