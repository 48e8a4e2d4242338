"""The YAML file that settings are saved to, atomically and without overwriting changes of others."""

import os
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from handsteer import plain_yaml
from handsteer.config import Config, load
from handsteer.errors import ConfigError

DEFAULT_FILE = Path("handsteer.yaml")
"""Default file for settings, in the working directory."""

_COMMENT = re.compile(r"(^|\s)#", re.MULTILINE)


class SettingsFile:
    """A file with parameters, as for ``--config``.

    Args:
        path: The file.
        is_read: Whether the parameters in use were read from it. Otherwise it must not exist, or be loaded, before it
            is saved to.
    """

    def __init__(self, path: Path, *, is_read: bool) -> None:
        self.path = path.absolute()
        self._known = self._content() if is_read else None

    @property
    def is_read(self) -> bool:
        """Whether its parameters were read or saved."""
        return self._known is not None

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

        Comments are lost; in that case the old file is kept with the suffix ``.bak``.

        Raises:
            ConfigError: The file has changed since it was read, or cannot be written.
        """
        old = self._content()
        if old != self._known:
            happened = "was changed by somebody else" if self._known is not None else "exists, and was not read"
            raise ConfigError(f"{self.path.name} {happened}: load it first, which brings back what it says")
        new = yaml.safe_dump(_in_order(values, old), sort_keys=False, allow_unicode=True) if values else ""
        saved = f"saved to {self.path.name}"
        try:
            if old is not None and _COMMENT.search(old.decode(errors="replace")):
                backup = self.path.with_name(f"{self.path.name}.bak")
                self._write(backup, old)
                saved = f"{saved}; the old one, with its comments, is {backup.name}"
            self._write(self.path, new.encode())
        except OSError as error:
            raise ConfigError(f"cannot write {self.path}: {error.strerror}") from None
        self._known = new.encode()
        return saved

    def _content(self) -> bytes | None:
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise ConfigError(f"cannot read {self.path}: {error.strerror}") from None

    def _write(self, path: Path, content: bytes) -> None:
        path = path.resolve()  # keeps a symbolic link
        # Camera addresses may contain passwords: only the owner may read a new file.
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            like = path if path.exists() else self.path
            if like.exists():
                Path(name).chmod(like.stat().st_mode & 0o777)
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def _in_order(values: Mapping[str, Any], old: bytes | None) -> dict[str, Any]:
    """Return ``values`` with sections and fields in the order of the old file, new ones last."""
    try:
        order = plain_yaml.parse(old or b"", "", ConfigError)
    except ConfigError:
        order = None
    return _sorted(values, order)


def _sorted(values: Mapping[str, Any], order: Any) -> dict[str, Any]:
    before = [key for key in order if key in values] if isinstance(order, dict) else []
    keys = [*before, *(key for key in values if key not in before)]
    return {
        key: _sorted(values[key], order[key] if key in before else None)
        if isinstance(values[key], Mapping)
        else values[key]
        for key in keys
    }
