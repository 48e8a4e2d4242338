"""The parameters on the page: those running, those wanted at the next start, and those in the file."""

import threading
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

from handsteer.config import Config, cmd_vel_type, load
from handsteer.dashboard.settings_file import SettingsFile
from handsteer.dashboard.settings_form import FormField, form
from handsteer.errors import ConfigError, HandsteerError
from handsteer.hand.script import parse_script
from handsteer.parameters import plain
from handsteer.robots.world import load_world

FORM: Mapping[str, tuple[FormField, ...]] = MappingProxyType(form())
FIELDS: Mapping[str, FormField] = MappingProxyType({field.path: field for part in FORM.values() for field in part})
"""All fields by full name."""

# These select the defaults of other fields.
_ROBOT = (FIELDS["robot.kind"], FIELDS["robot.preset"])


class Settings:
    """The parameters of a graph; thread-safe.

    Live parameters are applied to the nodes immediately; the others are kept for the file and the next start.

    Args:
        running: Returns the nodes' configuration.
        apply: Applies live parameters to the nodes.
        file: The file that settings are saved to.

    Attributes:
        file: The file that settings are saved to.
        wanted: The parameters in the form: those of the next start, once saved.
        revision: Counts changes and saves.
    """

    def __init__(self, running: Callable[[], Config], apply: Callable[[Config], None], file: SettingsFile) -> None:
        self.file = file
        self.revision = 0
        self._running = running
        self._note(running())
        self._apply = apply
        self._followed = self.wanted
        self._saved = file.load() if file.is_read else Config()
        self._lock = threading.RLock()

    @property
    def is_saved(self) -> bool:
        """Whether the file contains the wanted parameters."""
        return self.wanted == self._saved

    def follow(self) -> None:
        """Adopt changes that others made to the running parameters."""
        with self._lock:
            running = self._running()
            if running is self._followed:
                return
            different = [
                field for field in FIELDS.values() if field.value_in(running) != field.value_in(self._followed)
            ]
            self._followed = running
            if different:
                values = _with(self._changed, {field: field.value_in(running) for field in different})
                self._note(load(None, None, values))

    def is_changed(self, field: FormField) -> bool:
        """Return whether the wanted value differs from the default."""
        return field.name in self._changed.get(field.section, {})

    def waits(self, field: FormField) -> bool:
        """Return whether the wanted value takes effect only at the next start."""
        return bool(field.value_in(self.wanted) != field.value_in(self._running()))

    def default(self, field: FormField) -> Any:
        """Return the default value, which may depend on the selected robot."""
        return field.value_in(self._defaults)

    def set(self, field: FormField, text: str) -> None:
        """Set a parameter to the value of ``text``.

        Raises:
            ConfigError: It is invalid, out of range, or conflicts with another parameter.
        """
        with self._lock:
            self.follow()
            value = field.parse(text, field.value_in(self.wanted))
            self._want(_with(self._changed, {field: value}), [field])

    def reset(self, *fields: FormField) -> None:
        """Set these parameters to their defaults.

        Raises:
            ConfigError: The defaults conflict with parameters that are not reset.
        """
        with self._lock:
            self.follow()
            self._want(_without(self._changed, fields), fields)

    def save(self) -> str:
        """Write the parameters that differ from the defaults to the file; return a sentence on what was done.

        Raises:
            ConfigError: The file has changed since it was read, or cannot be written.
        """
        with self._lock:
            self.follow()
            said = self.file.save(self._changed)
            self._saved = self.wanted
            self.revision += 1
            return said

    def load(self) -> None:
        """Adopt the parameters in the file as the wanted ones.

        Raises:
            ConfigError: The file cannot be read, or is invalid.
        """
        with self._lock:
            self.follow()
            config = self.file.load()
            before = self.wanted
            different = [field for field in FIELDS.values() if field.value_in(config) != field.value_in(before)]
            self._want(changed(config), different)
            self._saved = self.wanted

    def _note(self, wanted: Config) -> None:
        self.wanted = wanted
        self._changed = changed(wanted)
        self._defaults = defaults(wanted)
        self.revision += 1

    def _want(self, values: dict[str, dict[str, Any]], edited: Iterable[FormField]) -> None:
        edited = tuple(edited)
        wanted = load(None, None, values)
        _check(wanted, edited)
        running = self._running()
        # Another robot's defaults apply from the next start on, like that robot.
        base = defaults(running)
        fresh = {
            field: field.value_in(wanted if field.name in values.get(field.section, {}) else base)
            for field in edited
            if field.live
        }
        changing = {field: value for field, value in fresh.items() if value != field.value_in(running)}
        if changing:
            applied = _updated(running, changing)
            self._apply(applied)
            self._followed = applied
        self._note(wanted)


def defaults(config: Config) -> Config:
    """Return the defaults for the robot of ``config``: its preset overrides those of the models."""
    return load(None, None, _of_robot(config))


def changed(config: Config) -> dict[str, dict[str, Any]]:
    """Return the differences from the defaults as plain values; loading them gives ``config`` again."""
    values = _of_robot(config)
    while True:
        reached = load(None, None, values)
        missing = [field for field in FIELDS.values() if field.value_in(reached) != field.value_in(config)]
        if not missing:
            return _ordered(values)
        values = _with(values, {field: field.value_in(config) for field in missing})


def _of_robot(config: Config) -> dict[str, dict[str, Any]]:
    named = [field for field in _ROBOT if field.value_in(config) != field.value_in(Config())]
    return _with({}, {field: field.value_in(config) for field in named})


def _check(config: Config, edited: Iterable[FormField]) -> None:
    """Raise ConfigError for values that the next start would reject."""
    cmd_vel_type(config)
    if config.dashboard.private_key is not None and config.dashboard.certificate is None:
        raise ConfigError("dashboard.private_key: is of no use without dashboard.certificate: give that first")
    for field in edited:
        try:
            _CHECKS.get(field.path, _nothing)(config)
        except HandsteerError as error:
            raise ConfigError(f"{field.path}: {error}") from None


def _nothing(_config: Config) -> None:
    pass


def _no_fleet(config: Config) -> None:
    if config.control.robots:
        raise ConfigError("is for `handsteer control`: a run drives one robot")


_CHECKS: Mapping[str, Callable[[Config], object]] = MappingProxyType(
    {
        "control.robots": _no_fleet,
        "robot.world": lambda config: load_world(config.robot.world),
        "virtual_hand.script": lambda config: parse_script(config.virtual_hand.script),
    }
)


def _with(values: Mapping[str, Mapping[str, Any]], fresh: Mapping[FormField, Any]) -> dict[str, dict[str, Any]]:
    merged = {section: dict(of) for section, of in values.items()}
    for field, value in fresh.items():
        merged.setdefault(field.section, {})[field.name] = plain(value)
    return merged


def _without(values: Mapping[str, Mapping[str, Any]], fields: Iterable[FormField]) -> dict[str, dict[str, Any]]:
    gone = {field.path for field in fields}
    kept = {
        section: {name: value for name, value in of.items() if f"{section}.{name}" not in gone}
        for section, of in values.items()
    }
    return {section: of for section, of in kept.items() if of}


def _ordered(values: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return ``values`` in the order of the configuration."""
    return {
        section: {field.name: values[section][field.name] for field in fields if field.name in values[section]}
        for section, fields in FORM.items()
        if section in values
    }


def _updated(config: Config, fresh: Mapping[FormField, Any]) -> Config:
    sections = {field.section for field in fresh}
    updates = {
        section: getattr(config, section).model_copy(
            update={field.name: value for field, value in fresh.items() if field.section == section}
        )
        for section in sections
    }
    return config.model_copy(update=updates)
