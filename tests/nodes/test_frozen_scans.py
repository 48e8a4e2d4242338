"""A scanner that repeats one scan while the robot moves, and scans that only look as if."""

import math

import numpy as np
import pytest

from handsteer.config import CollisionMonitorConfig
from handsteer.messages import Header, LaserScan, Point, Pose, Quaternion, Time
from handsteer.nodes.frozen_scans import FrozenScans
from handsteer.nodes.robot import scan_message
from handsteer.robots import RangeScan
from tests.nodes.test_collision_monitor import WALL, Drive

RULE = CollisionMonitorConfig()


def scan(ahead_m: float = 3.0, side_m: float = 1.0, stamp_s: int = 0) -> LaserScan:
    angles = -math.pi + np.arange(360) * math.tau / 360
    sides = side_m / np.maximum(np.abs(np.sin(angles)), 1e-9)
    ranges = np.minimum(sides, ahead_m / np.maximum(np.cos(angles), 1e-9))
    ranges[ranges > 8.0] = np.inf
    found = RangeScan(-math.pi, math.tau / 360, 0.05, 8.0, ranges.astype(np.float32))
    return scan_message(Header(Time(stamp_s, 0), "base_scan"), found)


def pose(x_m: float = 0.0, yaw: float = 0.0) -> Pose:
    return Pose(Point(x_m, 0.0, 0.0), Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def is_frozen(first: LaserScan, second: LaserScan, moved: Pose) -> bool:
    frozen = FrozenScans()
    frozen.move(pose())
    frozen.note(first, RULE)
    frozen.move(moved)
    return frozen.note(second, RULE)[1]


@pytest.mark.parametrize("moved", [pose(0.2), pose(-0.2), pose(0.0, 0.2), pose(0.0, -0.2)])
def test_a_scan_that_is_the_same_after_a_motion_is_frozen(moved: Pose) -> None:
    assert is_frozen(scan(), scan(stamp_s=1), moved)


@pytest.mark.parametrize(
    ("first", "second", "moved"),
    [
        pytest.param(scan(), scan(stamp_s=1), pose(0.05, 0.05), id="hardly moved"),
        pytest.param(scan(), scan(2.8, stamp_s=1), pose(0.2), id="another scan"),
        pytest.param(scan(stamp_s=1), scan(stamp_s=1), pose(0.2), id="the same message again"),
        pytest.param(scan(99.0), scan(99.0, stamp_s=1), pose(0.2), id="a long corridor"),
        pytest.param(scan(99.0, 99.0), scan(99.0, 99.0, stamp_s=1), pose(0.2, 0.5), id="nothing in view"),
    ],
)
def test_others_are_not(first: LaserScan, second: LaserScan, moved: Pose) -> None:
    assert not is_frozen(first, second, moved)


class FrozenRobot(Drive):
    """Its scanner repeats what it saw when ``freezes`` became true."""

    freezes = False

    def freeze(self) -> None:
        robot = self.robot._robot
        first = robot.scan()
        robot.scan = lambda: first  # type: ignore[method-assign]


@pytest.mark.parametrize("assist", ["brake", "steer"])
def test_a_scanner_that_freezes_stops_the_robot_which_stays_stopped(assist: str) -> None:
    drive = FrozenRobot(WALL, assist=assist)
    drive.run(0.2)
    drive.steer(0.5, 0.0, 1.5)
    assert drive.robot.state.linear_mps > 0.4
    before_m = drive.robot.state.truth.x
    drive.freeze()
    drive.run(1.5)
    assert abs(drive.robot.state.linear_mps) < 0.01
    assert drive.robot.state.truth.x - before_m < 0.4
    message, _ = drive.report()
    assert "the laser scans do not change while the robot moves" in message
    drive.steer(0.5, 0.0, 2.0)
    assert abs(drive.robot.state.linear_mps) < 0.01


def test_scans_without_stamps_are_frozen_too() -> None:
    assert is_frozen(scan(), scan(), pose(0.2))


@pytest.mark.parametrize("seed", range(2))
def test_a_scanner_that_works_never_freezes(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    random = np.random.default_rng(seed)
    drive = Drive(WALL)
    drive.run(0.2)
    for linear_mps, angular_radps, seconds in random.uniform([-1, -2, 0.2], [1, 2, 2.0], (20, 3)):
        drive.steer(linear_mps, angular_radps, seconds)
        drive.steer(linear_mps, 0.0, seconds)
    assert "do not change" not in caplog.text


def test_frozen_scans_stay_frozen_when_the_robot_is_back_where_they_began() -> None:
    drive = Drive(WALL)
    monitor = drive.control._monitor
    monitor._frozen.move(pose())
    monitor._freezes(scan())
    monitor._frozen.move(pose(0.2))
    assert monitor._freezes(scan(stamp_s=1))
    monitor._frozen.move(pose())
    assert monitor._freezes(scan(stamp_s=2))
    assert not monitor._freezes(scan(2.8, stamp_s=3))
