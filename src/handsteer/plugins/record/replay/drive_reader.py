"""Reads a recording once, from its begin to its end, into facts about the drive; in bounded memory."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime

from handsteer.audit import read_event
from handsteer.config import ControlConfig, JoyConfig
from handsteer.errors import RecordingError
from handsteer.messages import (
    AUDIT,
    CAMERA_INFO,
    DIAGNOSTICS,
    GESTURE_JOY,
    HAND_SIGN,
    IMAGE_RAW,
    JOY,
    STEERING_CMD_VEL,
    STOP,
    STOPPED,
    WORLD_MARKERS,
    velocity_in,
)
from handsteer.nodes.diagnostics import read_status
from handsteer.nodes.journal import journal_topic
from handsteer.nodes.status import OK, CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status
from handsteer.plugins.record.recorded import Recorded, Recording
from handsteer.plugins.record.replay.drive_facts import Curve, DriveFacts, Event
from handsteer.plugins.record.replay.drive_logs import MapThings, RobotLog, SignLog
from handsteer.plugins.record.replay.journals import clock_offset, parse_spin
from handsteer.plugins.record.replay.reason_log import ReasonLog
from handsteer.plugins.record.replay.stand_log import StandLog
from handsteer.types import NONE

_CONTROL = "hand_sign_control"
_FARTHEST_S = 24 * 3600.0
# Obstacles are published twenty times a second, and most of them stand.
_MARKERS_PERIOD_S = 1.0
# Statuses come ten times a second.
_LONGEST_STATUS_S = 0.5
_LARGEST = 1e6
_MOST_EVENTS = 1000
_MOST_WORLDS, _LONGEST_NAME = 100, 60
_EPOCH_BEGINS_S = 1e9


def read_drive(file: Recording) -> DriveFacts:
    """Return what a recording says about a drive.

    Args:
        file: The recording; what handsteer and ROS's own nodes publish is understood, other topics are counted.

    Raises:
        RecordingError: It cannot be read, or there is nothing to report.
    """
    reader: _Reader | None = None
    for recorded in file.messages():
        if reader is None:
            reader = _Reader(file, recorded.time_s)
        reader.read(recorded)
    if reader is None:
        raise RecordingError(f"{file.path} contains no messages{_why(file)}: there is nothing to report")
    return reader.end()


def _why(file: Recording) -> str:
    return f" ({file.problem})" if file.problem else ""


@dataclass
class _Numbers:
    """The numbers of a topic's messages, of which those between the first and the last should all be there."""

    count: int = 0
    first: int = 1 << 62
    last: int = 0

    def note(self, number: int) -> None:
        self.count += 1
        self.first, self.last = min(self.first, number), max(self.last, number)

    @property
    def missing(self) -> int:
        return max(0, self.last - self.first + 1 - self.count)


class _Reader:
    def __init__(self, file: Recording, began_s: float) -> None:
        self._file = file
        self._began_s = self._now_s = began_s
        self._facts = facts = DriveFacts(file.path, dict(file.about))
        self._offset_s = clock_offset(file.about)
        self._stands = StandLog(facts, began_s, self._offset_s or 0.0)
        self._signs = SignLog(facts)
        self._reasons = ReasonLog(facts, *_recorded_rules(file.about))
        self._robot = RobotLog(facts)
        self._map = MapThings()
        self._markers: Recorded | None = None
        self._markers_s = -math.inf
        self._is_set = False
        self._reported_s: float | None = None
        self._numbers: dict[str, _Numbers] = {}
        self._topics: dict[str, Callable[[Recorded, float], None] | None] = {}
        self._unreadable = 0
        self._first_of: dict[str, str] = {}

    def read(self, recorded: Recorded) -> None:
        """Take the next message."""
        self._facts.messages += 1
        if abs(recorded.time_s - self._now_s) > _FARTHEST_S:
            self._unreadable += 1
            return
        self._now_s = max(self._now_s, recorded.time_s)
        if recorded.number:
            self._numbers.setdefault(recorded.topic, _Numbers()).note(recorded.number)
        if recorded.topic not in self._topics:
            self._topics[recorded.topic] = self._handler(recorded)
        handle = self._topics[recorded.topic]
        if handle is not None:
            with self._damage_counted():
                handle(recorded, recorded.time_s - self._began_s)

    @contextmanager
    def _damage_counted(self) -> Iterator[None]:
        """Leave out a message that turns out to be damaged in this block."""
        try:
            yield
        except RecordingError:
            self._unreadable += 1

    def end(self) -> DriveFacts:
        """Return the facts.

        Raises:
            RecordingError: There is nothing to report.
        """
        facts = self._facts
        if not any(self._topics.values()):
            raise RecordingError(
                f"{self._file.path} contains {facts.messages} messages, but none of a camera, signs, commands or a "
                f"robot{_why(self._file)}: there is nothing to report"
            )
        self._stands.end(self._now_s)
        self._reasons.end(self._now_s - self._began_s)
        self._signs.end()
        with self._damage_counted():
            self._take_markers()
        facts.things = self._map.all()
        facts.duration_s = self._now_s - self._began_s
        self._robot.end()
        self._describe()
        self._tell_problems()
        return facts

    def _handler(self, recorded: Recorded) -> Callable[[Recorded, float], None] | None:
        """Return what reads the messages of a topic; None if nothing does."""
        topic, kind = recorded.topic, recorded.type.rpartition("/")[2]
        if topic.endswith(journal_topic(_CONTROL).name):
            return self._on_spin
        if kind in ("Image", "CompressedImage"):
            is_camera = IMAGE_RAW.name in topic or "annotated" not in topic
            return self._on_frame if is_camera and self._is_first("camera", topic) else None
        if kind in ("Twist", "TwistStamped"):
            return self._on_steering if topic.endswith(STEERING_CMD_VEL.name) else self._on_command
        if kind == "Odometry":
            return self._on_odometry if self._is_first(kind, topic) else None
        endings = {
            HAND_SIGN.name: ("String", self._on_sign),
            GESTURE_JOY.name: ("Joy", lambda joy, time_s: self._reasons.note_joystick(time_s, joy.message)),
            JOY.name: ("Joy", lambda joy, time_s: self._reasons.note_gamepad(time_s, joy.message)),
            STOP.name: ("Bool", self._on_stop),
            STOPPED.name: ("Bool", self._on_stopped),
            WORLD_MARKERS.name: ("MarkerArray", self._on_markers),
            DIAGNOSTICS.name: ("DiagnosticArray", self._on_diagnostics),
            CAMERA_INFO.name: ("CameraInfo", self._on_camera_info),
            AUDIT.name: ("Log", self._on_event),
        }
        return next((handle for end, (of, handle) in endings.items() if of == kind and topic.endswith(end)), None)

    def _is_first(self, what: str, topic: str) -> bool:
        return self._first_of.setdefault(what, topic) == topic

    def _on_frame(self, recorded: Recorded, time_s: float) -> None:
        self._facts.frames += 1
        self._stands.note_frame(recorded)

    def _on_camera_info(self, recorded: Recorded, time_s: float) -> None:
        if self._facts.size is None:
            message = recorded.message
            self._facts.size = (int(message.width), int(message.height))

    def _on_sign(self, recorded: Recorded, time_s: float) -> None:
        self._signs.note(str(recorded.message.data), time_s)
        self._stands.note_sign(recorded.number, self._signs.sign)
        self._reasons.note_sign(time_s, self._signs.sign)

    def _on_steering(self, recorded: Recorded, time_s: float) -> None:
        self._reasons.note_steering(time_s, velocity_in(recorded.message))

    def _on_command(self, recorded: Recorded, time_s: float) -> None:
        velocity = velocity_in(recorded.message)
        if not (abs(velocity.linear_mps) < _LARGEST and abs(velocity.angular_radps) < _LARGEST):
            raise RecordingError(f"a velocity that is not finite: {velocity}")
        self._facts.commands += 1
        self._reasons.note_command(time_s, recorded.topic, velocity)
        self._facts.commanded.add(time_s, velocity.linear_mps, velocity.angular_radps)
        self._robot.note_command(time_s, velocity)
        self._stands.note_command(recorded.time_s, velocity, self._robot.place)

    def _on_odometry(self, recorded: Recorded, time_s: float) -> None:
        self._robot.note_odometry(time_s, recorded.message)

    def _on_stop(self, recorded: Recorded, time_s: float) -> None:
        is_set = bool(recorded.message.data)
        self._facts.stops += is_set and not self._is_set
        self._is_set = is_set
        self._reasons.note_stop(time_s, is_stopped=is_set)

    def _on_stopped(self, recorded: Recorded, time_s: float) -> None:
        if recorded.message.data:  # false on it has no effect
            self._reasons.note_stop(time_s, is_stopped=True)

    def _on_event(self, recorded: Recorded, time_s: float) -> None:
        event = read_event(recorded.message)
        # The page lists each stop with its reason.
        if event and event.code not in ("drives", "stands") and len(self._facts.events) < _MOST_EVENTS:
            self._facts.events.append(Event(time_s, event.who, event.sentence))

    def _on_markers(self, recorded: Recorded, time_s: float) -> None:
        self._markers = recorded
        if recorded.time_s - self._markers_s >= _MARKERS_PERIOD_S:
            self._markers_s = recorded.time_s
            self._take_markers()

    def _take_markers(self) -> None:
        markers, self._markers = self._markers, None
        if markers is not None:
            self._map.note(markers.message)

    def _on_spin(self, recorded: Recorded, time_s: float) -> None:
        self._stands.note_spin(parse_spin(recorded))

    def _on_diagnostics(self, recorded: Recorded, time_s: float) -> None:
        for reported in recorded.message.status:
            status = read_status(reported)
            if isinstance(status, CameraStatus):
                self._facts.camera = self._facts.camera or status.short_name
                self._note_trouble(recorded, status)
            elif isinstance(status, RecognitionStatus):
                self._note_trouble(recorded, status)
                self._signs.note_confidence(time_s, status.seen or NONE, status.confidence)
            elif isinstance(status, ControlStatus):
                self._note_control(status, time_s)
            elif isinstance(status, RobotStatus):
                self._robot.note_status(time_s, status)
                self._note_world(status.world)

    def _note_trouble(self, recorded: Recorded, status: Status) -> None:
        if status.level != OK:
            self._stands.note_trouble(recorded.time_s, status.node, status.message)

    def _note_control(self, status: ControlStatus, time_s: float) -> None:
        self._stands.note_status(status)
        self._reasons.note_status(time_s, status)
        before_s, self._reported_s = self._reported_s, time_s
        if before_s is not None and status.reason is not None and status.reason.is_driving:
            sources = self._facts.sources
            sources[status.source] = sources.get(status.source, 0.0) + min(time_s - before_s, _LONGEST_STATUS_S)

    def _note_world(self, name: str) -> None:
        worlds, name = self._facts.worlds, name[:_LONGEST_NAME]
        if name and worlds[-1:] != [name] and len(worlds) < _MOST_WORLDS:
            worlds.append(name)

    def _describe(self) -> None:
        """Fill in what the metadata contains."""
        facts = self._facts
        facts.began = _moment(facts.about.get("began", ""), self._began_s)
        facts.robot = _parameter(facts.about, "robot", "kind")
        if not facts.worlds and facts.robot == "sim":  # an older recording
            facts.worlds = [_parameter(facts.about, "robot", "world")]
        if not facts.camera:
            facts.camera = _parameter(facts.about, "camera", "source").rstrip("/").rpartition("/")[2]

    def _tell_problems(self) -> None:
        facts, problems = self._facts, self._facts.problems
        if self._file.problem:
            problems.append(self._file.problem)
        missing = sum(numbers.missing for numbers in self._numbers.values()) if "handsteer" in facts.about else 0
        if missing:
            problems.append(f"{missing} messages are missing: the disk was too slow, or a part is damaged")
        if self._unreadable:
            problems.append(f"{self._unreadable} messages are damaged, and were left out")
        for what, is_there in (
            ("pictures", facts.frames),
            ("signs", facts.signs),
            ("commands", facts.commands),
            ("odometry of a robot", len(facts.driven)),
        ):
            if not is_there:
                problems.append(f"it contains no {what}")
        self._explain_latency()

    def _explain_latency(self) -> None:
        facts = self._facts
        if not any(topic.endswith(journal_topic(_CONTROL).name) for topic in self._topics):
            facts.no_latency = "it has no journal, which recordings of handsteer run have"
            facts.problems.append(f"{facts.no_latency}: latencies are unknown")
        elif self._offset_s is None:
            facts.no_latency = "its metadata has no valid clock_offset_s"
            facts.problems.append(f"{facts.no_latency}: latencies are unknown")
            facts.latencies_ms = Curve(2)
        elif self._offset_s == 0.0:
            # Stamps of a real clock are Unix time.
            facts.no_latency = "it was recorded in stepped time, which has no delays"
            facts.latencies_ms = Curve(2)
        elif not len(facts.latencies_ms):
            facts.no_latency = "no command followed from a frame"


def _recorded_rules(about: Mapping[str, str]) -> tuple[ControlConfig | None, JoyConfig | None]:
    """Return the recorded parameters of the control and the gamepad; None if there are none that can be read."""
    try:
        sections = json.loads(about.get("config", "{}"))
        return ControlConfig.model_validate(sections["control"]), JoyConfig.model_validate(sections["joy"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return None, None


def _moment(text: str, began_s: float) -> str:
    """Return in words when a recording began; empty if that is unknown.

    Args:
        text: What its metadata say, in ISO 8601.
        began_s: The stamp of the first message in seconds, which is Unix time unless it is small.
    """
    moment: datetime | None
    try:
        moment = datetime.fromisoformat(text).astimezone(UTC)
    except (ValueError, OverflowError):
        try:
            moment = datetime.fromtimestamp(began_s, UTC) if began_s > _EPOCH_BEGINS_S else None
        except (ValueError, OverflowError, OSError):
            moment = None
    return f"{moment:%Y-%m-%d %H:%M:%S} UTC" if moment else ""


def _parameter(about: dict[str, str], section: str, name: str) -> str:
    """Return a parameter of the recorded configuration, of any version; empty if it is unknown."""
    try:
        return str(json.loads(about.get("config", "{}"))[section][name])
    except (ValueError, KeyError, TypeError, RecursionError):
        return ""
