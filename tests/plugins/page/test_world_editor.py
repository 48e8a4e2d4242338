from pathlib import Path

import pytest

from handsteer.errors import WorldError
from handsteer.plugins.page.editing import add, add_gate, edit, numeric_properties, rename
from handsteer.plugins.page.world_desk import MOST_STEPS, History
from handsteer.plugins.page.world_editor import LARGEST_FILE_BYTES, read_file
from handsteer.plugins.page.world_plan import bounds, union
from handsteer.robots import Shape
from handsteer.robots.world import World, load_world, named_by_file, parse_world, write_world
from handsteer.types import Pose2D

START = Pose2D(0.0, 0.0, 0.0)


def test_a_file_comes_with_its_name() -> None:
    assert read_file({"name": "mine.yaml", "text": "floor: {}"}) == ("mine.yaml", "floor: {}")


@pytest.mark.parametrize("text", [None, "x" * (LARGEST_FILE_BYTES + 1), "é" * (LARGEST_FILE_BYTES // 2 + 1)])
def test_a_large_file_is_refused(text: str | None) -> None:
    with pytest.raises(WorldError, match=r"mine.yaml: is larger than 64 kB"):
        read_file({"name": "mine.yaml", "text": text})


@pytest.mark.parametrize("sent", [None, [], "text", {}, {"name": 5, "text": ""}, {"name": "a", "text": 5}])
def test_what_is_no_file_is_refused(sent: object) -> None:
    with pytest.raises(WorldError, match="not a file"):
        read_file(sent)


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere"])
def test_each_figure_changes_itself_and_nothing_else(shape: Shape) -> None:
    world = add(World(), shape, Pose2D(0.0, 0.0, 0.0))
    thing = world.obstacles[0]
    before = numeric_properties(thing)
    for index, number in enumerate(before):
        changed = edit(world, thing.name, number.fields(number.value + 0.25))
        after = [after.value for after in numeric_properties(changed.obstacles[0])]
        expected = [same.value + 0.25 * (at == index) for at, same in enumerate(before)]
        assert after == pytest.approx(expected)


def test_undo_and_redo_go_through_the_worlds_and_forget_what_others_have_changed() -> None:
    empty = World(name="empty")
    one = add(empty, "box", START)
    two = rename(add(one, "box", START), "mine")
    history = History()
    history.note(empty, one)
    history.note(one, two)
    assert (history.to(-1), history.to(1)) == (one, None)
    history.go(-1)
    history.go(-1)
    assert (history.to(-1), history.to(1)) == (None, one)
    history.go(1)
    assert (history.to(-1), history.to(1)) == (empty, two)
    history.follow(add(one, "sphere", START))
    assert (history.to(-1), history.to(1)) == (None, None)


def test_only_the_last_changes_can_be_undone() -> None:
    history, world = History(), World()
    for number in range(MOST_STEPS + 5):
        after = add_gate(World(), (number, 0.5), (number, -0.5))
        history.note(world, after)
        world = after
    steps = 0
    while history.to(-1):
        history.go(-1)
        steps += 1
    assert steps == MOST_STEPS


def test_the_plan_shows_all_of_a_world_with_a_margin() -> None:
    x, y, width, height = bounds(load_world("slalom"))
    ends = [point for gate in load_world("slalom").gates for point in (gate.left, gate.right)]
    assert all(x + 0.5 < at_x < x + width - 0.5 and y + 0.5 < at_y < y + height - 0.5 for at_x, at_y in ends)
    assert union((0, 0, 1, 1), (-1, 0.5, 1, 2)) == (-1, 0, 2, 2.5)


def test_a_world_has_a_name_that_it_keeps_in_its_file() -> None:
    world = rename(load_world("slalom"), "  Mein  Kurs: 2 ")
    assert (load_world("slalom").name, world.name) == ("slalom", "Mein Kurs: 2")
    assert parse_world(write_world(world), "other.yaml") == world
    assert named_by_file(parse_world("floor: {}", "other"), Path("folder/other.yaml")).name == "other"
    assert named_by_file(world, Path("folder/other.yaml")) == world
    for wrong in ("", " ", "x" * 61, "a\x07b"):
        with pytest.raises(WorldError, match="is not a valid name for a world"):
            rename(world, wrong)
