"""The form of a status on ``/diagnostics``: to messages, and back.

A status becomes a ``diagnostic_msgs/DiagnosticStatus`` with a level, a sentence for people, and a value for each field.
A nested field has a value for each of its own fields, such as ``course_gates``; a list is separated by commas; what is
None is left out. Anything may be read back: a value that is missing, too large or of another type leaves its field at
the default.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from itertools import islice
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from handsteer.config import ControlConfig, validate
from handsteer.errors import ConfigError
from handsteer.messages import DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status

_MOST_VALUES = 500
_MOST_ITEMS = 200
_LONGEST_TEXT = 4000
_LARGEST = 1e9

_ACTION = "actions."
_RULE = tuple(sorted(ControlConfig.live - {"actions"}))

_KINDS: dict[str, type[Status]] = {
    kind.node: kind for kind in (CameraStatus, RecognitionStatus, ControlStatus, RobotStatus)
}


def split_reporter(name: str) -> tuple[str, str]:
    """Return the namespace and the node of a status: ``r1/cam: my_camera`` gives ``r1`` and ``my_camera``.

    A node without a process of its own reports under its name alone, and has no namespace.
    """
    process, _, node = name.rpartition(": ")
    return process.rpartition("/")[0], node


def write_status(status: Status, name: str, stamp: Time) -> DiagnosticArray:
    """Return ``status`` as a message of the node with the full name ``name``."""
    pairs = [KeyValue(key, text) for key, text in _flat(status)]
    reported = DiagnosticStatus(level=status.level, name=name, message=status.message, hardware_id="", values=pairs)
    return DiagnosticArray(header=Header(stamp=stamp, frame_id=""), status=[reported])


def read_status(message: DiagnosticStatus) -> Status | None:
    """Return the status in a message from any source; None if no node of handsteer reports by this name."""
    kind: Any = _KINDS.get(split_reporter(message.name)[1])
    if kind is None:
        return None
    pairs = islice(message.values, _MOST_VALUES)
    values = {pair.key: pair.value[:_LONGEST_TEXT] for pair in pairs}
    found: dict[str, Any] = {}
    for name, hint in _hints(kind).items():
        with suppress(KeyError, ValueError, csv.Error):
            found[name] = _read(hint, name, values)
    status: Status = kind(**found)
    return status


def _flat(record: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the fields of a dataclass as named values."""
    for each in fields(record):
        name, value = prefix + each.name, getattr(record, each.name)
        if isinstance(value, ControlConfig):
            yield from _rule_values(value)
        elif is_dataclass(value):
            yield from _flat(value, f"{name}_")
        elif isinstance(value, (tuple, frozenset)):
            yield name, _joined(sorted(value) if isinstance(value, frozenset) else value)
        elif value is not None:
            yield name, str(value)


def _rule_values(rule: ControlConfig) -> Iterator[tuple[str, str]]:
    for name in _RULE:
        yield name, str(getattr(rule, name))
    for sign, action in rule.actions.items():
        yield _ACTION + sign, action


def _joined(items: Iterable[object]) -> str:
    """Return ``items`` separated by commas; one that has a comma itself is in quotes."""
    line = io.StringIO()
    csv.writer(line).writerow(items)
    return line.getvalue().removesuffix("\r\n")


@cache
def _hints(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {each.name: hints[each.name] for each in fields(kind)}


def _read(hint: Any, name: str, values: Mapping[str, str]) -> Any:
    """Return the field ``name`` of the type ``hint``.

    Raises:
        KeyError, ValueError, csv.Error: It is missing, or of another type.
    """
    if get_origin(hint) in (Union, UnionType):
        return _read_any(get_args(hint), name, values)
    if hint is ControlConfig:
        actions = [(key.removeprefix(_ACTION), text) for key, text in values.items() if key.startswith(_ACTION)]
        return _rule(tuple(values[each] for each in _RULE), tuple(actions))
    if isinstance(hint, type) and is_dataclass(hint):
        return hint(**{part: _read(of, f"{name}_{part}", values) for part, of in _hints(hint).items()})
    return _parse(hint, values[name])


def _read_any(hints: Iterable[Any], name: str, values: Mapping[str, str]) -> Any:
    for hint in hints:
        if hint is not NoneType:
            with suppress(KeyError, ValueError):
                return _read(hint, name, values)
    raise ValueError(name)


def _parse(hint: Any, text: str) -> Any:
    if hint is str:
        return text
    if hint in (int, float):
        number = hint(text)
        if not abs(number) <= _LARGEST:
            raise ValueError(text)
        return number
    if get_origin(hint) is Literal or hint is bool:
        return {str(choice): choice for choice in get_args(hint) or (True, False)}[text]
    parts = next(csv.reader([text]), [])[:_MOST_ITEMS]
    return get_origin(hint)(_parse(get_args(hint)[0], part) for part in parts)


# Reports arrive ten times a second and are nearly always the same.
@lru_cache(maxsize=8)
def _rule(texts: tuple[str, ...], actions: tuple[tuple[str, str], ...]) -> ControlConfig:
    try:
        return validate(ControlConfig, {**dict(zip(_RULE, texts, strict=True)), "actions": dict(actions)})
    except ConfigError as error:
        raise ValueError(str(error)) from None
