import pytest

from handsteer.dashboard.world_editor import LARGEST_FILE_BYTES, read_file
from handsteer.errors import WorldError
from handsteer.robots import Shape
from handsteer.robots.editing import add, edit, numeric_properties
from handsteer.robots.world import World
from handsteer.types import Pose2D


def test_a_file_comes_with_its_name() -> None:
    assert read_file({"name": "mine.yaml", "text": "floor: {}"}) == ("mine.yaml", "floor: {}")


@pytest.mark.parametrize("text", [None, "x" * (LARGEST_FILE_BYTES + 1), "é" * (LARGEST_FILE_BYTES // 2 + 1)])
def test_a_large_file_is_refused(text: str | None) -> None:
    with pytest.raises(WorldError, match=r"mine.yaml: is larger than 64 kB"):
        read_file({"name": "mine.yaml", "text": text})


@pytest.mark.parametrize("sent", [None, [], "text", {}, {"name": 5, "text": ""}, {"name": "a", "text": 5}])
def test_what_is_no_file_is_refused(sent: object) -> None:
    with pytest.raises(WorldError, match="no file"):
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
