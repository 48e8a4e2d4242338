"""What a recording says about a drive: plain data, for a page or for JSON."""

from array import array
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handsteer.types import CourseState

# More points of a curve in a chart would only make the page larger and slower.
_MOST_SHOWN = 20_000
_MOST_KEPT = 400_000


class Curve:
    """Rows of numbers, of which the first is the time; beyond some 400,000 rows, only every second one is kept.

    Args:
        columns: Numbers per row, with the time.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._rows = array("d")
        self._stride = self._skipped = 1

    def __len__(self) -> int:
        return len(self._rows) // self._columns

    def add(self, *row: float) -> None:
        """Add a row."""
        if self._skipped < self._stride:
            self._skipped += 1
            return
        self._skipped = 1
        self._rows.extend(row)
        if len(self) >= _MOST_KEPT:
            kept = np.frombuffer(self._rows).reshape(-1, self._columns)[::2].tobytes()
            self._rows = array("d", kept)
            self._stride *= 2

    def table(self, most: int = _MOST_SHOWN) -> NDArray[np.float64]:
        """Return at most about ``most`` rows, (n, columns), with the smallest and largest value of each part."""
        table = np.frombuffer(self._rows.tobytes()).reshape(-1, self._columns)
        if len(table) <= most:
            return table
        # Each part gives two rows per column of values.
        parts = np.array_split(np.arange(len(table)), max(1, most // (2 * (self._columns - 1))))
        chosen = set[int]()
        for part in parts:
            values = table[part[0] : part[-1] + 1, 1:]
            chosen.update((part[0] + values.argmin(axis=0)).tolist(), (part[0] + values.argmax(axis=0)).tolist())
        return table[sorted(chosen)]


@dataclass
class SignTotal:
    """How much a sign was seen.

    Attributes:
        times: How often it began to be the confirmed sign.
        frames: Number of frames with it as the confirmed sign.
        seconds: For how long it was.
    """

    times: int = 0
    frames: int = 0
    seconds: float = 0.0


@dataclass
class SignSpan:
    """A time during which one sign was the confirmed one, in seconds since the recording began."""

    sign: str
    begin_s: float
    end_s: float


@dataclass
class Stand:
    """The robot was commanded to stand after it drove.

    Attributes:
        time_s: When, in seconds since the recording began.
        duration_s: Until it was commanded to drive again; None if it was not.
        sign: The confirmed sign; empty if unknown.
        code: The control's reason code; empty if unknown.
        reason: The reason in words.
        cause: What camera and recognition reported as a problem about then; empty if nothing that may explain it.
        place: x and y on the map, in metres; None if unknown.
        picture: The frame that led to it, or the one of that moment, as a small JPEG; None if there is none.
        has_led: Whether the command is known to have followed from the picture.
    """

    time_s: float
    duration_s: float | None = None
    sign: str = ""
    code: str = ""
    reason: str = ""
    cause: str = ""
    place: tuple[float, float] | None = None
    picture: bytes | None = None
    has_led: bool = False


@dataclass(frozen=True)
class Unexplained:
    """The robot was commanded to move without a live reason.

    Attributes:
        begin_s: When it began, in seconds since the recording began.
        end_s: When it ended.
        why: What was missing, in words.
    """

    begin_s: float
    end_s: float
    why: str


@dataclass
class Lap:
    """A try at the world's course.

    Attributes:
        began_s: When the start gate was crossed, in seconds since the recording began; negative if that was before.
        course: The progress at its end.
    """

    began_s: float
    course: CourseState


@dataclass(frozen=True)
class Event:
    """What a person or a node did, from the audit.

    Attributes:
        time_s: When, in seconds since the recording began.
        who: The node or the viewer of the page.
        sentence: What, to be read after ``who``.
    """

    time_s: float
    who: str
    sentence: str


@dataclass(frozen=True)
class Thing:
    """An obstacle or a gate on the map.

    Attributes:
        kind: ``box``, ``disc`` or ``gate``.
        x: Centre, in metres.
        y: Centre, in metres.
        yaw: In radians.
        length: Along x before turning, in metres.
        width: Along y before turning, in metres.
        rgb: Colour, each 0 to 255.
    """

    kind: str
    x: float
    y: float
    yaw: float
    length: float
    width: float
    rgb: tuple[int, int, int]


@dataclass
class DriveFacts:
    """A drive. Times are in seconds since the recording began; what is None or empty is not in the recording.

    Attributes:
        path: The recording.
        about: Its metadata: versions, parameters, hashes of models.
        began: When it began, in words; empty if unknown.
        duration_s: From the first to the last message.
        messages: Number of messages.
        camera: Name of the camera.
        size: Width and height of a frame in pixels.
        robot: Kind of the robot.
        worlds: Names of the worlds that it drove in, in their order; only the first 100.
        frames: Number of frames.
        commands: Number of commands.
        signs: Totals per confirmed sign.
        spans: When each sign was the confirmed one; only the first 20,000.
        seen: Names of the signs in single frames.
        confidence: Time, confidence, index in ``seen``.
        commanded: Time, m/s, rad/s.
        driven: Time, m/s, rad/s, x and y by odometry.
        truth: Time, x and y in the world.
        leaps_s: When the robot was put elsewhere.
        sources: For how long each input has driven the robot.
        distance_m: Distance driven.
        driving_s: For how long it moved.
        stands: Each time that it was commanded to stand after it drove; only the first 10,000.
        stand_count: How often that was.
        stops: How often ``/stop`` was set.
        unexplained: When it was commanded to move without a live reason; only the first 1,000.
        bumps: Where it began to touch an obstacle, each time; None if unknown.
        knows_bumps: Whether the robot reports what it touches.
        laps: On the world's course.
        events: What people and nodes did, from the audit; only the first 1,000.
        things: Obstacles and gates, at the end.
        latencies_ms: From the capture of each frame to the command that followed from it.
        no_latency: Why there are none.
        problems: What is wrong with the recording, in words.
    """

    path: Path
    about: dict[str, str] = field(default_factory=dict)
    began: str = ""
    duration_s: float = 0.0
    messages: int = 0
    camera: str = ""
    size: tuple[int, int] | None = None
    robot: str = ""
    worlds: list[str] = field(default_factory=list)
    frames: int = 0
    commands: int = 0
    signs: dict[str, SignTotal] = field(default_factory=dict)
    spans: list[SignSpan] = field(default_factory=list)
    seen: list[str] = field(default_factory=list)
    confidence: Curve = field(default_factory=lambda: Curve(3))
    commanded: Curve = field(default_factory=lambda: Curve(3))
    driven: Curve = field(default_factory=lambda: Curve(5))
    truth: Curve = field(default_factory=lambda: Curve(3))
    leaps_s: list[float] = field(default_factory=list)
    sources: dict[str, float] = field(default_factory=dict)
    distance_m: float | None = None
    driving_s: float | None = None
    stands: list[Stand] = field(default_factory=list)
    stand_count: int = 0
    stops: int = 0
    unexplained: list[Unexplained] = field(default_factory=list)
    bumps: list[tuple[float, float] | None] = field(default_factory=list)
    knows_bumps: bool = False
    laps: list[Lap] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    things: list[Thing] = field(default_factory=list)
    latencies_ms: Curve = field(default_factory=lambda: Curve(2))
    no_latency: str = ""
    problems: list[str] = field(default_factory=list)

    @property
    def frames_per_s(self) -> float:
        """Frames per second; 0 if the recording has no length."""
        return self.frames / self.duration_s if self.duration_s else 0.0

    def latency_ms(self, percent: float) -> float | None:
        """Return a percentile of the latencies; None if there are none."""
        table = self.latencies_ms.table(len(self.latencies_ms))
        return float(np.percentile(table[:, 1], percent)) if len(table) else None

    def totals(self) -> dict[str, Any]:
        """Return the totals as plain values, for JSON."""
        return {
            "recording": str(self.path),
            "began": self.began or None,
            "duration_s": round(self.duration_s, 3),
            "messages": self.messages,
            "handsteer": self.about.get("handsteer"),
            "camera": self.camera or None,
            "robot": self.robot or None,
            "world": ", then ".join(self.worlds) or None,
            "frames": self.frames,
            "frames_per_s": round(self.frames_per_s, 2),
            "signs": {name: _rounded(asdict(total)) for name, total in self.signs.items()},
            "commands": self.commands,
            "distance_m": None if self.distance_m is None else round(self.distance_m, 3),
            "driving_s": None if self.driving_s is None else round(self.driving_s, 3),
            "standing_s": None if self.driving_s is None else round(max(0.0, self.duration_s - self.driving_s), 3),
            "driven_by_s": _rounded(self.sources),
            "stands": self.stand_count,
            "stands_by_reason": dict(Counter(stand.code or "unknown" for stand in self.stands).most_common()),
            "stops": self.stops,
            "motion_without_reason": [
                {"begin_s": round(each.begin_s, 3), "end_s": round(each.end_s, 3), "why": each.why}
                for each in self.unexplained
            ],
            "bumps": len(self.bumps) if self.knows_bumps else None,
            "gates": sum(lap.course.passed for lap in self.laps) if self.laps else None,
            "laps": [{"began_s": round(lap.began_s, 3), **lap.course.as_dict()} for lap in self.laps],
            "latency_median_ms": _round(self.latency_ms(50)),
            "latency_p99_ms": _round(self.latency_ms(99)),
            "problems": self.problems,
        }


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 3) for name, value in values.items()}


def _round(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
