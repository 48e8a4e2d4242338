"""The plan of a study as a YAML file: the ways of driving to compare, the courses, the laps, and what is asked.

::

    participants: 12
    conditions:
      - {name: signs, instructions: Drive with your hand signs.}
      - {name: pad, input: pad, instructions: Drive with the pad.}
    courses: [slalom]
    practice_laps: 1
    laps: 3
    lap_limit: 120
    forms: [tlx, sus]
"""

import hashlib
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError

from handsteer import config, plain_yaml
from handsteer.config import Config, Section
from handsteer.errors import ConfigError, StudyError, WorldError
from handsteer.robots.world import World, describe_problem, load_world, write_world
from handsteer.types import GO, MOTION_SIGNS

NOT_OF_A_LAP: Final[Mapping[str, bool | Mapping[str, bool]]] = {
    "dashboard": True,
    "teach": True,
    "robot": {"world": True},
}
"""Parameters that have no effect on a lap; its course is elsewhere."""

Input = Literal["hand", "pad", "keys", "sliders", "gamepad", "tilt"]
"""What a participant drives with: the hand, or one of the page's inputs for manual steering."""

FormName = Literal["tlx", "sus"]

Name = TypeVar("Name", bound=str)

_MOST_PARTICIPANTS = 1000
_LONGEST_PATH = 200
_FEWEST_GATES = 2
_HASH_DIGITS = 12

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}")
# Names are written to the results: a spreadsheet would take one that starts with = or + for a formula.
_NAME = re.compile(r"\w[\w .,:()/+-]{0,59}")


def _is_id(name: str) -> str:
    if not _ID.fullmatch(name):
        raise ValueError(f"{name[:40]!r} should be an id such as P01, of letters, digits, _ and -, not a name")
    return name


def _is_name(name: str) -> str:
    if not _NAME.fullmatch(name) or not name.isprintable():
        raise ValueError(
            f"{name[:60]!r} should begin with a letter, and have up to 60 letters, digits, spaces or .,:()/+-_"
        )
    return name


def _is_printable(name: str) -> str:
    if not name or len(name) > _LONGEST_PATH or not name.isprintable():
        raise ValueError(f"{name[:60]!r} should be the name of a world, or of a YAML file")
    return name


def _are_some(names: tuple[Name, ...], least: int = 1, most: int = 12) -> tuple[Name, ...]:
    twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        raise ValueError(f"should have each value once; {twice!r} is there twice")
    if not least <= len(names) <= most:
        raise ValueError(f"should have {least} to {most} values, not {len(names)}")
    return names


def _have_names(conditions: "tuple[Condition, ...]") -> "tuple[Condition, ...]":
    _are_some(tuple(each.name for each in conditions))
    return conditions


def _people(given: object) -> object:
    """Return the ids of a number of participants; a list of ids as it is."""
    if isinstance(given, bool) or not isinstance(given, int | list | tuple):
        raise ValueError("should be a number of people, or a list of ids such as [P01, P02]")
    if isinstance(given, int):
        if not 1 <= given <= _MOST_PARTICIPANTS:
            raise ValueError(f"{given} should be 1 to {_MOST_PARTICIPANTS} people")
        return tuple(f"P{number:02d}" for number in range(1, given + 1))
    return given


Text = Annotated[str, Field(max_length=4000)]
Id = Annotated[str, AfterValidator(_is_id)]
Course = Annotated[str, AfterValidator(_is_printable)]


class Condition(Section):
    """One way of driving, which is compared with the others."""

    name: Annotated[str, AfterValidator(_is_name)] = Field(description="Its name in the results")
    instructions: Text = Field("", description="Shown to the participant; plain text")
    input: Input = Field("hand", description="The only input that drives")
    config: dict[str, Any] = Field({}, description="Parameters that can change while nodes run, by section")


class Plan(Section):
    """A study: each participant drives all courses under all conditions, in an order of their own."""

    title: str = Field("Driving study", min_length=1, max_length=100, description="Heading of the page")
    welcome: Text = Field(
        "You will drive a simulated robot in several ways. You may stop at any time. Your name is not asked.",
        description="Shown first; the participant agrees to it",
    )
    thanks: Text = Field("That was all. Thank you!", description="Shown at the end")
    participants: Annotated[
        tuple[Id, ...], BeforeValidator(_people), AfterValidator(partial(_are_some, most=_MOST_PARTICIPANTS))
    ] = Field(description="Their number, or a list of ids, never of names")
    conditions: Annotated[tuple[Condition, ...], AfterValidator(_have_names)] = Field(description="What is compared")
    courses: Annotated[tuple[Course, ...], AfterValidator(_are_some)] = Field(
        description="Shipped worlds with gates, or YAML files next to the plan"
    )
    practice_laps: int = Field(1, ge=0, le=50, description="On each course and under each condition, before the laps")
    laps: int = Field(3, ge=1, le=50, description="Measured laps on each course and under each condition")
    lap_limit: float = Field(120.0, ge=5, le=3600, description="A lap, and the wait for its start, ends after this [s]")
    forms: Annotated[tuple[FormName, ...], AfterValidator(partial(_are_some, least=0))] = Field(
        ("tlx", "sus"), description="Filled in after each condition: NASA-TLX, System Usability Scale"
    )
    config: dict[str, Any] = Field({}, description="Parameters of all conditions, by section")

    def condition(self, name: str) -> Condition:
        """Return the condition of this name."""
        return next(each for each in self.conditions if each.name == name)


def read_plan(path: Path) -> Plan:
    """Return the plan in the YAML file at ``path``.

    Raises:
        StudyError: The file cannot be read, or a field in it is wrong; the message names the file and the field.
    """
    values = plain_yaml.read(path, str(path), StudyError, f"cannot read the plan {path}")
    if not isinstance(values, dict):
        raise StudyError(f"{path}: expected fields such as 'participants:' at the top")
    try:
        return Plan.model_validate(values)
    except ValidationError as error:
        raise StudyError(f"{path}: {describe_problem(error, values)}") from None


def course_file(name: str, path: Path) -> str:
    """Return the world of the course ``name`` in the plan at ``path``: the name of a shipped one, or a file."""
    file = path.parent / name
    return str(file) if file.suffix in (".yaml", ".yml") else name


def load_courses(plan: Plan, path: Path) -> dict[str, World]:
    """Return the worlds of the plan at ``path`` by their names in it; those of files are relative to the plan.

    Raises:
        StudyError: A world cannot be read, or has no gates to drive through.
    """
    worlds: dict[str, World] = {}
    for name in plan.courses:
        try:
            worlds[name] = load_world(course_file(name, path))
        except WorldError as error:
            raise StudyError(f"{path}: courses: {error}") from None
        gates = len(worlds[name].gates)
        if gates < _FEWEST_GATES:
            raise StudyError(
                f"{path}: courses: {name} has {gates} gates; a lap needs a start and a finish, as in slalom"
            )
    return worlds


def load_configs(plan: Plan, path: Path, base: dict[str, Any]) -> dict[str, Config]:
    """Return the configuration of each condition by its name.

    Args:
        plan: The plan; its parameters override ``base``, those of a condition override both.
        path: Its file, for messages.
        base: Parameters from elsewhere, nested by section.

    Raises:
        StudyError: A parameter is unknown or out of range, or differs between conditions although it cannot change
            while nodes run, or the robot is not simulated; the message names it.
    """
    configs = {each.name: _config_of(plan, each, path, base) for each in plan.conditions}
    first = configs[plan.conditions[0].name]
    if first.robot.kind != "sim":
        raise StudyError(f"{path}: robot.kind is {first.robot.kind}; a study needs sim, whose world has gates")
    for name, each in configs.items():
        if fixed := _fixed_difference(first, each):
            raise StudyError(
                f"{path}: {fixed} differs between {plan.conditions[0].name!r} and {name!r}, but is read at the start "
                "only: set it for all conditions, in the plan's own config"
            )
    return configs


def _config_of(plan: Plan, condition: Condition, path: Path, base: dict[str, Any]) -> Config:
    try:
        loaded = config.load(None, base, plan.config, condition.config)
    except ConfigError as error:
        raise StudyError(f"{path}: config of {condition.name!r}: {error}") from None
    if condition.input == "hand":
        return loaded
    # No hand moves the robot where another input is studied, although one may be in the picture.
    idle = {"mode": "signs", "actions": dict.fromkeys((*sorted(MOTION_SIGNS), GO), "stop")}
    return loaded.model_copy(update={"control": loaded.control.model_copy(update=idle)})


def _fixed_difference(one: Config, other: Config) -> str | None:
    for section in Config.model_fields:
        ours, theirs = getattr(one, section), getattr(other, section)
        for name in type(ours).model_fields:
            if name not in ours.live and getattr(ours, name) != getattr(theirs, name):
                return f"{section}.{name}"
    return None


def config_hash(of: Config) -> str:
    """Return 12 hexadecimal digits that identify the parameters that may affect a lap."""
    return _hash(of.model_dump_json(exclude=NOT_OF_A_LAP))


def plan_hash(plan: Plan, courses: dict[str, World]) -> str:
    """Return 12 hexadecimal digits that identify what decides the order of steps and what they are.

    Participants may be added, and texts corrected, during a study.
    """
    kept = plan.model_dump_json(exclude={"title", "welcome", "thanks", "participants"})
    return _hash(kept + "".join(write_world(world) for world in courses.values()))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_HASH_DIGITS]
