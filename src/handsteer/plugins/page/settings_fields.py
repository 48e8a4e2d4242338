"""The fields of the settings page, derived from the configuration's models, without page or files."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, get_args, get_origin
from urllib.parse import urlsplit

import yaml

from handsteer import plain_yaml
from handsteer.config import Config, validate
from handsteer.errors import ConfigError, quoted
from handsteer.parameters import Description, describe, plain, section_model

FieldKind = Literal["switch", "choice", "number", "text", "list", "table"]
"""How a field is edited; the items of a list or table are separated by commas."""

LONGEST_TEXT = 2000
"""Maximum number of characters of a field."""

MASK = "•••"
"""Replaces hidden parts: passwords in the address of a camera."""

SECTION_TITLES: Mapping[str, str] = MappingProxyType(
    {
        "camera": "Camera",
        "virtual_hand": "Virtual hand",
        "landmarks": "Finding hands",
        "signs": "Recognising signs",
        "joystick": "Hand as a joystick",
        "joy": "Gamepad messages",
        "control": "Driving",
        "collision_monitor": "Obstacles",
        "robot": "Robot",
        "teach": "Teaching signs",
        "recording": "Recordings and audit",
        "dashboard": "This page",
        "foxglove": "Foxglove",
    }
)
"""Titles of the configuration's sections."""

COMMON: Mapping[str, str] = MappingProxyType(
    {
        "control.mode": "What the hand is",
        "control.rule": "How signs drive",
        "control.max_linear": "Top speed",
        "control.max_angular": "Top turning speed",
        "signs.confirm_time": "Time until a sign counts",
        "signs.min_confidence": "Threshold of a sign",
        "camera.source": "Camera",
        "camera.width": "Picture width",
        "camera.height": "Picture height",
        "robot.preset": "Known robot",
        "robot.world": "World",
        "control.assist": "Before obstacles",
    }
)
"""The parameters that people change most, in the order of the page, and their titles."""

_WORDS = {"cmd": "command", "id": "ID", "max": "maximum", "min": "minimum", "odom": "odometry", "vel": "velocity"}
_NUMBER = re.compile(r"[-+]?(\d{1,64}|\d{0,64}\.\d{1,64}|\d{1,64}\.)([eE][-+]?\d{1,4})?", re.ASCII)
_FOR_THE_DRIVER = frozenset({"dashboard.certificate", "dashboard.private_key"})
_WITH_UNIT = re.compile(r"(.*?)(?: \[([^\]]+)\])?")
_PASSWORD = re.compile(
    r"(?<=://)[^/@:\s]*:(?P<user>[^/\s]*)(?=@)|[?&][^=&]*(?:pass|pwd|token|secret|key|auth)[^=&]*=(?P<query>[^&\s]+)",
    re.IGNORECASE,
)


class Field:
    """One parameter in the form, derived from its model.

    Attributes:
        section: Its section of the configuration.
        name: Its name in the section.
        path: The full name, such as ``control.max_linear``.
        title: A plain name, such as "Top speed".
        text: A one-line description.
        unit: The unit of its values; empty if none.
        allowed: Its range or choices in words; empty if unrestricted.
        kind: How it is edited.
        choices: The choices; for a table, those of its values.
        optional: Whether it may be empty, which means None.
        live: Whether it can change while the nodes run; otherwise it is read at the next start.
    """

    def __init__(self, section: str, name: str) -> None:
        model = section_model(section)
        annotation = model.model_fields[name].annotation
        known = describe(model, name)
        described = _WITH_UNIT.fullmatch(known.text)
        assert described is not None
        self.section, self.name, self.path = section, name, f"{section}.{name}"
        self.title = COMMON.get(self.path) or _title(name)
        self.text, self.unit = described.group(1), described.group(2) or ""
        self.allowed = _allowed(known)
        self.kind = _kind(annotation, known)
        self.choices = known.choices
        self.optional = type(None) in get_args(annotation)
        self.live = known.why_fixed is None

    def matches(self, words: str) -> bool:
        """Return whether its name or description contains each of ``words``, ignoring case."""
        names = f"{self.path} {self.path.replace('_', ' ')} {self.title} {SECTION_TITLES[self.section]}"
        content = f"{names} {self.text} {self.unit}".casefold()
        return all(word in content for word in words.casefold().split())

    def value_in(self, config: Config) -> Any:
        """Return its value in ``config``."""
        return getattr(getattr(config, self.section), self.name)

    def show(self, value: Any, *, to_driver: bool = True) -> str:
        """Return ``value`` as text for editing; masks passwords, and paths of keys unless ``to_driver``."""
        if value is None:
            return ""
        if self.path in _FOR_THE_DRIVER and not to_driver:
            return MASK
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, float):
            return repr(value).removesuffix(".0")
        if isinstance(value, tuple | dict):
            text: str = yaml.safe_dump(
                plain(value), default_flow_style=True, allow_unicode=True, sort_keys=False, width=float("inf")
            )
            return text.strip()[1:-1]
        return MASK.join(_split(str(value))[0]) if self.kind == "text" else str(value)

    def parse(self, text: str, current: Any = None) -> Any:
        """Return the value of ``text``, validated like a value in a YAML file.

        Passwords that :meth:`show` has masked are those of the ``current`` value.

        Raises:
            ConfigError: It is not valid YAML or not an allowed value; the message is that for a file.
        """
        if len(text) > LONGEST_TEXT:
            raise ConfigError(f"{self.path}: should have at most {LONGEST_TEXT} characters, and has {len(text)}")
        return self.value_in(validate(Config, {self.section: {self.name: self._read(text, current)}}))

    def _read(self, text: str, current: Any) -> Any:
        if not text and self.optional:
            return None
        if self.kind in ("number", "switch"):
            return _number_or_switch(text, self.path)
        if self.kind == "list":
            return self._scalars(f"[{_bare(text, '[]')}]")
        if self.kind == "table":
            pairs = iter(self._scalars(f"{{{_bare(text, '{}')}}}"))
            return dict(zip(pairs, pairs, strict=True))
        return self._unmasked(text, str(current or "")) if MASK in text else text

    def _scalars(self, flow: str) -> list[str]:
        # Parsed by events, because a loader would follow aliases and nesting to any depth.
        try:
            events = list(yaml.parse(flow, yaml.BaseLoader))
        except yaml.YAMLError:
            events = []
        scalars = [event.value for event in events[3:-3] if isinstance(event, yaml.ScalarEvent)]
        if not events or len(scalars) < len(events) - 6:
            example = "Peace: turbo, Hi: stop" if self.kind == "table" else "r1, r2"
            raise ConfigError(f"{self.path}: {flow[1:-1]!r} should be written as in: {example}")
        return scalars

    def _unmasked(self, text: str, current: str) -> str:
        shown, passwords = _split(current)
        parts = text.split(MASK)
        if len(parts) != len(shown) or _host(text) != _host(MASK.join(shown)):
            raise ConfigError(f"{self.path}: this is another address, so {MASK} should be its password")
        return "".join(part + password for part, password in zip(parts, [*passwords, ""], strict=True))


def _bare(text: str, brackets: str) -> str:
    """Return ``text`` without the ``brackets`` that it has in a file, if it has them."""
    stripped = text.strip()
    return stripped[1:-1] if len(stripped) > 1 and (stripped[0], stripped[-1]) == tuple(brackets) else text


def _title(name: str) -> str:
    words = " ".join(_WORDS.get(word, word) for word in name.split("_"))
    return words[0].upper() + words[1:]


def _kind(annotation: Any, known: Description) -> FieldKind:
    if get_origin(annotation) is dict:
        return "table"
    if known.choices:
        return "choice"
    kinds: dict[str, FieldKind] = {"bool": "switch", "integer": "number", "double": "number", "strings": "list"}
    return kinds.get(known.kind, "text")


def _allowed(known: Description) -> str:
    if known.kind not in ("integer", "double"):
        return known.constraint
    if known.minimum is not None and known.maximum is not None and not known.constraint:
        return f"{known.minimum:g} to {known.maximum:g}"
    lowest = known.constraint or ("" if known.minimum is None else f"at least {known.minimum:g}")
    highest = "" if known.maximum is None else f"at most {known.maximum:g}"
    return ", ".join(part for part in (lowest, highest) if part)


def _number_or_switch(text: str, path: str) -> Any:
    """Return the number, true or false in ``text``, else ``text``.

    Raises:
        ConfigError: It is a number to YAML only, which reads 0640 as 416, 1_0 as 10 and 1:30 as 90.
    """
    text = text.strip()
    if _NUMBER.fullmatch(text):
        return float(text) if set(text) & set(".eE") else int(text)
    if text[:1].isdecimal() or text[1:2].isdecimal():
        raise ConfigError(f"{path}: {quoted(text)} should be a number such as 0.5")
    try:
        value = plain_yaml.parse(text, "", ConfigError)
    except ConfigError:
        return text
    return text if value is None else value


def _split(address: str) -> tuple[list[str], list[str]]:
    """Return the parts of ``address`` around its passwords, and the passwords."""
    shown, passwords, at = [], [], 0
    for match in _PASSWORD.finditer(address) if "://" in address else ():
        begin, end = match.span(match.lastgroup or 0)
        shown.append(address[at:begin])
        passwords.append(address[begin:end])
        at = end
    return [*shown, address[at:]], passwords


def _host(address: str) -> tuple[str, str]:
    """Return scheme and host: the destination of a password."""
    try:
        parts = urlsplit(address)
    except ValueError:
        return "", ""
    return parts.scheme, parts.netloc


FORM: Mapping[str, tuple[Field, ...]] = MappingProxyType(
    {
        section: tuple(Field(section, name) for name in section_model(section).model_fields)
        for section in Config.model_fields
    }
)
"""The fields by section, in the order of the configuration."""

FIELDS: Mapping[str, Field] = MappingProxyType({field.path: field for fields in FORM.values() for field in fields})
"""All fields by full name."""
