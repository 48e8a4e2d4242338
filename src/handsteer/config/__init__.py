"""Every parameter of handsteer: type, unit, range, default and a one-line description.

The YAML file, the command line and the settings of the page are generated from these models. Names are as in ROS nodes,
units are SI (REP 103), in brackets in each description.
"""

import logging
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from handsteer.config.driving import (
    PRESETS,
    CollisionMonitorConfig,
    ControlConfig,
    RobotConfig,
    RobotKind,
    assist_of,
)
from handsteer.config.recognition import (
    CameraConfig,
    JoyConfig,
    JoystickConfig,
    LandmarksConfig,
    Recorded,
    SignsConfig,
    VirtualHandConfig,
)
from handsteer.config.section import OptionalPath, Section, live
from handsteer.doors import PARAMETERS
from handsteer.errors import ConfigError, PluginError, as_name, did_you_mean, quoted
from handsteer.types import CmdVelType

__all__ = [
    "DEFAULT_FILE",
    "CameraConfig",
    "CollisionMonitorConfig",
    "Config",
    "ControlConfig",
    "DashboardConfig",
    "FoxgloveConfig",
    "JoyConfig",
    "JoystickConfig",
    "LandmarksConfig",
    "Recorded",
    "RecordingConfig",
    "RobotConfig",
    "RobotKind",
    "Section",
    "SignsConfig",
    "TeachConfig",
    "VirtualHandConfig",
    "assist_of",
    "checked",
    "cmd_vel_type",
    "describe",
    "live",
    "load",
    "validate",
]

log = logging.getLogger(__name__)

DEFAULT_FILE = Path("handsteer.yaml")
"""Read by ``handsteer run`` from the working directory, and saved to by the page, if no other file is named."""

S = TypeVar("S", bound=Section)
_LONGEST_SHOWN = 200


class TeachConfig(Section):
    """Teaching of signs on the page."""

    dataset: Path = Field(Path("signs.npz"), description="File to add takes to, as with `handsteer signs collect`")
    model: Path = Field(
        Path("my-signs.npz"),
        description="File to write the learnt signs to, as with `handsteer signs train`; signs.model overrides it",
    )
    takes: int = Field(5, ge=2, le=50, description="Number of takes of a sign")
    take_time: float = Field(3.0, ge=0.2, le=60, description="Duration of each take [s]")
    countdown: float = Field(3.0, ge=0, le=60, description="Countdown before each take [s]")


class RecordingConfig(Section):
    """Recordings that are started on the page, and the audit's log file."""

    folder: Path = Field(
        Path("recordings"), description="Folder of the recordings that are started on the page; created when needed"
    )
    audit_log: str = Field(
        "auto",
        min_length=1,
        description="File that `handsteer run` writes the audit to: auto is audit.log in the user's folder of logs, "
        "without --fast; off is none",
    )


class DashboardConfig(Section):
    """The web page."""

    host: str = Field(
        "127.0.0.1",
        min_length=1,
        description="Address that the page is served on; any other than 127.0.0.1 makes it reachable from other "
        "machines, which need the token in the printed address",
    )
    port: int = Field(8080, ge=0, le=65535, description="Port of the page; 0 picks a free one")
    certificate: OptionalPath = Field(
        None, description="PEM file with the certificate for https, without which browsers do not share a camera"
    )
    private_key: OptionalPath = Field(None, description="PEM file with its key, if not in the certificate's file")
    token: Literal["auto", "always"] = Field(
        "auto",
        description="When the page needs the token: auto if other machines can reach it, or always, for machines with "
        "several users",
    )
    open_browser: bool = Field(
        True,
        description="Whether run opens the page in a browser; never with token: always, as command lines are public",
    )

    @property
    def opens_browser(self) -> bool:
        """Whether to open the page in a browser; not with ``token: always``, because command lines are public."""
        return self.open_browser and self.token == "auto"


class FoxgloveConfig(Section):
    """Topics for Foxglove and PlotJuggler, by the Foxglove WebSocket protocol."""

    port: int = Field(
        -1, ge=-1, le=65535, description="Port on which `run` serves all topics; 0 picks a free one, -1 serves none"
    )
    host: str = Field(
        "127.0.0.1",
        min_length=1,
        description="Address that they are served on; any other than 127.0.0.1 makes them reachable from other "
        "machines, which need the token in the printed address",
    )
    token: Literal["auto", "always"] = Field(
        "auto",
        description="When a program needs the token: auto if other machines can reach the address or programs may "
        "drive, or always, for machines with several users and for viewers on other web sites",
    )
    drive: bool = Field(
        False,
        description="Whether these programs may drive, one at a time, by Twist on /cmd_vel, which needs the token; "
        "else they only look",
    )


class Config(Section):
    """All parameters, by section."""

    camera: CameraConfig = CameraConfig()
    virtual_hand: VirtualHandConfig = VirtualHandConfig()
    landmarks: LandmarksConfig = LandmarksConfig()
    signs: SignsConfig = SignsConfig()
    joystick: JoystickConfig = JoystickConfig()
    joy: JoyConfig = JoyConfig()
    control: ControlConfig = ControlConfig()
    collision_monitor: CollisionMonitorConfig = CollisionMonitorConfig()
    robot: RobotConfig = RobotConfig()
    teach: TeachConfig = TeachConfig()
    recording: RecordingConfig = RecordingConfig()
    dashboard: DashboardConfig = DashboardConfig()
    foxglove: FoxgloveConfig = FoxgloveConfig()

    def section(self, model: type[S]) -> S:
        """Return the section of a plug-in, by its ``model``.

        Raises:
            ConfigError: There is none; the plug-in is not installed.
        """
        for name in type(self).model_fields:
            found = getattr(self, name)
            if isinstance(found, model):
                return found
        raise ConfigError(f"no section of the configuration is a {model.__name__}: its plug-in is not installed")

    @model_validator(mode="after")
    def _monitors_one_robot(self) -> "Config":
        if self.uses_scans and self.control.robots:
            raise ValueError("control.assist should be off with control.robots: it is for one robot")
        return self

    @property
    def uses_scans(self) -> bool:
        """Whether the control looks at laser scans."""
        return assist_of(self.control, self.collision_monitor) != "off"


def load(path: Path | None = None, base: dict[str, Any] | None = None, *overrides: dict[str, Any]) -> Config:
    """Return the parameters from the defaults, ``base``, ``path`` and ``overrides``, each overriding the ones before.

    Args:
        path: A YAML file with some of the fields of :class:`Config`, or None; it overrides ``base``.
        base: Nested dictionary of fields, such as ``{"control": {"linear_step": 0.02}}``; overrides the defaults.
        overrides: Further dictionaries; they override the file.

    Raises:
        ConfigError: The file cannot be read, or a field is unknown or out of range; the message names it.
    """
    values: dict[str, Any] = {}
    of_file = _read_yaml(path) if path else {}
    for changes in (base or {}, of_file, *overrides):
        values = _merge(values, _with_new_names(changes))
    try:
        return Config.model_validate(_merge(_preset(values), values))
    except ValidationError as error:
        where = "" if path is None else _where(path, of_file, overrides, error)
        raise ConfigError(where + describe(error, Config)) from None


def _where(path: Path, of_file: dict[str, Any], overrides: Sequence[dict[str, Any]], error: ValidationError) -> str:
    """Return the file and the line of the first problem of ``error``; empty if it is not in the file."""
    from handsteer import plain_yaml  # noqa: PLC0415

    place = error.errors(include_url=False)[0]["loc"]
    if not _has(of_file, place) or any(_has(_with_new_names(changes), place) for changes in overrides):
        return ""
    line = plain_yaml.line_of(path, place)
    return f"{path}: " if line is None else f"{path}, line {line}: "


def _has(values: Any, place: tuple[str | int, ...]) -> bool:
    """Return whether there is a value at ``place`` in ``values``, which are nested dictionaries and lists."""
    for part in place:
        if isinstance(values, list):
            values = dict(enumerate(values))
        if not isinstance(values, dict) or part not in values:
            return False
        values = values[part]
    return bool(place)


def cmd_vel_type(config: Config) -> CmdVelType:
    """Return the message type for both ends of ``cmd_vel``: if only one has it configured, it applies to the other too.

    Raises:
        ConfigError: They are configured differently.
    """
    control, robot = config.control.cmd_vel_type, config.robot.cmd_vel_type
    if "auto" not in {control, robot} and control != robot:
        raise ConfigError(
            f"control.cmd_vel_type is {control} and robot.cmd_vel_type {robot}: "
            "they should be the same, or the robot receives no command"
        )
    return robot if control == "auto" else control


def validate(section: type[S], values: Any) -> S:
    """Return ``section`` built from ``values``.

    Raises:
        ConfigError: A field is unknown, of a wrong type or out of range.
    """
    try:
        return section.model_validate(values)
    except ValidationError as error:
        raise ConfigError(describe(error, section)) from None


def checked(config: object) -> Config:
    """Return ``config``; the defaults if None.

    Raises:
        ConfigError: It is something else, such as a dictionary.
    """
    if config is None:
        return Config()
    if not isinstance(config, Config):
        example = "Config(control=ControlConfig(max_linear=0.3))"
        raise ConfigError(f"{quoted(config)} is not a valid Config: give a Config, such as {example}")
    return config


def describe(error: ValidationError, section: type[Section] | None = None) -> str:
    """Return the first problem of ``error`` in one line: the field, the value, what is allowed.

    Args:
        error: What pydantic raised.
        section: The model that was validated, to find the nearest name of an unknown field.
    """
    problem = error.errors(include_url=False)[0]
    field = ".".join(as_name(part) for part in problem["loc"]) or "configuration"
    if problem["type"] == "extra_forbidden":
        known = _fields_beside(section, problem["loc"])
        return f"{field}: there is no such parameter{did_you_mean(str(problem['loc'][-1])[:_LONGEST_SHOWN], known)}"
    if problem["type"] == "model_type":
        return f"{field}: {quoted(problem['input'], _LONGEST_SHOWN)} should be parameters, each with its value"
    if problem["type"] == "tuple_type":
        return f"{field}: {quoted(problem['input'], _LONGEST_SHOWN)} should be a list, such as [a, b]"
    reason = problem["msg"].removeprefix("Input ").removeprefix("Value error, ")
    if problem["type"] == "literal_error":
        reason += did_you_mean(str(problem["input"])[:_LONGEST_SHOWN], re.findall(r"'([^']*)'", reason))
    return f"{field}: {quoted(problem['input'], _LONGEST_SHOWN)} {reason}"


def _fields_beside(section: type[Section] | None, place: tuple[str | int, ...]) -> list[str]:
    """Return the names that are allowed where an unknown one is, at ``place`` of ``section``; none if unknown."""
    model: Any = section
    for part in place[:-1]:
        field = model.model_fields.get(str(part)) if isinstance(model, type) and issubclass(model, Section) else None
        model = field.annotation if field else None
    return list(model.model_fields) if isinstance(model, type) and issubclass(model, Section) else []


def _preset(values: dict[str, Any]) -> dict[str, Any]:
    """Return the preset of the robot that ``values`` name; it overrides only the defaults. Validation comes later."""
    robot = values["robot"] if isinstance(values.get("robot"), dict) else {}
    name, kind = robot.get("preset") or None, robot.get("kind", "sim")
    if name is None and kind != "sim":
        name = "generic"
    return PRESETS.get(name, {}) if isinstance(name, str) else {}


def _read_yaml(path: Path) -> dict[str, Any]:
    # Imported late: programs without a file, such as those that only recognise signs, load faster.
    from handsteer import plain_yaml  # noqa: PLC0415

    values = plain_yaml.read(path, str(path), ConfigError, f"cannot read the configuration {path}")
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected sections such as 'control:' at the top, found {type(values).__name__}")
    return values


def _with_new_names(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of ``values`` with new names only, so that an old name in a later source takes effect."""
    models = {name: field.annotation for name, field in Config.model_fields.items()}
    return {
        name: models[name].by_new_names(of) if name in models else of  # type: ignore[union-attr]
        for name, of in values.items()
    }


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        merged[key] = _merge(below, value) if isinstance(value, dict) and isinstance(below, dict) else value
    return merged


def _add_sections() -> None:
    """Add the sections of plug-ins to :class:`Config`."""
    found = {}
    for name in PARAMETERS.names():
        try:
            model = PARAMETERS.load(name)
            found[name] = FieldInfo(annotation=model, default=model())
        except (PluginError, TypeError, ValueError) as error:  # it must not keep others from driving
            log.warning("the parameters %s are left out: %s", name, error)
    added = {name: field for name, field in found.items() if name not in Config.model_fields}
    if added:
        Config.model_fields.update(added)
        Config.model_rebuild(force=True)


# Last: the modules of plug-ins import this one.
_add_sections()
