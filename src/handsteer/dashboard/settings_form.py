"""The fields of the settings page, derived from the configuration's models, without page or files."""

import re
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin
from urllib.parse import urlsplit

import yaml

from handsteer import plain_yaml
from handsteer.config import Config, validate
from handsteer.errors import ConfigError
from handsteer.parameters import Description, describe, section_model

FieldKind = Literal["switch", "choice", "number", "text", "list", "table"]
"""How a field is edited; the items of a list or table are separated by commas."""

LONGEST_TEXT = 2000
"""Maximum number of characters of a field."""

MASK = "•••"
"""Replaces hidden parts: passwords in the address of a camera."""

_FOR_THE_DRIVER = frozenset({("dashboard", "certificate"), ("dashboard", "private_key")})
_UNIT = re.compile(r" \[([^\]]+)\]$")
_SCALAR = re.compile(r"[-+.\w]+")
_PASSWORD = re.compile(
    r"(?<=://)[^/@:\s]*:(?P<user>[^/\s]*)(?=@)|[?&][^=&]*(?:pass|pwd|token|secret|key|auth)[^=&]*=(?P<query>[^&\s]+)",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class FormField:
    """One parameter in the form.

    Attributes:
        section: Its section of the configuration.
        name: Its name in the section.
        text: A one-line description.
        unit: The unit of its values; empty if none.
        allowed: Its range or choices in words; empty if unrestricted.
        kind: How it is edited.
        choices: The choices; for a table, those of its values.
        optional: Whether it may be empty, which means None.
        live: Whether it can change while the nodes run; otherwise it is read at the next start.
    """

    section: str
    name: str
    text: str
    unit: str
    allowed: str
    kind: FieldKind
    choices: tuple[str, ...]
    optional: bool
    live: bool

    @property
    def path(self) -> str:
        """The full name, such as ``control.max_linear``."""
        return f"{self.section}.{self.name}"

    def matches(self, words: str) -> bool:
        """Return whether its name or description contains each of ``words``, ignoring case."""
        said = f"{self.path} {self.path.replace('_', ' ')} {self.text} {self.unit}".casefold()
        return all(word in said for word in words.casefold().split())

    def value_in(self, config: Config) -> Any:
        """Return its value in ``config``."""
        return getattr(getattr(config, self.section), self.name)

    def show(self, value: Any, *, to_driver: bool = True) -> str:
        """Return ``value`` as text for editing; masks passwords, and paths of keys unless ``to_driver``."""
        if value is None:
            return ""
        if (self.section, self.name) in _FOR_THE_DRIVER and not to_driver:
            return MASK
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, float):
            return repr(value).removesuffix(".0")
        if isinstance(value, tuple | dict):
            return _flow(list(value) if isinstance(value, tuple) else value)
        return mask(str(value)) if self.kind == "text" else str(value)

    def parse(self, text: str, current: Any = None) -> Any:
        """Return the value of ``text``, validated like a value in a YAML file.

        Args:
            text: From :meth:`show`, or entered by a viewer.
            current: The current value, which contains the masked passwords.

        Raises:
            ConfigError: It is not valid YAML or not an allowed value; the message is that for a file.
        """
        if len(text) > LONGEST_TEXT:
            raise ConfigError(f"{self.path}: should have at most {LONGEST_TEXT} characters, and has {len(text)}")
        checked = validate(Config, {self.section: {self.name: self._read(text, current)}})
        return self.value_in(checked)

    def _read(self, text: str, current: Any) -> Any:
        if not text and self.optional:
            return None
        if self.kind in ("number", "switch"):
            return _number_or_switch(text)
        if self.kind == "list":
            return self._scalars(f"[{text}]")
        if self.kind == "table":
            pairs = iter(self._scalars(f"{{{text}}}"))
            return dict(zip(pairs, pairs, strict=True))
        return self._unmasked(text, current) if MASK in text else text

    def _scalars(self, flow: str) -> list[str]:
        # Parsed by events, because a loader would follow aliases and nesting to any depth.
        try:
            events = list(yaml.parse(flow, yaml.BaseLoader))
        except yaml.YAMLError:
            events = []
        inner = events[3:-3]
        if not events or not all(isinstance(event, yaml.ScalarEvent) for event in inner):
            example = "Peace: turbo, Hi: stop" if self.kind == "table" else "r1, r2"
            raise ConfigError(f"{self.path}: {flow[1:-1]!r} should be written as in: {example}")
        return [event.value for event in inner if isinstance(event, yaml.ScalarEvent)]

    def _unmasked(self, text: str, current: Any) -> str:
        hidden = _passwords(str(current or ""))
        parts = text.split(MASK)
        if len(parts) != len(hidden) + 1 or _host(text) != _host(mask(str(current or ""))):
            raise ConfigError(f"{self.path}: this is another address, so {MASK} should be its password")
        return "".join(part + secret for part, secret in zip(parts, [*hidden, ""], strict=True))


def mask(address: str) -> str:
    """Return ``address`` with :data:`MASK` instead of passwords: ``rtsp://me:•••@10.0.0.5/``."""
    shown, at = "", 0
    for begin, end in _spans(address):
        shown, at = shown + address[at:begin] + MASK, end
    return shown + address[at:]


def form() -> dict[str, tuple[FormField, ...]]:
    """Return the fields of every section, in the order of the configuration."""
    return {
        name: tuple(_field(name, field) for field in section_model(name).model_fields) for name in Config.model_fields
    }


def _field(section: str, name: str) -> FormField:
    model = section_model(section)
    field = model.model_fields[name]
    known = describe(model, name)
    unit = _UNIT.search(known.text)
    return FormField(
        section=section,
        name=name,
        text=_UNIT.sub("", known.text),
        unit=unit.group(1) if unit else "",
        allowed=_allowed(known),
        kind=_kind(field.annotation, known),
        choices=known.choices,
        optional=type(None) in get_args(field.annotation),
        live=known.why_fixed is None,
    )


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
    lowest = known.constraint or ("" if known.minimum is None else f"at least {known.minimum:g}")
    highest = "" if known.maximum is None else f"at most {known.maximum:g}"
    if lowest.startswith("at least") and highest:
        return f"{known.minimum:g} to {known.maximum:g}"
    return ", ".join(part for part in (lowest, highest) if part)


def _flow(value: Any) -> str:
    text: str = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, sort_keys=False, width=float("inf"))
    return text.strip()[1:-1]


def _number_or_switch(text: str) -> Any:
    """Return the number or boolean that YAML reads in ``text``, else ``text``."""
    if not _SCALAR.fullmatch(text.strip()):
        return text
    try:
        value = plain_yaml.parse(text, "", ConfigError)
    except ConfigError:  # such as 0b_
        return text
    return value if isinstance(value, bool | int | float) else text


def _spans(address: str) -> list[tuple[int, int]]:
    if "://" not in address:
        return []
    return [match.span(match.lastgroup or 0) for match in _PASSWORD.finditer(address)]


def _passwords(address: str) -> list[str]:
    return [address[begin:end] for begin, end in _spans(address)]


def _host(address: str) -> tuple[str, str]:
    """Return scheme and host: the destination of a password."""
    try:
        parts = urlsplit(address)
    except ValueError:
        return "", ""
    return parts.scheme, parts.netloc
