import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import RobotConfig
from handsteer.errors import WorldError
from handsteer.robots import Shape
from handsteer.robots.editing import MOST_OBSTACLES, add, edit, footprint_m, free_place, remove
from handsteer.robots.simulated import SimulatedRobot
from handsteer.robots.world import Box, World, load_world
from handsteer.types import Pose2D

START = Pose2D(0.0, 0.0, 0.0)
SHAPES: tuple[Shape, ...] = ("box", "cylinder", "sphere")


def test_what_is_added_stands_in_front_of_the_robot_under_a_name_of_its_own() -> None:
    world = add(add(add(World(), "box", START), "box", START), "sphere", START)
    assert [thing.name for thing in world.obstacles] == ["box 1", "box 2", "sphere 1"]
    assert world.obstacles[0].position[0] > 1.0
    assert world.obstacles[0].position[1] == 0.0


def test_a_name_that_was_given_up_is_taken_again() -> None:
    world = add(add(World(), "box", START), "box", START)
    world = add(remove(world, "box 1"), "box", START)
    assert [thing.name for thing in world.obstacles] == ["box 2", "box 1"]


@given(
    shapes=st.lists(st.sampled_from(SHAPES), max_size=8),
    robot=st.builds(Pose2D, st.floats(-5, 5), st.floats(-5, 5), st.floats(-4, 4)),
)
def test_what_is_added_touches_neither_the_robot_nor_its_start_nor_other_things(
    shapes: list[Shape], robot: Pose2D
) -> None:
    world = load_world("obstacles")
    for shape in shapes:
        radius_m = footprint_m(add(World(), shape, START).obstacles[0])
        place = free_place(world, robot, radius_m)
        for x, y in ((robot.x, robot.y), (0.0, 0.0)):
            assert math.dist(place, (x, y)) > radius_m + 0.35
        for thing in world.obstacles:
            assert math.dist(place, thing.position) > radius_m + footprint_m(thing)
        world = add(world, shape, robot)
        assert world.obstacles[-1].position == place


def test_a_world_has_room_for_so_many_and_no_more() -> None:
    ball = {"shape": "sphere", "radius": 0.1}
    things = [{**ball, "name": f"ball {n}", "position": [n, 9]} for n in range(MOST_OBSTACLES)]
    with pytest.raises(WorldError, match="200 things are the most"):
        add(World.model_validate({"obstacles": things}), "box", START)


def test_fields_are_changed_and_the_rest_stays() -> None:
    world = add(load_world("slalom"), "box", START)
    changed = edit(world, "box 1", {"size": [1.0, 0.5, 0.2], "colour": "#00ff00", "movable": True})
    box = changed.obstacles[-1]
    assert isinstance(box, Box)
    assert (box.size, box.colour, box.movable) == ((1.0, 0.5, 0.2), "#00ff00", True)
    assert box.position == world.obstacles[-1].position
    assert (changed.gates, changed.floor, changed.obstacles[:-1]) == (world.gates, world.floor, world.obstacles[:-1])


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"size": [1.0, -1.0, 1.0]}, "'box 1' size.1: -1.0 should be greater"),
        ({"colour": "red"}, "'box 1' colour"),
        ({"radius": 1.0}, "'box 1' radius: there is no such field"),
        ({"position": [math.nan, 0.0]}, "'box 1' position.0: nan"),
        ({"name": "front wall"}, "two are called 'front wall'"),
    ],
)
def test_a_wrong_field_is_refused_by_its_name(fields: dict[str, object], words: str) -> None:
    world = add(load_world("obstacles"), "box", START)
    with pytest.raises(WorldError) as error:
        edit(world, "box 1", fields)
    assert words in str(error.value)


@pytest.mark.parametrize("change", [lambda world: remove(world, "ghost"), lambda world: edit(world, "ghost", {})])
def test_what_is_not_there_is_refused(change: Callable[[World], object]) -> None:
    with pytest.raises(WorldError, match="nothing called 'ghost'"):
        change(World())


def drive(robot: SimulatedRobot, linear_mps: float, angular_radps: float, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        robot.command(linear_mps, angular_radps)
        robot.step(0.02)


def test_the_robot_stands_where_it_is_when_its_world_changes_and_drives_on() -> None:
    robot = SimulatedRobot(RobotConfig(), World())
    drive(robot, 0.5, 0.3, 2.0)
    before = robot.step(0.0)
    robot.change(add(robot.world, "box", before.truth))
    after = robot.step(0.0)
    assert (after.truth, after.odometry) == (before.truth, before.odometry)
    assert after.joint_positions == before.joint_positions
    assert after.linear_mps == 0.0
    assert [thing.name for thing in robot.obstacles()] == ["box 1"]
    robot.step(1.0)
    assert robot.step(0.0).truth.x == pytest.approx(before.truth.x, abs=1e-3)
    drive(robot, 0.5, 0.0, 4.0)
    assert robot.step(0.0).contacts == ("box 1",)
    assert robot.step(0.0).collisions == 1


def test_things_that_were_pushed_stay_where_they_are_when_another_changes() -> None:
    ball = {"name": "ball", "shape": "sphere", "radius": 0.15, "position": [0.8, 0], "movable": True}
    robot = SimulatedRobot(RobotConfig(), World.model_validate({"obstacles": [ball]}))
    drive(robot, 0.4, 0.0, 3.0)
    drive(robot, -0.4, 0.0, 1.0)
    pushed = robot.obstacles()[0]
    assert pushed.position[0] > 1.2
    world = World.model_validate(
        {"obstacles": [{"name": "can", "shape": "cylinder", "radius": 0.1, "height": 1, "position": [0, 3]}, ball]}
    )
    robot.change(world)
    assert robot.obstacles()[1] == pushed
    robot.change(edit(world, "ball", {"position": [0.0, -2.0]}))
    assert robot.obstacles()[1].position == (0.0, -2.0, 0.15)
    assert robot.obstacles()[0].position == (0.0, 3.0, 0.5)


@pytest.mark.parametrize(
    ("position", "words"), [([1.0, 0.0], "would overlap the robot"), ([0.0, 0.2], "starts at 0, 0")]
)
def test_nothing_is_put_onto_the_robot_or_its_start(position: list[float], words: str) -> None:
    robot = SimulatedRobot(RobotConfig(), World())
    drive(robot, 0.5, 0.0, 2.5)
    world = add(World(), "box", START)
    before = robot.step(0.0)
    with pytest.raises(WorldError, match=words):
        robot.change(edit(world, "box 1", {"position": position}))
    assert robot.world == World()
    assert robot.step(0.0) == before


def test_a_robot_that_leans_on_a_wall_lets_other_things_be_added() -> None:
    wall = {"name": "wall", "shape": "box", "size": [0.2, 4, 0.5], "position": [1, 0]}
    robot = SimulatedRobot(RobotConfig(), World.model_validate({"obstacles": [wall]}))
    drive(robot, 0.5, 0.0, 4.0)
    state = robot.step(0.0)
    assert state.contacts == ("wall",)
    robot.change(add(robot.world, "box", state.truth))
    assert len(robot.obstacles()) == 2


def test_another_world_is_entered_at_its_start() -> None:
    robot = SimulatedRobot(RobotConfig(), World())
    drive(robot, 0.5, 0.3, 2.0)
    robot.enter(load_world("slalom"))
    state = robot.step(0.0)
    assert (state.truth, state.odometry, state.collisions) == (START, START, 0)
    assert len(robot.obstacles()) == 16
    on_start = {"name": "a", "shape": "sphere", "radius": 0.2, "position": [0.1, 0]}
    with pytest.raises(WorldError, match="'a' overlaps the robot"):
        robot.enter(World.model_validate({"obstacles": [on_start]}))
    assert robot.world == load_world("slalom")
