from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from handsteer.config import RobotConfig
from handsteer.plugins.bench.courses import COURSES, open_course
from handsteer.plugins.bench.laps import Conditions, run_lap
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.course import crosses
from handsteer.robots.world import load_world, shipped_worlds
from handsteer.types import Pose2D

SHIPPED = [name for name in shipped_worlds() if load_world(name).gates]


@pytest.mark.parametrize("name", SHIPPED)
def test_the_ideal_path_passes_all_gates_in_order_and_touches_nothing(name: str) -> None:
    course = open_course(name)
    poses = [Pose2D(x, y, 0.0) for x, y in course.path.points.tolist()]
    passed = [
        next(at for at, (before, now) in enumerate(pairwise(poses)) if crosses(gate, before, now))
        for gate in course.gates
    ]
    assert passed == sorted(passed)
    low, high = (course.path.index(end) for end in course.ends_m)
    assert course.clearances[low:high].min() > 0.0


def test_the_bench_drives_shipped_courses() -> None:
    assert set(COURSES) <= set(SHIPPED)


@pytest.mark.parametrize("name", sorted(set(SHIPPED) - {"slalom"}))
def test_an_operator_finishes_each_course_without_a_bump(name: str) -> None:
    walks = any(thing.route for thing in load_world(name).obstacles)
    lap = run_lap(name, "pad", 1, Conditions(assist="brake" if walks else "off"))
    assert lap.finished
    assert (lap.missed, lap.bumps) == (0, 0)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_robot_starts_free_of_obstacles(name: str) -> None:
    SimulatedRobot(RobotConfig(world=name))


def test_the_path_is_smooth_and_measured() -> None:
    path = open_course("slalom").path
    assert np.abs(np.diff(path.headings)).max() < 0.1
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert steps == pytest.approx(np.diff(path.s), rel=0.01)


def test_narrower_and_longer_courses_are_more_difficult(tmp_path: Path) -> None:
    def difficulty(length_m: float, gap_m: float) -> float:
        walls = "".join(
            f"  - {{name: {side}, shape: box, size: [{length_m}, 0.1, 0.5], position: [{length_m / 2 + 1}, {y}]}}\n"
            for side, y in (("left", gap_m / 2 + 0.05), ("right", -gap_m / 2 - 0.05))
        )
        file = tmp_path / "corridor.yaml"
        file.write_text(
            f"obstacles:\n{walls}gates:\n  - {{name: start, left: [1, 0.4], right: [1, -0.4]}}\n"
            f"  - {{name: finish, left: [{length_m + 1}, 0.4], right: [{length_m + 1}, -0.4]}}\n"
        )
        return open_course(str(file)).difficulty

    # Half of the gap is free on each side of the robot's centre, less half of its width.
    assert difficulty(4.0, 1.0) == pytest.approx(4.0 / (1.0 - 0.49), rel=0.03)
    assert difficulty(4.0, 0.8) > difficulty(4.0, 1.0)
    assert difficulty(6.0, 1.0) > difficulty(4.0, 1.0)
