"""The audit: who did what, and what happened to the robot, as messages on ``/audit``.

An event is a ``rcl_interfaces/msg/Log``, as on ``/rosout``: ``stamp``; ``level``; ``name`` is who did it, a node or a
viewer of the page; ``msg`` is a sentence for people; ``function`` is the code of the event, and ``file`` what it is
about, both for programs.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from handsteer.config import Config
from handsteer.errors import without_passwords
from handsteer.messages import Log, Time

AuditCode = Literal[
    "seat_taken",
    "seat_left",
    "seat_lost",
    "steers",
    "steering_topic",
    "stop_pressed",
    "reset_pressed",
    "camera_chosen",
    "world_changed",
    "setting_changed",
    "settings_saved",
    "recording_started",
    "recording_ended",
    "stopped",
    "reset",
    "armed",
    "disarmed",
    "engaged",
    "disengaged",
    "source_changed",
    "drives",
    "stands",
    "fault",
    "fault_ended",
]
"""Every event; a code keeps its meaning in later versions."""

INFO, WARN, ERROR = 20, 30, 40
"""Levels of ``rcl_interfaces/msg/Log``."""

_CODES = frozenset(get_args(AuditCode))
_LONGEST = 1000


@dataclass(frozen=True)
class AuditEvent:
    """Something that was done, or that happened.

    Attributes:
        code: For programs.
        who: The node or viewer.
        sentence: For people, to be read after ``who``.
        about: For programs: the parameter, the reason's code, the source of commands, and so on; may be empty.
        level: INFO, WARN or ERROR.
    """

    code: AuditCode
    who: str
    sentence: str
    about: str = ""
    level: int = INFO


def write_event(event: AuditEvent, stamp: Time) -> Log:
    """Return ``event`` as a message."""
    texts = {"name": event.who, "msg": event.sentence[:_LONGEST], "file": event.about[:_LONGEST]}
    return Log(stamp=stamp, level=event.level, function=event.code, line=0, **texts)


def read_event(message: Log) -> AuditEvent | None:
    """Return the event in a message from any source; None if its code is not known here."""
    if message.function not in _CODES:
        return None
    code: Any = message.function
    who, sentence, about = (text[:_LONGEST] for text in (message.name, message.msg, message.file))
    return AuditEvent(code, who, sentence, about, message.level)


def setting_changes(old: Config, new: Config, who: str) -> Iterator[AuditEvent]:
    """Yield an event for each parameter that differs; passwords in addresses are left out."""
    for section in Config.model_fields:
        before, after = getattr(old, section), getattr(new, section)
        for name in type(before).model_fields:
            path = f"{section}.{name}"
            for part, was, now in _differences(path, getattr(before, name), getattr(after, name)):
                yield AuditEvent("setting_changed", who, f"changed {part} from {_shown(was)} to {_shown(now)}", part)


def _differences(path: str, was: Any, now: Any) -> Iterator[tuple[str, Any, Any]]:
    if was == now:
        return
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        for key in sorted({*was, *now}):
            yield from _differences(f"{path}.{key}", was.get(key), now.get(key))
    else:
        yield path, was, now


def _shown(value: Any) -> str:
    if value is None or value == "":
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else without_passwords(str(value))
