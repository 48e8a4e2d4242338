"""Changes of single things in a world: pure functions from a world to a world."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import ValidationError

from handsteer.errors import WorldError, quoted
from handsteer.robots import Shape
from handsteer.robots.world import LONGEST_NAME, Box, Cylinder, Gate, Sphere, Thing, World, describe_problem
from handsteer.types import Pose2D

Section = Literal["obstacles", "gates"]
"""What can be edited in a world."""

Place = tuple[float, float]
"""x and y in metres."""

MOST_OBSTACLES = 200
"""Limit for things added by hand, because a browser has to draw each."""

_NEW: dict[Shape, dict[str, Any]] = {
    "box": {"size": (0.4, 0.4, 0.4), "colour": "#b5793f"},
    "cylinder": {"radius": 0.15, "height": 0.6, "colour": "#d9822b"},
    "sphere": {"radius": 0.18, "colour": "#e8c547", "movable": True, "mass": 0.3},
}
_WALL_WIDTH_M, _WALL_HEIGHT_M = 0.1, 0.5
_ROBOT_RADIUS_M = 0.4
_GAP_M = 0.1
_RING_M = 0.5
_MOST_RINGS = 200


def rename(world: World, name: str) -> World:
    """Return ``world`` under another name.

    Raises:
        WorldError: The name is empty, too long, or not printable.
    """
    name = " ".join(name.split())
    if not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
        raise WorldError(
            f"{quoted(name)} is not a valid name for a world: give 1 to {LONGEST_NAME} printable characters"
        )
    return world.model_copy(update={"name": name})


def add(world: World, shape: Shape, robot: Pose2D) -> World:
    """Return ``world`` with one more thing, uniquely named, at the first free place in front of ``robot``.

    Raises:
        WorldError: There are too many already, or no place is free.
    """
    fields = {"name": unique_name(world, shape), "shape": shape, "position": (0.0, 0.0), **_NEW[shape]}
    radius = footprint_m(_checked(world, [fields]).obstacles[-1])
    return _with_thing(world, {**fields, "position": free_place(world, robot, radius)})


def add_wall(world: World, start: Place, end: Place) -> World:
    """Return ``world`` with a wall, a thin box, from ``start`` to ``end``.

    Raises:
        WorldError: There are too many things already, or the wall is too short or too long.
    """
    (x, y), (to_x, to_y) = start, end
    size = (round(math.dist(start, end), 3), _WALL_WIDTH_M, _WALL_HEIGHT_M)
    fields: dict[str, Any] = {"name": unique_name(world, "wall"), "shape": "box", "size": size, "colour": "#9aa3b2"}
    fields |= {"position": _rounded(((x + to_x) / 2, (y + to_y) / 2)), "yaw": round(math.atan2(to_y - y, to_x - x), 4)}
    return _with_thing(world, fields)


def add_gate(world: World, left: Place, right: Place) -> World:
    """Return ``world`` with one more gate at the end of its course; its path, which leads elsewhere, is removed.

    Raises:
        WorldError: There are too many gates already, or the ends are too near to each other.
    """
    fields = {"name": unique_name(world, "gate", "gates"), "left": _rounded(left), "right": _rounded(right)}
    return _checked(world, [*_dumped(world, "gates"), fields], "gates")


def edit(world: World, name: str, fields: Mapping[str, Any], section: Section = "obstacles") -> World:
    """Return ``world`` with the thing or gate called ``name`` changed by ``fields``, as in a world file.

    Raises:
        WorldError: There is no such thing, or a field is wrong; the message names it.
    """
    index = _index(world, name, section)
    things = _dumped(world, section)
    things[index] = {**things[index], **fields}
    return _checked(world, things, section)


def remove(world: World, name: str, section: Section = "obstacles") -> World:
    """Return ``world`` without the thing or gate called ``name``.

    Raises:
        WorldError: There is no such thing.
    """
    index = _index(world, name, section)
    things = _dumped(world, section)
    return _checked(world, things[:index] + things[index + 1 :], section)


def reorder(world: World, name: str, step: int) -> World:
    """Return ``world`` with the gate called ``name`` later in the course by ``step``, or earlier if negative.

    Raises:
        WorldError: There is no such gate.
    """
    index = _index(world, name, "gates")
    gates = _dumped(world, "gates")
    gate = gates.pop(index)
    gates.insert(max(0, index + step), gate)
    return _checked(world, gates, "gates")


def replace(_world: World, by: World) -> World:
    """Return ``by``, for undo and redo."""
    return by


@dataclass(frozen=True)
class NumericProperty:
    """One numeric property of a thing.

    Attributes:
        name: With its unit.
        value: Current value.
        step: Increment of the input's arrows.
        fields: Returns the fields of the world file that set another value.
    """

    name: str
    value: float
    step: float
    fields: Callable[[float], dict[str, Any]]


def heading(gate: Gate) -> float:
    """Return the direction in which ``gate`` is to be passed, in rad."""
    return math.atan2(gate.right[0] - gate.left[0], gate.left[1] - gate.right[1])


def place(thing: Thing | Gate) -> Place:
    """Return x and y of the middle of ``thing``."""
    if isinstance(thing, Gate):
        return (thing.left[0] + thing.right[0]) / 2, (thing.left[1] + thing.right[1]) / 2
    return thing.position


def put(thing: Thing | Gate, to: Place) -> dict[str, Any]:
    """Return the fields of the world file that move the middle of ``thing`` to ``to``."""
    if isinstance(thing, Gate):
        return _ends(to, math.dist(thing.left, thing.right), heading(thing))
    return {"position": _rounded(to)}


def numeric_properties(thing: Thing | Gate) -> list[NumericProperty]:
    """Return all numeric properties of ``thing``."""
    if isinstance(thing, Gate):
        return _numbers_of_gate(thing)
    x, y = thing.position
    found = [
        NumericProperty("x [m]", x, 0.1, lambda value: {"position": (value, y)}),
        NumericProperty("y [m]", y, 0.1, lambda value: {"position": (x, value)}),
    ]
    match thing:
        case Box(size=(length, width, height)):
            found += [
                NumericProperty("length [m]", length, 0.1, lambda value: {"size": (value, width, height)}),
                NumericProperty("width [m]", width, 0.1, lambda value: {"size": (length, value, height)}),
                NumericProperty("height [m]", height, 0.1, lambda value: {"size": (length, width, value)}),
                NumericProperty("turn [°]", math.degrees(thing.yaw), 15.0, lambda value: {"yaw": math.radians(value)}),
            ]
        case Cylinder():
            found += [
                NumericProperty("radius [m]", thing.radius, 0.05, lambda value: {"radius": value}),
                NumericProperty("height [m]", thing.height, 0.1, lambda value: {"height": value}),
            ]
        case Sphere():
            found.append(NumericProperty("radius [m]", thing.radius, 0.05, lambda value: {"radius": value}))
    return [*found, NumericProperty("mass [kg]", thing.mass, 0.1, lambda value: {"mass": value})]


def _numbers_of_gate(gate: Gate) -> list[NumericProperty]:
    (x, y), width, turn = place(gate), math.dist(gate.left, gate.right), heading(gate)
    return [
        NumericProperty("x [m]", x, 0.1, lambda value: _ends((value, y), width, turn)),
        NumericProperty("y [m]", y, 0.1, lambda value: _ends((x, value), width, turn)),
        NumericProperty("width [m]", width, 0.1, lambda value: _ends((x, y), value, turn)),
        NumericProperty("turn [°]", math.degrees(turn), 15.0, lambda value: _ends((x, y), width, math.radians(value))),
    ]


def _ends(middle: Place, width: float, turn: float) -> dict[str, Any]:
    x, y = middle
    to_x, to_y = -math.sin(turn) * width / 2, math.cos(turn) * width / 2
    return {"left": _rounded((x + to_x, y + to_y)), "right": _rounded((x - to_x, y - to_y))}


def _rounded(point: Place) -> Place:
    return round(point[0], 3), round(point[1], 3)


def unique_name(world: World, word: str, section: Section = "obstacles") -> str:
    """Return ``word`` with the first number that makes it unique in ``section`` of ``world``."""
    taken = {thing.name for thing in _things(world, section)}
    number = 1
    while f"{word} {number}" in taken:
        number += 1
    return f"{word} {number}"


def footprint_m(thing: Thing) -> float:
    """Return the radius of the circumscribed circle of ``thing`` on the floor, in metres."""
    x, y, _ = thing.extent
    return math.hypot(x, y) / 2 if thing.shape == "box" else x / 2


def free_place(world: World, robot: Pose2D, radius_m: float) -> tuple[float, float]:
    """Return x and y of a free place for a thing of ``radius_m`` near the robot, in front of it if possible.

    Places are searched in rings around the robot, each from its front to both sides. The thing is taken as a circle.

    Raises:
        WorldError: There is none within 100 m.
    """

    def is_free(x: float, y: float) -> bool:
        starts = (math.dist((x, y), at) - _ROBOT_RADIUS_M for at in ((robot.x, robot.y), (0.0, 0.0)))
        things = (_distance_m(thing, x, y) for thing in world.obstacles)
        return min(*starts, *things) >= radius_m + _GAP_M

    for ring in range(2, _MOST_RINGS):
        reach_m = ring * _RING_M + radius_m
        for step in range(2 * ring + 1):
            for side in (1, -1):
                bearing = robot.yaw + side * step * math.pi / (2 * ring)
                x = round(robot.x + reach_m * math.cos(bearing), 2)
                y = round(robot.y + reach_m * math.sin(bearing), 2)
                if is_free(x, y):
                    return x, y
    raise WorldError("there is no free place near the robot: remove something first")


def _distance_m(thing: Thing, x: float, y: float) -> float:
    """Return the distance of x, y from the outline of ``thing`` on the floor; 0 or less inside."""
    x, y = x - thing.position[0], y - thing.position[1]
    if thing.shape != "box":
        return math.hypot(x, y) - footprint_m(thing)
    cosine, sine = math.cos(thing.yaw), math.sin(thing.yaw)
    length, width, _ = thing.extent
    return math.hypot(
        max(0.0, abs(x * cosine + y * sine) - length / 2), max(0.0, abs(y * cosine - x * sine) - width / 2)
    )


def _things(world: World, section: Section) -> tuple[Thing, ...] | tuple[Gate, ...]:
    return world.gates if section == "gates" else world.obstacles


def _index(world: World, name: str, section: Section) -> int:
    for index, thing in enumerate(_things(world, section)):
        if thing.name == name:
            return index
    raise WorldError(f"there is nothing called {name!r} in the world any more")


def _dumped(world: World, section: Section = "obstacles") -> list[dict[str, Any]]:
    return [thing.model_dump() for thing in _things(world, section)]


def _with_thing(world: World, fields: dict[str, Any]) -> World:
    if len(world.obstacles) >= MOST_OBSTACLES:
        raise WorldError(f"the world is full: {MOST_OBSTACLES} things are the most that can be put in by hand")
    return _checked(world, [*_dumped(world), fields])


def _checked(world: World, things: list[dict[str, Any]], section: Section = "obstacles") -> World:
    values = world.model_dump() | {section: things} | ({"path": ()} if section == "gates" else {})
    try:
        return World.model_validate(values)
    except ValidationError as error:
        raise WorldError(describe_problem(error, values)) from None
