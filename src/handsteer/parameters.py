"""A node's parameters by name, as a parameter service provides them at the start, and as others get and set them.

A node's own section is flat, others are nested by name: for ``hand_sign_recognition``, ``min_confidence`` is
``signs.min_confidence``, but ``landmarks.model`` keeps its name.
"""

import difflib
import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from handsteer.config import Config, Section, validate
from handsteer.errors import ConfigError

Value = bool | int | float | str | list[str]
Kind = Literal["bool", "integer", "double", "string", "strings"]

_KINDS: dict[Any, Kind] = {
    bool: "bool",
    int: "integer",
    float: "double",
    str: "string",
    Path: "string",
    tuple[str, ...]: "strings",
}
_VALUES: dict[Kind, tuple[tuple[type, ...], str]] = {
    "bool": ((bool,), "true or false"),
    "integer": ((int,), "a whole number"),
    "double": ((float, int), "a number"),
    "string": ((str,), "a text"),
    "strings": ((list,), "a list of texts"),
}
_USED_TOGETHER = {
    "camera": ("virtual_hand",),
    "signs": ("landmarks", "joystick"),
    "control": ("collision_monitor", "joy"),
}
_AT_START = "it is only read when the node starts"

log = logging.getLogger(__name__)


def from_parameters(parameters: Mapping[str, Any], section: str, node: str) -> dict[str, Any]:
    """Return ``parameters`` nested as in :class:`~handsteer.config.Config`.

    Unknown parameters are ignored, as in all of ROS, but logged with the nearest known name.

    Args:
        parameters: The node's private parameters, by name.
        section: The node's own section of the configuration.
        node: Full name of the node, for messages.

    Raises:
        ConfigError: A value is not allowed; the message has the parameter's full name.
    """
    values: dict[str, Any] = {}
    for given, value in parameters.items():
        name = section_model(section).new_name(given)
        if name in _fields(section):
            values.setdefault(section, {})[name] = _checked(section, name, value, f"{node}/{name}")
        elif name in Config.model_fields and isinstance(value, Mapping):
            for given_inner, of in value.items():
                inner = section_model(name).new_name(given_inner)
                if inner in _fields(name):
                    values.setdefault(name, {})[inner] = _checked(name, inner, of, f"{node}/{name}/{inner}")
                else:
                    _warn_unknown(
                        f"{node}/{name}/{inner}", inner, {field: f"{name}/{field}" for field in _fields(name)}
                    )
        else:
            _warn_unknown(f"{node}/{name}", name, _names(section))
    return values


def _names(section: str) -> dict[str, str]:
    """Return the accepted names, of a section and of those used with it, and the full name of each."""
    others = {f"{used}/{name}": f"{used}/{name}" for used in _USED_TOGETHER.get(section, ()) for name in _fields(used)}
    nested = {full.rpartition("/")[2]: full for full in others}
    return others | nested | {name: name for name in _fields(section)}


def _warn_unknown(full_name: str, name: str, known: Mapping[str, str]) -> None:
    near = difflib.get_close_matches(str(name), known, n=1)
    hint = f": did you mean {known[near[0]]}?" if near else ""
    log.warning("ignoring unknown ROS parameter %s%s", full_name, hint)


def _checked(section: str, name: str, value: Any, full_name: str) -> Any:
    try:
        validate(Config, {section: {name: value}})
    except ConfigError as error:
        # After its name there is a colon or, for a table, a dot and the entry; a problem of the section lacks the name.
        problem = f": {error}".removeprefix(f": {section}.{name}")
        raise ConfigError(f"ROS parameter {full_name}{problem}") from None
    return value


@dataclass(frozen=True)
class Description:
    """Description of a parameter.

    Attributes:
        kind: Type of the values.
        text: One line for people, with the unit.
        minimum: The lowest value, or an exclusive lower bound; None if there is none.
        maximum: The highest value; None if there is none.
        constraint: Further constraints of the values, in words; empty if there are none.
        choices: The allowed values; empty if others are allowed too.
        why_fixed: Why it cannot be set while the node runs; None if it can.
        removable: Whether it is an entry of a table that can be removed.
        is_path: Whether it names a file or folder.
    """

    kind: Kind
    text: str
    minimum: float | None = None
    maximum: float | None = None
    constraint: str = ""
    choices: tuple[str, ...] = ()
    why_fixed: str | None = None
    removable: bool = False
    is_path: bool = False


class NodeParameters:
    """The parameters of a running node, which others may get, and set if they can change while it runs.

    They are those of the node's own section and of the sections used with it. A parameter that is itself a table, such
    as ``actions``, has one name for each entry: ``actions.Peace``. May be used from any thread.

    Args:
        config: The node's initial configuration.
        section: The node's own section of the configuration.
        apply: Receives each new, valid configuration as a whole; returns at once.
        check: Raises ConfigError for problems of a new configuration that only the node can find, such as in a file
            that it names.
    """

    def __init__(
        self,
        config: Config,
        section: str,
        apply: Callable[[Config], None],
        check: Callable[[Config], None] = lambda _: None,
    ) -> None:
        self._config = config
        self._check = check
        self._section = section
        self._sections = (section, *_USED_TOGETHER.get(section, ()))
        self._apply = apply
        self._fixed: dict[str, tuple[Value, Description]] = {}
        self._lock = threading.RLock()

    def add_fixed(self, name: str, value: bool, text: str) -> None:
        """Add a parameter that is not in the configuration, and was read at the start."""
        self._fixed[name] = (value, Description("bool", text, why_fixed=_AT_START))

    def values(self) -> dict[str, Value]:
        """Return all values by name, own ones first."""
        with self._lock:
            config = self._config
            found = {name: value for section in self._sections for name, value in self._entries(config, section)}
        return found | {name: value for name, (value, _) in self._fixed.items()}

    def describe(self, name: str) -> Description | None:
        """Return the description of the parameter of this name; None if there is none."""
        if name in self._fixed:
            return self._fixed[name][1]
        place = self._place(name)
        if place is None or (place.entry is not None and name not in self.values()):
            return None
        return replace(describe(place.model, place.field), removable=place.entry is not None)

    def new_name(self, name: str) -> str:
        """Return the declared name of the parameter that ``name`` means, which may be an old one."""
        place = self._place(name)
        if place is None:
            return name
        inside = () if place.section == self._section else (place.section,)
        return ".".join((*inside, place.field, *((place.entry,) if place.entry else ())))

    def set(self, changes: Mapping[str, Value | None]) -> None:
        """Set parameters, all of them or none; None removes an entry of a table.

        Setting any parameter to its current value is accepted. A file that is named again is read again.

        Raises:
            ConfigError: A name is unknown, a value is not allowed, or a parameter cannot change while the node runs;
                the message names it.
        """
        with self._lock:
            now = self.values()
            wanted = {name: value for name, value in changes.items() if not self._is_already(name, value, now)}
            if not wanted and not any(self._names_file(name) for name in changes):
                return
            nested = self._config.model_dump()
            for name, value in wanted.items():
                self._put(nested, name, value)
            try:
                config = validate(Config, nested)
                self._check(config)
            except ConfigError as error:
                raise ConfigError(str(error).removeprefix(f"{self._section}.")) from None
            self._config = config
            self._apply(config)

    def _is_already(self, name: str, value: Value | None, now: Mapping[str, Value]) -> bool:
        """Return whether a parameter has this value, also as converted by tools that read YAML: false for "off"."""
        place = self._place(name)
        if name not in now or now[name] == value or place is None or place.entry is not None or value is None:
            return name in now and now[name] == value
        try:
            config = validate(Config, {place.section: {place.field: value}})
        except ConfigError:
            return False
        return bool(plain(getattr(getattr(config, place.section), place.field)) == now[name])

    def _entries(self, config: Config, section: str) -> list[tuple[str, Value]]:
        prefix = "" if section == self._section else f"{section}."
        found: list[tuple[str, Value]] = []
        for field, value in getattr(config, section):
            if isinstance(value, dict):
                found += [(f"{prefix}{field}.{entry}", of) for entry, of in value.items()]
            else:
                found.append((f"{prefix}{field}", "" if value is None else plain(value)))
        return found

    def _put(self, nested: dict[str, Any], name: str, value: Value | None) -> None:
        place = self._place(name)
        if name in self._fixed or (place is not None and place.field not in place.model.live):
            raise ConfigError(f"{name} cannot be set: {_AT_START}")
        if place is None:
            raise ConfigError(f"{name}: there is no such parameter; the parameters are {', '.join(self.values())}")
        table = nested[place.section]
        key = place.field
        if place.entry is not None:
            table, key = table[place.field], place.entry
        if value is None and place.entry is None:
            raise ConfigError(f"{name} cannot be removed, only set to another value")
        if value is None:
            table.pop(key, None)
            return
        kind = describe(place.model, place.field).kind
        types, words = _VALUES[kind]
        if not isinstance(value, types) or (isinstance(value, bool) and kind != "bool"):
            raise ConfigError(f"{name}: {value!r} should be {words}")
        table[key] = value

    def _names_file(self, name: str) -> bool:
        place = self._place(name)
        annotation = place.model.model_fields[place.field].annotation if place else None
        return place is not None and _without_none(annotation) is Path and place.field in place.model.live

    def _place(self, name: str) -> "_Place | None":
        section, rest = self._section, name
        own = section_model(section)
        if name.partition(".")[0] not in {*own.model_fields, *own.renamed}:
            section, _, rest = name.partition(".")
            # The own section is not a prefix: a value set by a second name would not be reported by the first.
            if section not in _USED_TOGETHER.get(self._section, ()):
                return None
        model = section_model(section)
        field, _, entry = rest.partition(".")
        field = model.renamed.get(field, field)
        if field not in model.model_fields or _is_table(model, field) != bool(entry):
            return None
        return _Place(section, model, field, entry or None)


@dataclass(frozen=True)
class _Place:
    """Place of a parameter in the configuration; ``entry`` is its key if the field is a table."""

    section: str
    model: type[Section]
    field: str
    entry: str | None


def section_model(section: str) -> type[Section]:
    """Return the model of a section of the configuration."""
    model = Config.model_fields[section].annotation
    assert isinstance(model, type)
    assert issubclass(model, Section)
    return model


def _fields(section: str) -> list[str]:
    return list(section_model(section).model_fields)


def _is_table(model: type[Section], field: str) -> bool:
    return get_origin(model.model_fields[field].annotation) is dict


def plain(value: Any) -> Any:
    """Return ``value`` as in YAML and parameter services: a path as its text, a tuple as a list."""
    return str(value) if isinstance(value, Path) else list(value) if isinstance(value, tuple) else value


def describe(model: type[Section], name: str) -> Description:
    """Return the description of the parameter ``name`` of a section; of a table, that of its values."""
    field = model.model_fields[name]
    of = _without_none(get_args(field.annotation)[1] if _is_table(model, name) else field.annotation)
    choices = get_args(of) if get_origin(of) is Literal else ()
    kind = "string" if choices else _KINDS[of]
    above = _bound(field, "gt")
    lowest = above if above is not None else _bound(field, "ge")
    constraint = f"one of {', '.join(choices)}" if choices else f"above {above:g}" if above is not None else ""
    fixed = None if name in model.live else _AT_START
    bounds = (lowest, _bound(field, "le"))
    return Description(kind, field.description or "", *bounds, constraint, choices, fixed, is_path=of is Path)


def _without_none(annotation: Any) -> Any:
    """Return the type in an optional ``annotation``."""
    parts = [part for part in get_args(annotation) if part is not NoneType]
    return parts[0] if NoneType in get_args(annotation) else annotation


def _bound(field: FieldInfo, sign: str) -> float | None:
    return next((bound for limit in field.metadata if (bound := getattr(limit, sign, None)) is not None), None)
