import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import RobotConfig
from handsteer.errors import WorldError
from handsteer.plugins.page.editing import (
    MOST_OBSTACLES,
    add,
    add_gate,
    add_wall,
    edit,
    footprint_m,
    free_place,
    heading,
    numeric_properties,
    put,
    remove,
    reorder,
)
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import Shape
from handsteer.robots.world import Box, Thing, World, load_world
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


def floor_under(thing: Thing) -> list[tuple[float, float]]:
    """Return points all over the floor that ``thing`` covers."""
    (x, y), (length, width, _) = thing.position, thing.extent
    cosine, sine = math.cos(thing.yaw), math.sin(thing.yaw)
    parts = [part / 40 - 0.5 for part in range(41)]
    places = [(length * along, width * across) for along in parts for across in parts]
    if thing.shape != "box":
        places = [place for place in places if math.hypot(*place) <= length / 2]
    return [(x + along * cosine - across * sine, y + along * sine + across * cosine) for along, across in places]


@pytest.mark.slow
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
            assert min(math.dist(place, point) for point in floor_under(thing)) > radius_m
        world = add(world, shape, robot)
        assert world.obstacles[-1].position == place


def test_a_robot_that_is_nowhere_has_no_place_near_it() -> None:
    with pytest.raises(WorldError, match="no free place"):
        free_place(World(), Pose2D(math.nan, 0.0, 0.0), 0.2)


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


def test_a_wall_goes_from_its_start_to_its_end() -> None:
    wall = add_wall(World(), (1.0, 1.0), (1.0, 3.0)).obstacles[0]
    assert (wall.name, wall.position, wall.extent) == ("wall 1", (1.0, 2.0), (2.0, 0.1, 0.5))
    assert wall.yaw == pytest.approx(math.pi / 2, abs=1e-3)


def test_walls_without_length_or_end_are_refused() -> None:
    with pytest.raises(WorldError, match="size"):
        add_wall(World(), (1.0, 1.0), (1.0, 1.0))
    with pytest.raises(WorldError, match="size"):
        add_wall(World(), (-900.0, 1.0), (900.0, 1.0))
    with pytest.raises(WorldError, match=r"0\.1 m apart"):
        add_gate(World(), (1.0, 1.0), (1.0, 1.0))


def test_gates_are_moved_changed_ordered_and_removed_and_a_path_for_others_is_dropped() -> None:
    world = add_gate(add_gate(load_world("maze"), (1.0, 4.5), (1.0, 3.5)), (2.0, 4.5), (2.0, 3.5))
    assert [gate.name for gate in world.gates][-2:] == ["gate 1", "gate 5"]
    assert world.path == ()
    gate = world.gates[-1]
    assert heading(gate) == 0.0
    assert edit(world, "gate 5", put(gate, (3.0, 0.0)), "gates").gates[-1].left == (3.0, 0.5)
    width, turn = numeric_properties(gate)[2:]
    assert edit(world, "gate 5", width.fields(2.0), "gates").gates[-1].left == (2.0, 5.0)
    turned = edit(world, "gate 5", turn.fields(90.0), "gates").gates[-1]
    assert (turned.left, turned.right) == ((1.5, 4.0), (2.5, 4.0))
    assert [gate.name for gate in reorder(world, "gate 5", -1).gates][-2:] == ["gate 5", "gate 1"]
    assert reorder(reorder(world, "start", -1), "gate 5", 1) == world
    assert "gate 5" not in [gate.name for gate in remove(world, "gate 5", "gates").gates]


def test_what_is_added_stays_on_the_robots_side_of_long_walls() -> None:
    x, y = add(load_world("obstacles"), "box", START).obstacles[-1].position
    assert max(abs(x), abs(y)) < 5.0
