"""The world of the simulated robot as a YAML file: a floor, things on it, and the gates of a course.

::

    floor: {size: [12, 12], colour: "#c8ccd4"}
    obstacles:
      - {name: wall, shape: box, size: [0.2, 4, 0.6], position: [4, 0], yaw: 0.3}
      - {name: barrel, shape: cylinder, radius: 0.2, height: 0.5, position: [2, 1], movable: true, mass: 2}
      - {name: ball, shape: sphere, radius: 0.15, position: [2, -1], movable: true}
      - {name: Ada, shape: cylinder, radius: 0.25, height: 1.7, position: [3, 1], route: [[3, -1]], speed: 0.8}
    gates:
      - {name: start, left: [1, 0.5], right: [1, -0.5]}

The robot starts at the origin, facing +x. Metres, kilograms and radians; x forward, y left (REP 103).
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError, model_validator

from handsteer import plain_yaml
from handsteer.config import Section
from handsteer.config.section import Values
from handsteer.errors import WorldError, as_name, did_you_mean, quoted
from handsteer.robots import Shape

_SHIPPED = Path(__file__).parent / "worlds"

_NARROWEST_GATE_M = 0.1
LONGEST_NAME = 60
"""Maximum number of characters of a world's name."""

Metres = Annotated[float, Field(ge=0.005, le=100)]
Coordinate = Annotated[float, Field(ge=-1000, le=1000)]
Colour = Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")]


class Floor(Section):
    """The floor to draw; the robot can drive beyond its edge."""

    size: tuple[Metres, Metres] = Field((12.0, 12.0), description="Extent along x and y, the origin in its middle [m]")
    colour: Colour = Field("#c8ccd4", description="As on web pages: #rrggbb")


class _Thing(Values):
    """Fields of all obstacles, which stand on the floor."""

    name: str = Field(min_length=1, max_length=60, description="What it is called when the robot touches it")
    position: tuple[Coordinate, Coordinate] = Field(description="x and y of its centre [m]")
    yaw: float = Field(0.0, ge=-math.tau, le=math.tau, description="Turn about the vertical, left positive [rad]")
    colour: Colour = Field("#8a94a6", description="As on web pages: #rrggbb")
    movable: bool = Field(False, description="Whether the robot can push it")
    mass: float = Field(1.0, ge=0.01, le=1000, description="Of a movable thing [kg]")
    route: tuple[tuple[Coordinate, Coordinate], ...] = Field(
        (), max_length=20, description="x and y of the points to which it goes from its place, and back again [m]"
    )
    speed: float = Field(0.8, ge=0.01, le=3, description="Of a thing with a route [m/s]")

    @model_validator(mode="after")
    def _goes_or_is_pushed(self) -> "_Thing":
        if self.route and self.movable:
            raise ValueError("a thing with a route cannot be movable as well")
        return self

    @property
    def rgba(self) -> tuple[float, float, float, float]:
        """Red, green, blue and opacity, 0 to 1."""
        red, green, blue = bytes.fromhex(self.colour[1:])
        return red / 255, green / 255, blue / 255, 1.0


class Box(_Thing):
    """A box."""

    shape: Literal["box"]
    size: tuple[Metres, Metres, Metres] = Field(description="Extent along its own x, y and z [m]")

    @property
    def extent(self) -> tuple[float, float, float]:
        """Extent along its own x, y and z in metres."""
        return self.size


class Cylinder(_Thing):
    """An upright cylinder."""

    shape: Literal["cylinder"]
    radius: Metres = Field(description="Radius [m]")
    height: Metres = Field(description="Height [m]")

    @property
    def extent(self) -> tuple[float, float, float]:
        """Extent along its own x, y and z in metres."""
        return 2 * self.radius, 2 * self.radius, self.height


class Sphere(_Thing):
    """A sphere."""

    shape: Literal["sphere"]
    radius: Metres = Field(description="Radius [m]")

    @property
    def extent(self) -> tuple[float, float, float]:
        """Extent along its own x, y and z in metres."""
        return 2 * self.radius, 2 * self.radius, 2 * self.radius


Thing = Annotated[Box | Cylinder | Sphere, Field(discriminator="shape")]


class Gate(Section):
    """A line on the floor to cross, in the direction given by its ends; posts at its ends, if any, are obstacles."""

    name: str = Field(min_length=1, max_length=60, description="What it is called")
    left: tuple[Coordinate, Coordinate] = Field(description="x and y of the end that the robot has on its left [m]")
    right: tuple[Coordinate, Coordinate] = Field(description="x and y of the other end [m]")

    @model_validator(mode="after")
    def _has_a_width(self) -> "Gate":
        if math.dist(self.left, self.right) < _NARROWEST_GATE_M:
            raise ValueError(f"left and right should be at least {_NARROWEST_GATE_M} m apart")
        return self


class Stop(Section):
    """A place on the floor to stop at, after the last gate of a course."""

    position: tuple[Coordinate, Coordinate] = Field(description="x and y where the robot's centre should be [m]")
    yaw: float = Field(0.0, ge=-math.tau, le=math.tau, description="Its heading there, left positive [rad]")
    tolerance: float = Field(0.15, ge=0.01, le=10, description="Largest distance along its heading [m]")


class World(Section):
    """A floor, the things on it, and the gates of a course in order.

    ``path`` and ``stop`` describe how a course is meant to be driven, for :mod:`handsteer.plugins.bench`.
    """

    name: str = Field("", max_length=LONGEST_NAME, description="What it is called; by default as its file")
    floor: Floor = Floor()
    obstacles: tuple[Thing, ...] = ()
    gates: tuple[Gate, ...] = Field((), max_length=100)
    path: tuple[tuple[Coordinate, Coordinate], ...] = Field((), max_length=200)
    stop: Stop | None = None

    @model_validator(mode="after")
    def _names_differ(self) -> "World":
        for kind, named in (("obstacle", self.obstacles), ("gate", self.gates)):
            seen: set[str] = set()
            for thing in named:
                if thing.name in seen:
                    raise ValueError(f"two are called {quoted(thing.name)}; every {kind} needs a name of its own")
                seen.add(thing.name)
        return self


Change = Callable[[World], World]
"""Makes a changed world of a world."""


def shipped_worlds() -> list[str]:
    """Return the names of the worlds that come with handsteer."""
    return sorted(path.stem for path in _SHIPPED.glob("*.yaml"))


def load_world(name_or_path: str | Path) -> World:
    """Return a world that comes with handsteer, by its name, or one from a YAML file.

    Raises:
        WorldError: There is no such world, the file cannot be read, or a field in it is wrong; the message names the
            file and the field.
    """
    name = str(name_or_path)
    if name in shipped_worlds():
        return read_world(_SHIPPED / f"{name}.yaml")
    path = Path(name_or_path)
    if name and (path.suffix in (".yaml", ".yml") or path.exists()):
        return read_world(path)
    known = shipped_worlds()
    near = did_you_mean(name, known)
    raise WorldError(
        f"there is no world {quoted(name)}{near or ':'} use {', '.join(known)}, or the path of a .yaml file"
    )


def read_world(path: Path) -> World:
    """Return the world in the YAML file at ``path``.

    Raises:
        WorldError: As :func:`load_world`.
    """
    values = plain_yaml.read(path, str(path), WorldError, f"cannot read the world {path}")
    return named_by_file(_world(values, str(path)), path)


def named_by_file(world: World, path: Path) -> World:
    """Return ``world``, which was in the file ``path``, under the file's name if it has none of its own."""
    return world if world.name else world.model_copy(update={"name": path.stem[:LONGEST_NAME]})


def parse_world(text: str, source: str) -> World:
    """Return the world in ``text``.

    Args:
        text: YAML.
        source: Name in error messages, such as that of a file.

    Raises:
        WorldError: It is not valid YAML, or a field in it is wrong; the message names ``source`` and the field.
    """
    return _world(plain_yaml.parse(text, source, WorldError), source)


def _world(values: Any, source: str) -> World:
    try:
        return World.model_validate({} if values is None else values)
    except ValidationError as error:
        raise WorldError(f"{source}: {describe_problem(error, values)}") from None


def write_world(world: World) -> str:
    """Return ``world`` as YAML, one line per thing, for :func:`parse_world`."""
    parts = world.model_dump(exclude_defaults=True)
    lines = [_one_line({"name": world.name})[1:-1]] if world.name else []
    lines += [f"floor: {_one_line(world.floor.model_dump())}"]
    for section in ("obstacles", "gates"):
        if things := parts.get(section):
            lines += [f"{section}:", *(f"  - {_one_line(thing)}" for thing in things)]
    if world.path:
        lines.append(f"path: {_one_line([list(point) for point in world.path])}")
    if world.stop:
        lines.append(f"stop: {_one_line(world.stop.model_dump())}")
    return "\n".join(lines) + "\n"


def _one_line(values: dict[str, Any] | list[list[float]]) -> str:
    # Unprintable characters are escaped: some break lines, and would be read back as a space.
    texts = values.values() if isinstance(values, dict) else ()
    readable = all(value.isprintable() for value in texts if isinstance(value, str))
    return yaml.safe_dump(
        values, default_flow_style=True, sort_keys=False, allow_unicode=readable, width=math.inf
    ).strip()


def describe_problem(error: ValidationError, values: Any) -> str:
    """Return the first problem in one line: where, what is wrong, what is allowed."""
    problem = error.errors(include_url=False)[0]
    where = _where(problem["loc"], values)
    kind, given = problem["type"], problem["input"]
    shapes = "box, cylinder or sphere"
    reasons = {
        "missing": "is missing",
        "extra_forbidden": "there is no such field",
        "union_tag_not_found": f"shape is missing; use {shapes}",
        "union_tag_invalid": f"shape must be {shapes}, not {as_name(problem.get('ctx', {}).get('tag', ''))}",
        "tuple_type": f"{quoted(given)} should be a list, such as [a, b]",
        "string_pattern_mismatch": f"{quoted(given)} should be a colour such as '#c04020'",
        "value_error": problem["msg"].removeprefix("Value error, "),
    }
    return f"{where}: {reasons.get(kind) or quoted(given) + problem['msg'].removeprefix('Input')}"


def _where(location: tuple[int | str, ...], values: Any) -> str:
    """Return a path such as ``obstacles[2] 'ball' radius``."""
    match location:
        case ("obstacles" | "gates" as section, int(index), *rest):
            thing = values[section][index]
            name = thing.get("name") if isinstance(thing, dict) else None
            shapes: tuple[Shape, ...] = ("box", "cylinder", "sphere")
            fields = [as_name(part) for part in rest if part not in shapes]
            return " ".join([f"{section}[{index}]", *([quoted(name)] if name else []), ".".join(fields)]).rstrip()
        case ():
            return "obstacles" if isinstance(values, dict) else "world"
        case _:
            return ".".join(as_name(part) for part in location)
