"""Changes of single things in a world: pure functions from a world to a world."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from pydantic import ValidationError

from handsteer.errors import WorldError
from handsteer.robots import Robot, Shape
from handsteer.robots.world import Box, Cylinder, Sphere, Thing, World, describe_problem
from handsteer.types import Pose2D

Change = Callable[[World], World]

MOST_OBSTACLES = 200
"""Limit for things added by hand, because a browser has to draw each."""

_NEW: dict[Shape, dict[str, Any]] = {
    "box": {"size": (0.4, 0.4, 0.4), "colour": "#b5793f"},
    "cylinder": {"radius": 0.15, "height": 0.6, "colour": "#d9822b"},
    "sphere": {"radius": 0.18, "colour": "#e8c547", "movable": True, "mass": 0.3},
}
_ROBOT_RADIUS_M = 0.4
_GAP_M = 0.1
_RING_M = 0.5


@runtime_checkable
class InWorld(Robot, Protocol):
    """A robot in a world that can be changed, such as a simulated one.

    Attributes:
        world: Its world, with all things in their initial places.
    """

    @property
    def world(self) -> World: ...  # noqa: D102

    def enter(self, world: World) -> None:
        """Move the robot to the start of another world; odometry and collisions are reset to 0.

        Raises:
            WorldError: The world cannot be used; nothing has changed.
        """
        ...

    def change(self, world: World) -> None:
        """Stop the robot where it is, and replace the world around it by ``world``.

        Things that are the same in both worlds stay where they are.

        Raises:
            WorldError: Something new would overlap the robot or its start; nothing has changed.
        """
        ...

    def reset_odometry(self) -> None:
        """Set the odometry to 0 without moving the robot."""
        ...


def add(world: World, shape: Shape, robot: Pose2D) -> World:
    """Return ``world`` with one more thing, uniquely named, at the first free place in front of ``robot``.

    Raises:
        WorldError: There are too many already.
    """
    if len(world.obstacles) >= MOST_OBSTACLES:
        raise WorldError(f"the world is full: {MOST_OBSTACLES} things are the most that can be put in by hand")
    fields = {"name": unique_name(world, shape), "shape": shape, "position": (0.0, 0.0), **_NEW[shape]}
    radius = footprint_m(_checked(world, [fields]).obstacles[-1])
    return _checked(world, [*_dumped(world), {**fields, "position": free_place(world, robot, radius)}])


def edit(world: World, name: str, fields: Mapping[str, Any]) -> World:
    """Return ``world`` with the thing called ``name`` changed by ``fields``, as in a world file.

    Raises:
        WorldError: There is no such thing, or a field is wrong; the message names it.
    """
    index = _index(world, name)
    things = _dumped(world)
    things[index] = {**things[index], **fields}
    return _checked(world, things)


def remove(world: World, name: str) -> World:
    """Return ``world`` without the thing called ``name``.

    Raises:
        WorldError: There is no such thing.
    """
    index = _index(world, name)
    return world.model_copy(update={"obstacles": world.obstacles[:index] + world.obstacles[index + 1 :]})


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


def numeric_properties(thing: Thing) -> list[NumericProperty]:
    """Return all numeric properties of ``thing``."""
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


def unique_name(world: World, word: str) -> str:
    """Return ``word`` with the first number that makes it unique in ``world``."""
    taken = {thing.name for thing in world.obstacles}
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

    Places are searched in rings around the robot, each from its front to both sides. Things are represented by circles.
    """
    kept_free = [(robot.x, robot.y, _ROBOT_RADIUS_M), (0.0, 0.0, _ROBOT_RADIUS_M)]
    kept_free += [(*thing.position, footprint_m(thing)) for thing in world.obstacles]
    ring = 2
    while True:
        reach_m = ring * _RING_M + radius_m
        for step in range(2 * ring + 1):
            for side in (1, -1):
                bearing = robot.yaw + side * step * math.pi / (2 * ring)
                x = round(robot.x + reach_m * math.cos(bearing), 2)
                y = round(robot.y + reach_m * math.sin(bearing), 2)
                if all(math.dist((x, y), (cx, cy)) >= r + radius_m + _GAP_M for cx, cy, r in kept_free):
                    return x, y
        ring += 1


def _index(world: World, name: str) -> int:
    for index, thing in enumerate(world.obstacles):
        if thing.name == name:
            return index
    raise WorldError(f"there is nothing called {name!r} in the world any more")


def _dumped(world: World) -> list[dict[str, Any]]:
    return [thing.model_dump() for thing in world.obstacles]


def _checked(world: World, things: list[dict[str, Any]]) -> World:
    values = world.model_dump() | {"obstacles": things}
    try:
        return World.model_validate(values)
    except ValidationError as error:
        raise WorldError(describe_problem(error, values)) from None
