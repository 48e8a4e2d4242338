from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from handsteer.errors import WorldError
from handsteer.plugins.page.editing import rename
from handsteer.robots.world import World, load_world, parse_world, shipped_worlds, write_world

BOX = "name: a, shape: box, size: [1, 1, 1], position: [3, 0]"


def thing(fields: str) -> str:
    return f"obstacles:\n  - {{{fields}}}\n"


def test_shipped_worlds() -> None:
    courses = ["corridor", "doors", "figure-eight", "maze", "narrow-doors", "parking", "roundabout", "slalom"]
    courses += ["stop-line", "warehouse"]
    assert shipped_worlds() == sorted(["empty", "obstacles", *courses])
    assert all(load_world(name).gates for name in courses)
    assert load_world("empty").obstacles == ()
    things = load_world("obstacles").obstacles
    assert {thing.shape for thing in things} == {"box", "cylinder", "sphere"}
    assert {thing.movable for thing in things} == {True, False}


def test_a_file_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(thing("name: ball, shape: sphere, radius: 0.2, position: [1, 2], colour: '#ff0080', movable: true"))
    (ball,) = load_world(str(path)).obstacles
    assert ball == load_world(path).obstacles[0]
    assert (ball.position, ball.extent, ball.movable) == ((1.0, 2.0), (0.4, 0.4, 0.4), True)
    assert ball.rgba == (1.0, 0.0, 128 / 255, 1.0)


def test_an_empty_file_is_an_empty_world(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("# nothing yet\n")
    assert load_world(path) == rename(load_world("empty"), "mine")


@pytest.mark.parametrize("name", ["moon", ""])
def test_an_unknown_name_lists_the_known_ones(name: str) -> None:
    names = ", ".join(shipped_worlds())
    with pytest.raises(WorldError, match=rf"no world '{name}': use {names}, or the path of a \.yaml file"):
        load_world(name)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("floor: [", "line 1: not valid YAML"),
        ("\0", "not valid YAML"),
        ("floor: 2026-13-45", "floor"),
        ("[" * 5000, "line 1: lists and tables are nested more than 32 deep"),
        ("just words", "world"),
        ("flor: {}", "flor: there is no such field"),
        ("floor: {size: [1]}", "floor.size"),
        ("floor: {size: [1, 0]}", "floor.size.1: 0"),
        ("floor: {colour: green}", "floor.colour: 'green'"),
        ("obstacles: {}", "obstacles"),
        ("obstacles: [5]", "obstacles[0]"),
        (thing("name: a, position: [3, 0]"), "obstacles[0] 'a': shape is missing"),
        (thing("shape: cone, name: a"), "shape must be box, cylinder or sphere, not cone"),
        (thing("shape: box, name: a, position: [3, 0]"), "obstacles[0] 'a' size: is missing"),
        (thing("shape: sphere, radius: 1, position: [3, 0]"), "obstacles[0] name: is missing"),
        (thing(BOX + ", radius: 1"), "'a' radius: there is no such field"),
        (thing(BOX + ", size: [1, -1, 1]").replace("size: [1, 1, 1], ", ""), "'a' size.1: -1 should be greater"),
        (thing(BOX + ", yaw: 90"), "'a' yaw: 90 should be less"),
        (thing(BOX + ", yaw: .nan"), "'a' yaw: nan should be a finite number"),
        (thing(BOX + ", mass: 0"), "'a' mass: 0 should be greater"),
        (thing(BOX + ", movable: perhaps"), "'a' movable: 'perhaps'"),
        (thing(BOX + ", colour: '#12345'"), "'a' colour: '#12345'"),
        (thing(BOX + ", route: [[1, 2], [3]]"), "'a' route.1"),
        (thing(BOX + ", speed: 0"), "'a' speed: 0 should be greater"),
        (thing(BOX + ", route: [[1, 2]], movable: true"), "'a': a thing with a route cannot be movable as well"),
        (thing(BOX).replace("[3, 0]", "[3, 1e9]"), "'a' position.1"),
        (thing(BOX).replace("[3, 0]", "here"), "'a' position"),
        (thing(BOX) + "  - {" + BOX + "}", "two are called 'a'"),
        ("gates: [{name: g, left: [1, 0], right: [1, 0.05]}]", "gates[0] 'g': left and right should be at least 0.1 m"),
        ("gates: [{name: g, left: [1, 0]}]", "gates[0] 'g' right: is missing"),
    ],
)
def test_a_bad_file_is_refused_in_one_line_that_names_file_and_field(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(WorldError) as error:
        load_world(path)
    assert words in str(error.value)
    assert "bad.yaml" in str(error.value)
    assert "\n" not in str(error.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00\x80")
    for path, words in ((tmp_path / "none.yaml", "No such file"), (tmp_path, "directory"), (binary, "not valid YAML")):
        with pytest.raises(WorldError, match=words) as error:
            load_world(path)
        assert str(path) in str(error.value)


yaml_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["floor", "obstacles", "shape", "size", "name", "box"]), inner, max_size=3)
    ),
    max_leaves=8,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(values=yaml_values)
def test_any_yaml_is_read_or_refused(tmp_path: Path, values: object) -> None:
    path = tmp_path / "any.yaml"
    path.write_text(yaml.safe_dump(values), encoding="utf-8")
    with suppress(WorldError):
        load_world(path)


TOP = {"shape": "sphere", "radius": 1.0, "position": [0.0, 0.0]}
numbers = st.floats(-1000, 1000)
metres = st.floats(0.005, 100)
places = st.tuples(numbers, numbers)
colours = st.from_regex(r"\A#[0-9a-f]{6}\Z")
common = {
    "name": st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=60),
    "position": places,
    "yaw": st.floats(-6.28, 6.28),
    "colour": colours,
    "movable": st.booleans(),
    "mass": st.floats(0.01, 1000),
    "speed": st.floats(0.01, 3),
}
routes = st.lists(places, max_size=3)
things = st.one_of(
    st.fixed_dictionaries({"shape": st.just("box"), "size": st.tuples(metres, metres, metres), **common}),
    st.fixed_dictionaries({"shape": st.just("cylinder"), "radius": metres, "height": metres, **common}),
    st.fixed_dictionaries({"shape": st.just("sphere"), "radius": metres, **common}),
)
gates = st.builds(
    lambda name, left, way: {"name": name, "left": left, "right": (left[0] + way, left[1])},
    common["name"],
    st.tuples(st.floats(-900, 900), numbers),
    st.floats(0.2, 90),
)
worlds = st.builds(
    World.model_validate,
    st.fixed_dictionaries(
        {
            "floor": st.fixed_dictionaries({"size": st.tuples(metres, metres), "colour": colours}),
            "obstacles": st.lists(
                st.builds(
                    lambda thing, route: thing if thing["movable"] else {**thing, "route": route}, things, routes
                ),
                max_size=5,
                unique_by=lambda thing: thing["name"],
            ),
            "gates": st.lists(gates, max_size=4, unique_by=lambda gate: gate["name"]),
            "path": st.lists(st.tuples(numbers, numbers), max_size=4),
            "stop": st.none() | st.fixed_dictionaries({"position": st.tuples(numbers, numbers)}),
        }
    ),
)


@given(world=worlds)
@example(world=World.model_validate({"obstacles": [{**TOP, "name": "\x85"}, {**TOP, "name": "Größe 中\u2028\n: #{'"}]}))
def test_a_world_that_is_written_is_read_as_the_same(world: World) -> None:
    text = write_world(world)
    assert parse_world(text, "mine") == world
    assert text.encode("utf-8").decode("utf-8") == text


@pytest.mark.parametrize("name", shipped_worlds())
def test_shipped_worlds_are_written_one_line_a_thing(name: str) -> None:
    world = load_world(name)
    text = write_world(world)
    assert parse_world(text, "mine") == world
    headings = sum(bool(part) for part in (world.obstacles, world.gates, world.path, world.stop))
    assert len(text.splitlines()) == 2 + headings + len(world.obstacles) + len(world.gates)
