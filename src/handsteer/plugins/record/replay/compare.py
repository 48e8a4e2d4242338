"""Compares a replay with its recording: which moments differ, in words."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from handsteer.messages import CMD_VEL, GESTURE_JOY, HAND_SIGN, pointing_in, stick_in, twist_in, type_name
from handsteer.plugins.record.recorded import Recorded
from handsteer.plugins.record.replay.rerun import CONTROL, Result
from handsteer.transports.encoding import decode

_WHAT = {HAND_SIGN.name: "sign", GESTURE_JOY.name: "joystick", CMD_VEL.name: "command"}


@dataclass(frozen=True)
class Moment:
    """A moment at which the replay differs from the recording.

    Attributes:
        time_s: When, in seconds since the recording began.
        what: ``sign``, ``joystick`` or ``command``.
        recorded: What was recorded, in words.
        replayed: What is there today.
        frame: The frame that was processed; None if there was none, as for commands.
    """

    time_s: float
    what: str
    recorded: str
    replayed: str
    frame: Recorded | None = None


@dataclass
class Comparison:
    """What a replay has compared.

    Attributes:
        frames: Number of frames that recognition processed.
        signs: Number of recorded signs.
        commands: Number of recorded commands.
        duration_s: Time of the last result, in seconds since the recording began.
        differing: Number of moments that differ.
    """

    frames: int = 0
    signs: int = 0
    commands: int = 0
    duration_s: float = 0.0
    differing: int = 0


def compare(results: Iterable[Result], comparison: Comparison, began_s: float) -> Iterator[Moment]:
    """Yield each moment at which ``results`` differ, and count all of them in ``comparison``.

    Args:
        results: Of a replay.
        comparison: Changed.
        began_s: When the recording began, on the clock of the results.
    """
    frame: Recorded | None = None
    for result in results:
        comparison.duration_s = max(comparison.duration_s, result.time_s - began_s)
        if result.frame is not None and result.frame is not frame:
            comparison.frames, frame = comparison.frames + 1, result.frame
        comparison.signs += len(result.recorded.get(HAND_SIGN.name, ()))
        comparison.commands += sum(len(raws) for raws in result.recorded.values()) if result.node == CONTROL else 0
        for moment in _moments(result, began_s) if result.differs else ():
            comparison.differing += 1
            yield moment


def differing_software(about: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Return what of the software and the models is not as it was, as ``numpy: 2.3.0 was recorded, now 2.4.6``.

    Args:
        about: Metadata of a recording (:func:`handsteer.plugins.record.describe`).
        now: The same of this program.
    """
    names = [name for name in now if name in about and name not in ("config", "began", "clock_offset_s")]
    return [
        f"{name}: {about[name][:12]} was recorded, now {now[name][:12]}" for name in names if about[name] != now[name]
    ]


def _moments(result: Result, began_s: float) -> Iterator[Moment]:
    for topic in sorted({*result.recorded, *result.replayed}):
        recorded, replayed = result.recorded.get(topic, []), result.replayed.get(topic, [])
        if recorded == replayed:
            continue
        kinds = {type_name(type(message)) for message, _ in result.messages.get(topic, ())}
        kind = next(iter(kinds), type_name(_TYPES.get(topic, CMD_VEL.type)))
        was, now = (_words(topic, raws, kind) for raws in (recorded, replayed))
        yield Moment(result.time_s - began_s, _WHAT.get(topic, topic), was, now, result.frame)


_TYPES = {topic.name: topic.type for topic in (HAND_SIGN, GESTURE_JOY, CMD_VEL)}


def _words(topic: str, raws: list[bytes], kind: str) -> str:
    return ", ".join(_in_words(topic, raw, kind) for raw in raws) or "nothing"


def _in_words(topic: str, raw: bytes, kind: str) -> str:
    try:
        message: Any = decode(raw, kind)
    except Exception:
        return f"{len(raw)} bytes"
    if topic == HAND_SIGN.name:
        return str(message.data)
    if topic == GESTURE_JOY.name:
        stick = stick_in(message)
        points = pointing_in(message)
        if not stick.is_valid:
            return "not valid"
        if points.held and points.is_valid and not stick.held:
            return f"points {points.forward:+.3f} forward, {points.left:+.3f} left"
        return f"{stick.forward:+.3f} forward, {stick.left:+.3f} left" if stick.held else "released"
    velocity = twist_in(message)
    return f"{velocity.linear.x:.3f} m/s, {velocity.angular.z:.3f} rad/s"
