import math

import numpy as np
import pytest

from handsteer.config import RobotConfig
from handsteer.plugins.page.urdf import joints
from handsteer.plugins.sim.physics import RANGE_MAX_M, SCAN_LINK
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RangeScan
from handsteer.robots.description import robot_description
from handsteer.robots.world import World


def make(*obstacles: dict[str, object]) -> SimulatedRobot:
    return SimulatedRobot(RobotConfig(), World.model_validate({"obstacles": obstacles}))


def box(name: str, x: float, y: float, **fields: object) -> dict[str, object]:
    return {"name": name, "shape": "box", "size": [0.2, 0.2, 0.5], "position": [x, y], **fields}


def at(scan: RangeScan, degrees: float) -> float:
    """Return the range of the ray in this direction, left positive."""
    return float(scan.ranges[round((math.radians(degrees) - scan.angle_min) / scan.angle_increment) % 360])


def test_a_room_is_measured_to_its_walls() -> None:
    """Each ray ends where it leaves the rectangle of the four walls' insides."""
    walls: list[dict[str, object]] = [
        {"name": "front", "shape": "box", "size": [0.2, 9, 0.5], "position": [3.1, 0]},
        {"name": "back", "shape": "box", "size": [0.2, 9, 0.5], "position": [-2.1, 0]},
        {"name": "left", "shape": "box", "size": [9, 0.2, 0.5], "position": [0, 4.1]},
        {"name": "right", "shape": "box", "size": [9, 0.2, 0.5], "position": [0, -1.1]},
    ]
    scan = make(*walls).scan()
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, 3.0, 2.0) / np.abs(np.cos(angles))
        to_y = np.where(np.sin(angles) > 0, 4.0, 1.0) / np.abs(np.sin(angles))
    assert len(scan.ranges) == 360
    assert np.abs(scan.ranges - np.minimum(to_x, to_y)).max() < 1e-3


def test_a_cylinder_and_a_sphere_are_round() -> None:
    scan = make(
        {"name": "post", "shape": "cylinder", "radius": 0.3, "height": 1.0, "position": [2, 0]},
        {"name": "ball", "shape": "sphere", "radius": 0.2, "position": [0, 1.5]},
    ).scan()
    assert at(scan, 0) == pytest.approx(1.7, abs=1e-3)
    # The scanner is 4 cm below the middle of the ball.
    assert at(scan, 90) == pytest.approx(1.5 - math.sqrt(0.2**2 - 0.04**2), abs=2e-3)


def test_it_sees_from_where_the_robot_is_and_looks() -> None:
    robot = make(box("mark", 3.0, 0.0))
    for _ in range(100):
        robot.command(0.5, 0.0)
        robot.step(0.02)
    for _ in range(200):
        robot.command(0.0, 1.0)
        truth = robot.step(0.02).truth
    bearing = math.atan2(-truth.y, 3.0 - truth.x) - truth.yaw
    far = math.hypot(3.0 - truth.x, truth.y)
    assert far - 0.15 < at(robot.scan(), math.degrees(bearing)) < far - 0.09


def test_it_sees_neither_floor_nor_robot_nor_what_is_beyond_its_reach_or_below_its_height() -> None:
    robot = make(box("far", RANGE_MAX_M + 1.0, 0.0), box("low", 0.0, 1.0, size=[0.4, 0.4, 0.1]))
    assert np.isposinf(robot.scan().ranges).all()
    assert np.isposinf(make(box("just beyond", RANGE_MAX_M + 0.11, 0.0)).scan().ranges).all()
    assert at(make(box("just within", RANGE_MAX_M + 0.09, 0.0)).scan(), 0) == pytest.approx(RANGE_MAX_M, abs=0.02)


def test_what_was_pushed_is_seen_where_it_is() -> None:
    robot = make(box("crate", 0.8, 0.0, movable=True))
    before = at(robot.scan(), 0)
    for _ in range(150):
        robot.command(0.3, 0.0)
        robot.step(0.02)
    (crate,) = robot.obstacles()
    state = robot.step(0.0)
    assert crate.position[0] > 0.85
    assert at(robot.scan(), 0) < before
    assert at(robot.scan(), 0) == pytest.approx(crate.position[0] - 0.1 - state.truth.x, abs=0.02)


def test_a_world_that_has_changed_is_seen_at_once() -> None:
    robot = make()
    robot.change(World.model_validate({"obstacles": [box("new", 1.0, 0.0)]}))
    assert at(robot.scan(), 0) == pytest.approx(0.9, abs=1e-3)


def test_the_scanner_is_above_the_rest_of_the_robot() -> None:
    (mount,) = (joint for joint in joints(robot_description()) if joint.child == SCAN_LINK)
    assert mount.parent == "base_link"
    assert mount.type == "fixed"
    assert mount.xyz == (0.0, 0.0, 0.16)
