"""A report in words: the totals of a drive, for the page and for the terminal."""

import math
from typing import NamedTuple

from handsteer.plugins.record.replay.drive_facts import DriveFacts, SignTotal

_MOST_SIGNS = 12


class Total(NamedTuple):
    """A total: its name, the value, and what else is to say of it."""

    name: str
    value: str
    more: str = ""


def heading(facts: DriveFacts) -> str:
    """Return when and for how long it was recorded, and by what."""
    began = f"Recorded {facts.began}, " if facts.began else "A recording of "
    by = f" by handsteer {facts.about['handsteer'][:40]}" if "handsteer" in facts.about else ""
    system = ", ".join(f"{name} {facts.about[name][:60]}" for name in ("python", "system") if name in facts.about)
    return f"{began}{_time(facts.duration_s)}{by}{f' ({system})' if system else ''}"


def totals(facts: DriveFacts) -> list[Total]:
    """Return all totals that are known."""
    found = [
        Total("duration", _time(facts.duration_s)),
        Total("camera", facts.camera or "unknown", _size(facts)) if facts.camera or facts.size else None,
        Total("frames", str(facts.frames), f"{facts.frames_per_s:.1f} a second") if facts.frames else None,
        Total("robot", facts.robot, _worlds(facts)) if facts.robot else None,
        None if facts.distance_m is None else Total("distance", f"{facts.distance_m:.2f} m"),
        _driving(facts),
        Total("driven by", ", ".join(facts.sources), _seconds(facts.sources)) if facts.sources else None,
        Total("commands", str(facts.commands)) if facts.commands else None,
        _stops(facts),
        _unexplained(facts),
        Total("bumps", str(len(facts.bumps))) if facts.knows_bumps else None,
        _gates(facts),
        _latency(facts),
    ]
    return [total for total in found if total is not None]


def sign_totals(facts: DriveFacts) -> list[Total]:
    """Return a total per sign, the longest first."""
    by_time = sorted(facts.signs.items(), key=lambda pair: -pair[1].seconds)[:_MOST_SIGNS]
    return [Total(name, f"{total.seconds:.1f} s", _counts(total)) for name, total in by_time]


def _counts(total: SignTotal) -> str:
    return f"{_many(total.frames, 'frame')}, {_many(total.times, 'time')}"


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _time(duration_s: float) -> str:
    minutes, seconds = divmod(duration_s, 60)
    return f"{minutes:.0f} min {math.floor(seconds)} s" if minutes else f"{seconds:.1f} s"


def _size(facts: DriveFacts) -> str:
    return f"{facts.size[0]}x{facts.size[1]}" if facts.size else ""


def _seconds(times: dict[str, float]) -> str:
    return ", ".join(f"{name} {_time(time_s)}" for name, time_s in times.items())


def _driving(facts: DriveFacts) -> Total | None:
    if facts.driving_s is None:
        return None
    return Total("driving", _time(facts.driving_s), f"standing {_time(max(0.0, facts.duration_s - facts.driving_s))}")


def _stops(facts: DriveFacts) -> Total | None:
    if not facts.commands:
        return None
    reasons: dict[str, int] = {}
    for stand in facts.stands:
        reasons[stand.reason] = reasons.get(stand.reason, 0) + 1
    by_count = sorted(reasons.items(), key=lambda pair: -pair[1])[:3]
    pressed = [f"/stop was set {_many(facts.stops, 'time')}"] if facts.stops else []
    return Total(
        "stops", str(facts.stand_count), "; ".join([f"{n}: {reason[:80]}" for reason, n in by_count] + pressed)
    )


def _unexplained(facts: DriveFacts) -> Total | None:
    if not facts.commands:
        return None
    if not facts.unexplained:
        return Total("no reason", "never", "motion without a live reason")
    first = facts.unexplained[0]
    duration_s = sum(each.end_s - each.begin_s for each in facts.unexplained)
    more = f"motion without a live reason, at {first.begin_s:.2f} s: {first.why}"
    return Total("no reason", f"{duration_s:.1f} s", more)


def _gates(facts: DriveFacts) -> Total | None:
    if not facts.laps:
        return None
    last = facts.laps[-1]
    before = f", begun {-last.began_s:.1f} s before the recording" if last.began_s < 0 else ""
    return Total("laps", str(len(facts.laps)), f"the last: {last.course}{before}")


def _worlds(facts: DriveFacts) -> str:
    return f"world {', then '.join(facts.worlds)}" if facts.worlds else ""


def _latency(facts: DriveFacts) -> Total | None:
    median, high = facts.latency_ms(50), facts.latency_ms(99)
    if median is None or high is None:
        return None
    return Total("latency", f"{median:.1f} ms", f"median; 99 % within {high:.1f} ms")
