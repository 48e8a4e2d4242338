"""Computes what the page shows from the topics' messages: pure functions, without page or transport."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from handsteer.config import ControlConfig
from handsteer.control.effects import rule_from_diagnostics
from handsteer.nodes.base import ERROR, OK
from handsteer.robots.course import CourseState, read_course
from handsteer.timeouts import ROBOT_S
from handsteer.types import NONE, SIGNS, ZERO, Pose2D, Velocity

Mood = Literal["driving", "standing", "trouble", "waiting"]

STALE_S = 2.0
"""A node that has not reported for this long counts as silent; the slowest reports twice a second."""

COMMAND_HOLDS_S = ROBOT_S
"""A command expires after this time, as in the robot's controller."""


@dataclass(frozen=True)
class Report:
    """The last report of a node on ``/diagnostics``.

    Attributes:
        level: 0 OK, 1 WARN, 2 ERROR.
        message: A sentence for people.
        values: Named values.
        came_s: Time of arrival in seconds of the graph's clock.
    """

    level: int
    message: str
    values: Mapping[str, str]
    came_s: float

    def number(self, name: str) -> float | None:
        """Return the value of ``name`` if it is a finite number, else None."""
        try:
            number = float(self.values[name])
        except (KeyError, ValueError):
            return None
        return number if math.isfinite(number) else None


Person = Literal["", "you", "another viewer"]
"""A viewer, as seen by one of them; empty if none."""


@dataclass(frozen=True)
class Viewers:
    """The viewers' activity, as seen by one of them.

    Attributes:
        steers: The viewer who steers.
        stopped: The viewer who pressed Stop last.
        may_reset: Whether this viewer may reset Stop.
        topic: The topic of steering that bypasses the control; empty otherwise.
        stands: Whether steering is disabled by Stop; used if no control reports Stop.
    """

    steers: Person = ""
    stopped: Person = ""
    may_reset: bool = True
    topic: str = ""
    stands: bool = False


NOBODY = Viewers()


@dataclass(frozen=True)
class Observed:
    """The newest of everything that the page shows in figures.

    Attributes:
        reports: By node name.
        command: The last velocity command.
        command_came_s: Its time of arrival in seconds of the graph's clock.
        measured: The velocity from odometry.
        frame_counts: Times and frame counters of the camera's last reports, oldest first.
    """

    reports: Mapping[str, Report] = field(default_factory=dict)
    command: Velocity = ZERO
    command_came_s: float = -math.inf
    measured: Velocity = ZERO
    frame_counts: Sequence[tuple[float, float]] = ()


@dataclass(frozen=True)
class PageState:
    """Everything that the page shows as text and figures.

    Attributes:
        mood: Selects the colour of the banner.
        headline: What the robot does, in one or two words.
        reason: Why it does so.
        sign: The confirmed sign.
        seen: The sign in the newest frame alone.
        confidence: Of ``seen``, 0 to 1.
        handedness: ``Left``, ``Right`` or empty.
        signs: The signs that can be recognised, as last reported.
        rule: Configures the signs' actions, as last reported by the control; None if unknown.
        no_picture: Why there are no pictures; empty if there are.
        camera: Short name of the camera.
        driver: The active input: ``signs``, ``steering`` or ``nobody``.
        stopped: Whether the robot is stopped until reset.
        commanded: The commanded velocity, zero without a command.
        measured: The velocity from odometry.
        latency_median_ms: Latency from capture to command; None if unknown.
        latency_p99_ms: 99th percentile of the same.
        fps: Frame rate of the camera in Hz; None if unknown.
        path_length_m: Distance driven; None if not reported.
        collisions: Number of collisions with obstacles; None if not reported.
        confirmed: Progress of confirming ``seen``, 0 to 1 (confirmed).
        viewers: The viewers' activity.
        max_linear_mps: Speed limit of the control, either way; None if not reported.
        max_angular_radps: Likewise, for turning.
        course: Progress on the world's course; None without one.
        warnings: Problems that do not stop operation, such as two nodes that command one robot; a sentence each.
    """

    mood: Mood
    headline: str
    reason: str
    sign: str
    seen: str
    confidence: float
    handedness: str
    signs: tuple[str, ...]
    rule: ControlConfig | None
    no_picture: str
    camera: str
    driver: str
    stopped: bool
    commanded: Velocity
    measured: Velocity
    latency_median_ms: float | None
    latency_p99_ms: float | None
    fps: float | None
    path_length_m: float | None
    collisions: int | None
    confirmed: float
    viewers: Viewers
    max_linear_mps: float | None
    max_angular_radps: float | None
    course: CourseState | None = None
    warnings: tuple[str, ...] = ()


def compose(observed: Observed, now_s: float, viewers: Viewers = NOBODY) -> PageState:
    """Return the page's state at ``now_s``, in seconds of the graph's clock, as one of its ``viewers`` sees it."""
    reports = {name: report for name, report in observed.reports.items() if now_s - report.came_s < STALE_S}
    seen = reports.get("hand_sign_recognition", _NO_REPORT)
    control = reports.get("hand_sign_control", _NO_REPORT)
    robot = reports.get("robot", _NO_REPORT)
    camera = reports.get("my_camera", _NO_REPORT)
    mood, headline, reason = explain(reports, viewers)
    collisions = robot.number("collisions")
    return PageState(
        mood=mood,
        headline=headline,
        reason=reason,
        sign=seen.values.get("sign", NONE),
        seen=seen.values.get("seen", NONE),
        confidence=seen.number("confidence") or 0.0,
        handedness=seen.values.get("handedness", ""),
        signs=known_signs(observed.reports.get("hand_sign_recognition", _NO_REPORT).values),
        rule=rule_from_diagnostics(observed.reports.get("hand_sign_control", _NO_REPORT).values),
        no_picture="" if "seen" in seen.values else camera.message if camera.level >= ERROR else seen.message,
        camera=camera_name(camera.message),
        driver=control.values.get("source", "nobody"),
        stopped=is_stopped(reports.get("hand_sign_control"), viewers),
        commanded=observed.command if now_s - observed.command_came_s < COMMAND_HOLDS_S else ZERO,
        measured=observed.measured,
        latency_median_ms=control.number("latency_median_ms") or None,
        latency_p99_ms=control.number("latency_p99_ms") or None,
        fps=frame_rate(observed.frame_counts, now_s),
        path_length_m=robot.number("path_length_m"),
        collisions=None if collisions is None else int(collisions),
        confirmed=confirmed(seen),
        viewers=viewers,
        max_linear_mps=control.number("max_linear") or None,
        max_angular_radps=control.number("max_angular") or None,
        course=read_course(robot.values),
        warnings=warnings_in(reports),
    )


def warnings_in(reports: Mapping[str, Report]) -> tuple[str, ...]:
    """Return the warnings in the nodes' reports, each sentence once."""
    said = (report.values.get("warning", "") for report in reports.values())
    return tuple(dict.fromkeys(warning for warning in said if warning))


def is_stopped(control: Report | None, viewers: Viewers) -> bool:
    """Return whether the robot is stopped until reset, as ``control`` or the steering that bypasses it reports."""
    says_so = control is not None and control.values.get("stopped") == str(True)
    return says_so or (viewers.stands and (control is None or bool(viewers.topic)))


def confirmed(recognition: Report) -> float:
    """Return the progress of confirming the sign that ``recognition`` reports, 0 to 1."""
    seen = recognition.values.get("seen", NONE)
    if seen == NONE:
        return 0.0
    if seen == recognition.values.get("sign"):
        return 1.0
    return max(0.0, min(recognition.number("progress") or 0.0, 1.0))


def explain(reports: Mapping[str, Report], viewers: Viewers = NOBODY) -> tuple[Mood, str, str]:
    """Return in words what the robot does and why: mood, headline, reason.

    The control reports whether the robot is commanded to move. If it is not, because no sign is confirmed, the reason
    lies upstream: the camera gives no picture, no hand is in view, or the hand shows no sign.

    Args:
        reports: The reports of nodes that are not silent, by node name.
        viewers: The viewers' activity, which the control does not know.
    """
    if viewers.topic and viewers.steers:
        return "driving", "Driving", f"steered by hand, straight on {viewers.topic}"
    control = reports.get("hand_sign_control")
    stopped = is_stopped(control, viewers)
    if control is None and not stopped:
        return "waiting", "Waiting", "the node hand_sign_control does not report"
    robot = reports.get("robot", _NO_REPORT)
    if robot.level >= ERROR:
        return "trouble", "Trouble", f"the robot {robot.message}"
    if control is None or stopped:
        by = f"stopped by {viewers.stopped}" if viewers.stopped else "stopped"
        return "trouble", "Stopped", f"{by}, until {'you reset' if viewers.may_reset else 'the driver resets'} it"
    reason = control.message.partition(": ")[2] or control.message
    if control.number("linear_mps") or control.number("angular_radps"):
        return "driving", "Driving", reason if robot.level == OK else f"{reason}, but the robot {robot.message}"
    steered = control.values.get("source") == "steering"
    mood, obstacle = ("standing", None) if steered else _why_no_sign(reports)
    if control.values.get("armed") == str(False) and "seen" in reports.get("hand_sign_recognition", _NO_REPORT).values:
        obstacle = None  # the robot waits for no sign to be seen
    return mood, "Standing", obstacle or reason


def _why_no_sign(reports: Mapping[str, Report]) -> tuple[Mood, str | None]:
    camera = reports.get("my_camera", _NO_REPORT)
    if camera.level >= ERROR:
        return "trouble", camera.message
    recognition = reports.get("hand_sign_recognition")
    if recognition is None:
        return "trouble", "the node hand_sign_recognition does not report"
    return "standing", recognition.message if recognition.values.get("sign") == NONE else None


def camera_name(message: str) -> str:
    """Return the camera's name from its ``message``, without folders or address, which may contain a password."""
    return message.partition(": ")[0].rstrip("/").rpartition("/")[2]


def known_signs(values: Mapping[str, str]) -> tuple[str, ...]:
    """Return the signs in a report of the recognition; the shipped ones if it has none."""
    try:
        names = json.loads(values["signs"])
    except (KeyError, ValueError):
        return SIGNS
    return tuple(str(name) for name in names) if isinstance(names, list) and names else SIGNS


def frame_rate(counts: Sequence[tuple[float, float]], now_s: float) -> float | None:
    """Return the frame rate in Hz from times and frame counters, oldest first; None if unknown.

    0 if the last counter is older than :data:`STALE_S`.
    """
    if len(counts) < 2:
        return None
    (first_s, first), (last_s, last) = counts[0], counts[-1]
    if now_s - last_s > STALE_S:
        return 0.0
    return (last - first) / (last_s - first_s) if last_s > first_s and last >= first else None


def place_in_world(truth: Pose2D, odometry_then: Pose2D, odometry_now: Pose2D) -> Pose2D:
    """Return the robot's current pose in the world: ``truth``, moved by the odometry since.

    These are the transforms ``map`` to ``odom`` to ``base_link`` of REP 105: the step is rotated from the odometry
    frame, which drifts, into the world. ``odometry_then`` is of the same time as ``truth``.
    """
    turn = truth.yaw - odometry_then.yaw
    dx, dy = odometry_now.x - odometry_then.x, odometry_now.y - odometry_then.y
    return Pose2D(
        truth.x + math.cos(turn) * dx - math.sin(turn) * dy,
        truth.y + math.sin(turn) * dx + math.cos(turn) * dy,
        odometry_now.yaw + turn,
    )


_NO_REPORT = Report(OK, "no report yet", {}, -math.inf)
