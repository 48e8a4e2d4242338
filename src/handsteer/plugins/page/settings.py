"""The parameters on the page: those running, those wanted at the next start, and those in the file."""

import os
import re
import threading
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from handsteer import plain_yaml
from handsteer.config import DEFAULT_FILE, Config, cmd_vel_type, load
from handsteer.errors import ConfigError, HandsteerError
from handsteer.parameters import plain
from handsteer.plain_yaml import LARGEST_BYTES
from handsteer.plugins.page.settings_fields import FIELDS, FORM, Field
from handsteer.plugins.virtual_hand.script import parse_script
from handsteer.regular_files import mode_of, read_regular, replacing
from handsteer.robots.world import load_world

_COMMENT = re.compile(r"(^|\s)#", re.MULTILINE)

# These select the defaults of other fields.
_ROBOT = (FIELDS["robot.kind"], FIELDS["robot.preset"])

Values = Mapping[Field, Any]
"""Some parameters."""


class Settings:
    """The parameters of a graph; thread-safe.

    Live parameters are applied to the nodes immediately; the others are stored for the file and the next start.

    Args:
        running: Returns the nodes' configuration.
        apply: Applies live parameters to the nodes.
        file: The file that settings are saved to.
        on_save: Called with what was done, once the settings are saved.

    Attributes:
        wanted: The parameters in the form: those of the next start, once saved.
        revision: Counts changes and saves.
    """

    def __init__(
        self,
        running: Callable[[], Config],
        apply: Callable[[Config], None],
        file: "SettingsFile",
        on_save: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.file = file
        self._on_save = on_save
        self.revision = 0
        self._running = running
        self._apply = apply
        self._followed = running()
        self._set(self._followed)
        self._saved = file.load() if file.is_read else Config()
        self._lock = threading.RLock()

    @property
    def running(self) -> Config:
        """The nodes' configuration."""
        return self._running()

    @property
    def is_saved(self) -> bool:
        """Whether the file contains the wanted parameters."""
        return self.wanted == self._saved

    def follow(self) -> None:
        """Adopt changes that others made to the running parameters."""
        with self._lock:
            running = self._running()
            if running is not self._followed:
                different = _differences(running, self._followed)
                self._followed = running
                if different:
                    self._set(loaded({**self._changed, **different}))

    def is_changed(self, field: Field) -> bool:
        """Return whether the wanted value differs from the default."""
        return field in self._changed

    def waits(self, field: Field) -> bool:
        """Return whether the wanted value takes effect only at the next start."""
        return bool(field.value_in(self.wanted) != field.value_in(self._running()))

    def default(self, field: Field) -> Any:
        """Return the default value, which may depend on the selected robot."""
        return field.value_in(Config() if field in _ROBOT else self._defaults)

    def set(self, field: Field, text: str) -> None:
        """Set a parameter to the value of ``text``.

        Raises:
            ConfigError: It is invalid, out of range, or conflicts with another parameter.
        """
        with self._lock:
            self.follow()
            value = field.parse(text, field.value_in(self.wanted))
            self._change({**self._changed, field: value}, [field])

    def reset(self, *fields: Field) -> None:
        """Set these parameters to their defaults.

        Raises:
            ConfigError: The defaults conflict with parameters that are not reset.
        """
        with self._lock:
            self.follow()
            self._change({each: value for each, value in self._changed.items() if each not in fields}, fields)

    def save(self) -> str:
        """Write the parameters that differ from the defaults to the file; return a sentence on what was done.

        Raises:
            ConfigError: The file has changed since it was read, or cannot be written.
        """
        with self._lock:
            self.follow()
            done = self.file.save(nested(self._changed))
            self._saved = self.wanted
            self.revision += 1
            self._on_save(done)
            return done

    def keep(self, values: Values) -> str:
        """Write these values to the file, and change nothing else in it; return a sentence on what was done.

        The file need not have been read before. Running and wanted parameters stay.

        Raises:
            ConfigError: The file cannot be read or written, or is invalid, or would be with these values.
        """
        with self._lock:
            file = SettingsFile(self.file.path, is_read=self.file.path.exists())
            before = changed(file.load()) if file.is_read else {}
            config = loaded({**before, **values})
            is_current = self.file.is_current
            done = file.save(nested(changed(config)))
            if is_current:
                self.file.load()
                self._saved = config
            self.revision += 1
            self._on_save(done)
            return done

    def in_file(self, field: Field) -> Any:
        """Return the value in the file, or its default.

        Raises:
            ConfigError: The file cannot be read, or is invalid.
        """
        path = self.file.path
        return field.value_in(SettingsFile(path, is_read=True).load() if path.exists() else Config())

    def load(self) -> None:
        """Adopt the parameters in the file as the wanted ones.

        Raises:
            ConfigError: The file cannot be read, or is invalid.
        """
        with self._lock:
            self.follow()
            config = self.file.load()
            self._change(changed(config), _differences(config, self.wanted))
            self._saved = self.wanted

    def _set(self, wanted: Config) -> None:
        self.wanted = wanted
        self._changed = changed(wanted)
        self._defaults = defaults(wanted)
        self.revision += 1

    def _change(self, values: Values, edited: Iterable[Field]) -> None:
        wanted = loaded(values)
        _check(wanted, edited)
        running = applied = self._running()
        # Another robot's defaults apply from the next start on, like that robot.
        base = defaults(running)
        for field in edited:
            value = field.value_in(wanted if field in values else base)
            if field.live and value != field.value_in(running):
                section = getattr(applied, field.section).model_copy(update={field.name: value})
                applied = applied.model_copy(update={field.section: section})
        if applied is not running:
            self._apply(applied)
            self._followed = applied
        self._set(wanted)


def nested(values: Values) -> dict[str, dict[str, Any]]:
    """Return ``values`` as in a configuration file, in its order."""
    sections = {
        section: {each.name: plain(values[each]) for each in of if each in values} for section, of in FORM.items()
    }
    return {section: content for section, content in sections.items() if content}


def loaded(values: Values) -> Config:
    """Return the configuration of ``values`` and defaults.

    Raises:
        ConfigError: Values are invalid.
    """
    return load(None, None, nested(values))


def changed(config: Config) -> Values:
    """Return the differences from the defaults; loading them gives ``config`` again."""
    return _differences(config, Config(), _ROBOT) | _differences(config, defaults(config))


def defaults(config: Config) -> Config:
    """Return the defaults for the robot of ``config``: its preset overrides those of the models."""
    return loaded(_differences(config, Config(), _ROBOT))


def _differences(config: Config, other: Config, fields: Iterable[Field] = tuple(FIELDS.values())) -> dict[Field, Any]:
    return {each: each.value_in(config) for each in fields if each.value_in(config) != each.value_in(other)}


def _check(config: Config, edited: Iterable[Field]) -> None:
    """Raise ConfigError for values that the next start would reject."""
    cmd_vel_type(config)
    if config.dashboard.private_key is not None and config.dashboard.certificate is None:
        raise ConfigError("dashboard.private_key: is of no use without dashboard.certificate: give that first")
    for field in edited:
        try:
            if field.path == "control.robots" and config.control.robots:
                raise ConfigError("is for `handsteer control`: a run drives one robot")
            if field.path == "robot.world":
                load_world(config.robot.world)
            if field.path == "virtual_hand.script":
                parse_script(config.virtual_hand.script)
        except HandsteerError as error:
            raise ConfigError(f"{field.path}: {error}") from None


class SettingsFile:
    """The YAML file that settings are saved to, atomically and without overwriting changes of others.

    Args:
        path: The file.
        is_read: Whether the parameters in use were read from it. Otherwise it must not exist, or be loaded, before it
            is saved to.
    """

    def __init__(self, path: Path, *, is_read: bool) -> None:
        self.path = path.absolute()
        self._known = self._content() if is_read else None

    @property
    def start_command(self) -> str:
        """The command that starts with its parameters."""
        return "handsteer run" if self.path == DEFAULT_FILE.absolute() else f"handsteer run --config {self.path}"

    @property
    def is_read(self) -> bool:
        """Whether its parameters were read or saved."""
        return self._known is not None

    @property
    def is_current(self) -> bool:
        """Whether nothing in the file is unknown: it is as it was read or saved, or does not exist."""
        content = self._content()
        return content is None or content == self._known

    def load(self) -> Config:
        """Return the parameters in the file, with defaults for the rest.

        Raises:
            ConfigError: It cannot be read, or a field is unknown or out of range.
        """
        content = self._content()
        config = load(self.path)
        self._known = content
        return config

    def save(self, values: Mapping[str, Any]) -> str:
        """Write ``values``, nested as in :class:`~handsteer.config.Config`, and return a sentence on what was done.

        Comments are lost; in that case the old file is stored with the suffix ``.bak``.

        Raises:
            ConfigError: The file has changed since it was read, or cannot be written.
        """
        old = self._content()
        if old is not None and old != self._known:
            happened = "was changed by another program" if self._known is not None else "exists, and was not read"
            raise ConfigError(f"{self.path.name} {happened}: load it first, which brings back what it says")
        new = yaml.safe_dump(_in_order_of(old, values), sort_keys=False, allow_unicode=True) if values else ""
        done = f"saved to {self.path.name}"
        try:
            if old is not None and _COMMENT.search(old.decode(errors="replace")):
                backup = self.path.with_name(f"{self.path.name}.bak")
                self._write(backup, old)
                done = f"{done}; the old one, with its comments, is {backup.name}"
            self._write(self.path, new.encode())
        except OSError as error:
            raise ConfigError(f"cannot write {self.path}: {error.strerror}") from None
        self._known = new.encode()
        return done

    def _content(self) -> bytes | None:
        try:
            return read_regular(self.path, LARGEST_BYTES)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise ConfigError(f"cannot read {self.path}: {error.strerror}") from None

    def _write(self, path: Path, content: bytes) -> None:
        path = path.resolve()  # a symbolic link stays one
        # Camera addresses may contain passwords: only the owner may read a new file.
        with replacing(path, mode_of(path, mode_of(self.path, 0o600))) as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())


def _in_order_of(old: bytes | None, values: Mapping[str, Any]) -> Any:
    """Return ``values`` with sections and fields in the order of the old file, new ones last."""
    try:
        return _sorted(values, plain_yaml.parse(old or b"", "", ConfigError))
    except ConfigError:
        return values


def _sorted(values: Any, order: Any) -> Any:
    if not isinstance(values, Mapping):
        return values
    before = order if isinstance(order, dict) else {}
    keys = [*(key for key in before if key in values), *(key for key in values if key not in before)]
    return {key: _sorted(values[key], before.get(key)) for key in keys}
