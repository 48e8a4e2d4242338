"""The world that the simulated robot drives in, as a YAML file: a floor, and things on it that are fixed or movable.

::

    floor: {size: [12, 12], colour: "#c8ccd4"}
    obstacles:
      - {name: wall, shape: box, size: [0.2, 4, 0.6], position: [4, 0], yaw: 0.3}
      - {name: barrel, shape: cylinder, radius: 0.2, height: 0.5, position: [2, 1], movable: true, mass: 2}
      - {name: ball, shape: sphere, radius: 0.15, position: [2, -1], movable: true}

The robot starts at the origin, facing +x. Metres, kilograms and radians; x forward, y left (REP 103).
"""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError, model_validator

from handsteer.config import Section
from handsteer.errors import WorldError
from handsteer.robots.protocol import Shape

_SHIPPED = Path(__file__).parent / "worlds"

Metres = Annotated[float, Field(ge=0.005, le=100)]
Coordinate = Annotated[float, Field(ge=-1000, le=1000)]
Colour = Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")]


class Floor(Section):
    """The floor as it is drawn; the robot can drive on beyond its edge."""

    size: tuple[Metres, Metres] = Field((12.0, 12.0), description="Extent along x and y, the origin in its middle [m]")
    colour: Colour = Field("#c8ccd4", description="As on web pages: #rrggbb")


class _Thing(Section):
    """What all obstacles have; each stands on the floor."""

    name: str = Field(min_length=1, max_length=60, description="What it is called when the robot touches it")
    position: tuple[Coordinate, Coordinate] = Field(description="x and y of its centre [m]")
    yaw: float = Field(0.0, ge=-math.tau, le=math.tau, description="Turn about the vertical, left positive [rad]")
    colour: Colour = Field("#8a94a6", description="As on web pages: #rrggbb")
    movable: bool = Field(False, description="Whether the robot can push it")
    mass: float = Field(1.0, ge=0.01, le=1000, description="Of a movable thing [kg]")

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


class World(Section):
    """A floor and what stands on it."""

    floor: Floor = Floor()
    obstacles: tuple[Thing, ...] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> "World":
        names = [thing.name for thing in self.obstacles]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two are called {twice[0]!r}; every obstacle needs a name of its own")
        return self


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
    if path.suffix in (".yaml", ".yml") or path.exists():
        return read_world(path)
    raise WorldError(f"there is no world {name!r}; use {' or '.join(shipped_worlds())}, or the path of a .yaml file")


def read_world(path: Path) -> World:
    """Return the world in the YAML file at ``path``.

    Raises:
        WorldError: As :func:`load_world`.
    """
    values = _read_yaml(path)
    try:
        return World.model_validate({} if values is None else values)
    except ValidationError as error:
        raise WorldError(f"{path}: {_describe(error, values)}") from None


def _read_yaml(path: Path) -> Any:
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WorldError(f"cannot read the world {path}: {error.strerror}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        line = getattr(getattr(error, "problem_mark", None), "line", None)
        at = f", line {line + 1}" if line is not None else ""
        raise WorldError(f"{path}{at}: not valid YAML") from None


def _describe(error: ValidationError, values: Any) -> str:
    """Return the first problem in one line: where, what is wrong, what is allowed."""
    problem = error.errors(include_url=False)[0]
    where = _where(problem["loc"], values)
    kind, given = problem["type"], problem["input"]
    shapes = "box, cylinder or sphere"
    reasons = {
        "missing": "is missing",
        "extra_forbidden": "there is no such field",
        "union_tag_not_found": f"shape is missing; use {shapes}",
        "union_tag_invalid": f"shape must be {shapes}, not {problem.get('ctx', {}).get('tag', '')}",
        "string_pattern_mismatch": f"{given!r} should be a colour such as '#c04020'",
        "value_error": problem["msg"].removeprefix("Value error, "),
    }
    return f"{where}: {reasons.get(kind) or _short(given) + problem['msg'].removeprefix('Input')}"


def _where(location: tuple[int | str, ...], values: Any) -> str:
    """Return a path such as ``obstacles[2] 'ball' radius``."""
    match location:
        case ("obstacles", int(index), *rest):
            thing = values["obstacles"][index]
            name = thing.get("name") if isinstance(thing, dict) else None
            shapes: tuple[Shape, ...] = ("box", "cylinder", "sphere")
            fields = [str(part) for part in rest if part not in shapes]
            return " ".join([f"obstacles[{index}]", *([repr(name)] if name else []), *(".".join(fields),)]).rstrip()
        case ():
            return "obstacles" if isinstance(values, dict) else "world"
        case _:
            return ".".join(str(part) for part in location)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
