"""What the page says, worked out of what the topics said: pure functions, no page and no transport."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from handsteer.config import ControlConfig
from handsteer.control.effects import rule_from_diagnostics
from handsteer.nodes.node import ERROR, OK
from handsteer.robots.course import CourseState, read_course
from handsteer.timeouts import ROBOT_S
from handsteer.types import NONE, SIGNS, ZERO, Pose2D, Velocity

Mood = Literal["driving", "standing", "trouble", "waiting"]

STALE_S = 2.0
"""A node that has not reported for this long counts as silent; the slowest reports twice a second."""

COMMAND_HOLDS_S = ROBOT_S
"""A command counts for this long, as in the robot's controller; then nothing is commanded."""


@dataclass(frozen=True)
class Report:
    """What a node last said of itself on ``/diagnostics``.

    Attributes:
        level: 0 OK, 1 WARN, 2 ERROR.
        message: A sentence for people.
        values: Named values.
        came_s: When it came, in seconds of the graph's clock.
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
"""Who of the viewers did it, for the one who is told; empty when none of them did."""


@dataclass(frozen=True)
class Viewers:
    """What the viewers of the page do, as one of them is told.

    Attributes:
        steers: Who steers by hand on the page.
        stopped: Who pressed Stop last, on the page.
        may_reset: Whether the one who is told may reset it.
        topic: Where the steering goes past control; empty where it does not.
        stands: Whether the steering stands because the robot was stopped; counts where no control says so.
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
        reports: By name of node.
        command: The last velocity command.
        command_came_s: When it came, in seconds of the graph's clock.
        measured: The velocity that odometry says.
        frame_counts: Times and frame counters of the camera's last reports, oldest first.
    """

    reports: Mapping[str, Report] = field(default_factory=dict)
    command: Velocity = ZERO
    command_came_s: float = -math.inf
    measured: Velocity = ZERO
    frame_counts: Sequence[tuple[float, float]] = ()


@dataclass(frozen=True)
class PageState:
    """Everything that the page shows in words and figures.

    Attributes:
        mood: What colour the sentence has.
        headline: One or two words: what the robot does.
        reason: The rest of the sentence: what makes it do so.
        sign: The sign that counts.
        seen: The sign that the newest frame alone shows.
        confidence: 0 to 1, how sure ``seen`` is.
        handedness: ``Left``, ``Right`` or empty.
        signs: Those that the recogniser can tell, as it last said.
        rule: What decides what signs do, as the control last said; None when it has not.
        no_picture: Why no pictures come; empty when they come.
        camera: Short name of the camera.
        driver: Who drives: ``signs``, ``steering`` or ``nobody``.
        stopped: Whether somebody has stopped the robot until it is reset.
        commanded: The velocity that the robot is told, zero when it is told nothing.
        measured: The velocity that odometry says.
        latency_median_ms: From capture to command; None when not known yet.
        latency_p99_ms: Likewise, 99 of 100 were faster.
        fps: Frames a second of the camera; None when not known yet.
        path_length_m: How far the robot has gone; None when it does not say.
        collisions: How often it has begun to touch an obstacle; None when it does not say.
        confirmed: 0 to 1, how far ``seen`` is on its way to count; 1 when it counts.
        viewers: What the viewers of the page do.
        max_linear_mps: The highest speed that control lets through, either way; None when it does not say.
        max_angular_radps: Likewise, for turning.
        course: How far it is on the course of its world; None where there is none.
        warnings: What is amiss though everything goes on, a sentence each, as two nodes that command one robot.
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
    """Return what the page says at ``now_s``, in seconds of the graph's clock, to one of its ``viewers``."""
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
    """Return what nodes report as a warning of its own, each sentence once."""
    said = (report.values.get("warning", "") for report in reports.values())
    return tuple(dict.fromkeys(warning for warning in said if warning))


def is_stopped(control: Report | None, viewers: Viewers) -> bool:
    """Return whether the robot is stopped until it is reset, by what ``control`` reports, or the steering past it."""
    says_so = control is not None and control.values.get("stopped") == str(True)
    return says_so or (viewers.stands and (control is None or bool(viewers.topic)))


def confirmed(recognition: Report) -> float:
    """Return how far the sign that ``recognition`` sees is on its way to count, 0 to 1."""
    seen = recognition.values.get("seen", NONE)
    if seen == NONE:
        return 0.0
    if seen == recognition.values.get("sign"):
        return 1.0
    return max(0.0, min(recognition.number("progress") or 0.0, 1.0))


def explain(reports: Mapping[str, Report], viewers: Viewers = NOBODY) -> tuple[Mood, str, str]:
    """Return in words what the robot does and why: mood, headline, reason.

    Control knows whether the robot is told to move. When it is not, because no sign counts, the reason lies further
    up: the camera gives no picture, no hand is in view, or the hand shows no sign.

    Args:
        reports: The reports of the nodes that are not silent, by name of node.
        viewers: What the viewers of the page do, of which control does not know.
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
        obstacle = None  # that no sign is seen is what it waits for
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
    """Return the name of the camera in its ``message``: no folders, and no address, which may hold a password."""
    return message.partition(": ")[0].rstrip("/").rpartition("/")[2]


def known_signs(values: Mapping[str, str]) -> tuple[str, ...]:
    """Return the signs that a report of the recogniser names; those that are shipped when it names none."""
    try:
        names = json.loads(values["signs"])
    except (KeyError, ValueError):
        return SIGNS
    return tuple(str(name) for name in names) if isinstance(names, list) and names else SIGNS


def frame_rate(counts: Sequence[tuple[float, float]], now_s: float) -> float | None:
    """Return frames a second from times and frame counters, oldest first; None when that cannot be told.

    A counter that has not come for :data:`STALE_S` gives 0.
    """
    if len(counts) < 2:
        return None
    (first_s, first), (last_s, last) = counts[0], counts[-1]
    if now_s - last_s > STALE_S:
        return 0.0
    return (last - first) / (last_s - first_s) if last_s > first_s and last >= first else None


def place_in_world(truth: Pose2D, odometry_then: Pose2D, odometry_now: Pose2D) -> Pose2D:
    """Return where the robot is in the world now, from a true pose of a moment ago and what the wheels counted since.

    This is REP 105's ``map`` to ``odom`` to ``base_link``: the step is turned from the frame of odometry, which drifts,
    into the world.

    Args:
        truth: The true pose when odometry said ``odometry_then``.
        odometry_then: Odometry at that moment.
        odometry_now: Odometry now.
    """
    turn = truth.yaw - odometry_then.yaw
    dx, dy = odometry_now.x - odometry_then.x, odometry_now.y - odometry_then.y
    return Pose2D(
        truth.x + math.cos(turn) * dx - math.sin(turn) * dy,
        truth.y + math.sin(turn) * dx + math.cos(turn) * dy,
        odometry_now.yaw + turn,
    )


_NO_REPORT = Report(OK, "no report yet", {}, -math.inf)
