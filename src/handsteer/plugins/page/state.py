"""Computes what the page shows from the topics' messages: pure functions, without page or transport."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from handsteer.config import ControlConfig
from handsteer.control.explain import Reason
from handsteer.nodes.status import ERROR, OK, ControlStatus, RecognitionStatus, RobotStatus
from handsteer.plugins.page.observed import NO_VIEWERS, STALE_S, Observed, Reporting, Viewers, caught_up
from handsteer.timeouts import ROBOT_S
from handsteer.types import NONE, SIGNS, ZERO, Velocity

Mood = Literal["driving", "standing", "trouble", "waiting"]

COMMAND_HOLDS_S = ROBOT_S
"""A command expires after this time, as in the robot's controller."""

_LASTING_S: Final = 1.0
_WITHOUT_FRAMES: Final = "connect the camera again, or choose another"
_UNHEARD: Final = "Stop is sent, but the node hand_sign_control does not report: the robot may still drive"


@dataclass(frozen=True)
class PageState:
    """Everything that the page shows as text and figures.

    Attributes:
        mood: Selects the colour of the banner.
        headline: What the robot does, in one or two words.
        reason: Why it does so.
        recognition: The recognition's status, its defaults while it is silent.
        control: The control's status, likewise.
        robot: The robot's status, likewise.
        seen: The sign in the newest frame alone.
        signs: The signs that can be recognised, as last reported.
        rule: Configures the signs' actions, as last reported by the control; None if unknown.
        no_picture: Why there are no pictures; empty if there are.
        camera: Short name of the camera.
        stopped: Whether the robot is stopped until reset.
        unheard: Whether Stop was pressed, and no control reports whether the robot obeys it.
        commanded: The commanded velocity, zero without a command.
        measured: The velocity from odometry.
        fps: Frame rate of the camera in Hz; None if unknown.
        confirmed: Progress of confirming ``seen``, 0 to 1 (confirmed).
        viewers: The viewers' activity.
        engaging: Progress of engaging the hand, 0 to 1; None if it is engaged, or cannot be.
        engages_by_gesture: Whether it engages by opening, closing and opening; otherwise by an open palm that is held.
        sides_swapped: Whether the picture is as the camera sees it, because recognition swaps left and right.
        warnings: Problems that do not stop operation, such as two nodes that command one robot; a sentence each.
    """

    mood: Mood
    headline: str
    reason: str
    recognition: RecognitionStatus
    control: ControlStatus
    robot: RobotStatus
    seen: str
    signs: tuple[str, ...]
    rule: ControlConfig | None
    no_picture: str
    camera: str
    stopped: bool
    unheard: bool
    commanded: Velocity
    measured: Velocity
    fps: float | None
    confirmed: float
    viewers: Viewers
    engaging: float | None
    engages_by_gesture: bool
    warnings: tuple[str, ...]
    sides_swapped: bool

    @property
    def is_joystick(self) -> bool:
        """Whether the hand is a joystick instead of showing signs."""
        return self.rule is not None and self.rule.mode == "joystick"


def compose(observed: Observed, now_s: float, viewers: Viewers = NO_VIEWERS) -> PageState:
    """Return the page's state at ``now_s``, in seconds of the graph's clock, as one of its ``viewers`` sees it."""
    reporting = caught_up(Reporting.at(now_s, observed), observed)
    recognition, control = reporting.recognition or RecognitionStatus(), reporting.control or ControlStatus()
    robot = reporting.robot or RobotStatus()
    mood, headline, reason = explain(reporting, viewers, is_moving=observed.is_moving(now_s))
    # What was last known of a node that has fallen silent.
    stopped = is_stopped(reporting.control, viewers)
    last_seen, last_control = observed.last(RecognitionStatus), observed.last(ControlStatus)
    return PageState(
        mood=mood,
        headline=headline,
        reason=reason,
        recognition=recognition,
        control=control,
        robot=robot,
        seen=recognition.seen or NONE,
        signs=(last_seen and last_seen.signs) or SIGNS,
        rule=last_control.rule if last_control else None,
        no_picture=why_no_picture(reporting),
        camera=reporting.camera.short_name if reporting.camera else "",
        stopped=stopped,
        unheard=is_unheard(reporting.control, viewers),
        commanded=observed.command if now_s - observed.command_came_s < COMMAND_HOLDS_S else ZERO,
        measured=observed.measured,
        fps=frame_rate(observed.frame_counts, now_s),
        confirmed=confirmed(recognition),
        viewers=viewers,
        engaging=None if control.engaged or stopped else engaging(recognition, control),
        engages_by_gesture=last_control is None
        or last_control.rule is None
        or last_control.rule.engage_by == "gesture",
        sides_swapped=last_seen is not None and last_seen.sides_swapped,
        warnings=tuple(dict.fromkeys(warning for warning in (control.warning, robot.warning) if warning)),
    )


def why_no_picture(reporting: Reporting) -> str:
    """Return why there are no pictures; empty if there are."""
    camera, recognition = reporting.camera, reporting.recognition
    if recognition is not None and recognition.seen is not None:
        return ""
    if camera is not None and camera.level >= ERROR:
        return camera.message
    return "no report yet" if recognition is None else _what_recognition_says(recognition)


def is_stopped(control: ControlStatus | None, viewers: Viewers) -> bool:
    """Return whether the robot is stopped until reset, as ``control`` or the steering that bypasses it reports."""
    is_reported = control is not None and control.stopped
    return is_reported or (viewers.stands and (control is None or bool(viewers.topic)))


def is_unheard(control: ControlStatus | None, viewers: Viewers) -> bool:
    """Return whether Stop was pressed, and no control reports whether the robot obeys it, as where the link is cut."""
    return viewers.stands and control is None and not viewers.topic


def confirmed(recognition: RecognitionStatus) -> float:
    """Return the progress of confirming the sign that ``recognition`` reports, 0 to 1."""
    if recognition.seen in (None, NONE):
        return 0.0
    if recognition.seen == recognition.sign:
        return 1.0
    return max(0.0, min(recognition.progress, 1.0))


def engaging(recognition: RecognitionStatus, control: ControlStatus) -> float:
    """Return the progress of engaging, 0 to 1, of the gesture or of the open palm that is held."""
    return max(0.0, min(max(recognition.engage_progress, control.engage_progress), 1.0))


def explain(reporting: Reporting, viewers: Viewers = NO_VIEWERS, *, is_moving: bool = False) -> tuple[Mood, str, str]:
    """Return in words what the robot does and why: mood, headline, reason.

    The control reports whether the robot is commanded to move. If it is not, because no sign is confirmed, the reason
    lies upstream: the camera gives no picture, no hand is in view, or the hand shows no sign.
    """
    if viewers.steers and (by_hand := _explain_steering(reporting, viewers, is_moving=is_moving)):
        return by_hand
    control, robot = reporting.control, reporting.robot or RobotStatus()
    stopped = is_stopped(control, viewers)
    if control is None and (not stopped or is_unheard(control, viewers)):
        return _explain_silence(stopped=stopped)
    if robot.level >= ERROR:
        return "trouble", "Trouble", f"the robot {robot.message}"
    if control is None or stopped:
        by = f"for {viewers.stopped_for}, " if viewers.stopped_for else f"by {viewers.stopped}, "
        by = by if viewers.stopped_for or viewers.stopped else ""
        return (
            "trouble",
            "Stopping" if is_moving else "Stopped",
            f"{by}until {'you reset' if viewers.may_reset else 'the driver resets'} it",
        )
    reason = control.explanation
    if control.linear_mps or control.angular_radps:
        return "driving", "Driving", reason if robot.level == OK else f"{reason}, but the robot {robot.message}"
    mood, upstream = _why_standing(control, reporting)
    # What lies upstream is why it stands, whatever the control waits for.
    state = control.reason.state() if control.reason and not upstream else "standing"
    return mood, "Stopping" if is_moving else state.capitalize(), upstream or reason


def _explain_silence(*, stopped: bool) -> tuple[Mood, str, str]:
    if stopped:
        return "trouble", "Trouble", _UNHEARD
    return "waiting", "Waiting", "the node hand_sign_control does not report"


def _explain_steering(reporting: Reporting, viewers: Viewers, *, is_moving: bool) -> tuple[Mood, str, str] | None:
    """Return what only the page's own steering knows, in place of what the control reports."""
    if viewers.waits and not is_stopped(reporting.control, viewers):
        return "standing", "Stopping" if is_moving else "Standing", Reason("steering_disarmed").explanation
    return ("driving", "Driving", f"steered straight on {viewers.topic}") if viewers.topic else None


def _why_standing(control: ControlStatus, reporting: Reporting) -> tuple[Mood, str | None]:
    mood, upstream = ("standing", None) if control.source == "steering" else _why_no_sign(reporting)
    is_about_signs = control.armed and control.engaged and control.source != "joystick"
    if not is_about_signs and reporting.recognition is not None and reporting.recognition.seen is not None:
        upstream = None
    return mood, upstream


def _why_no_sign(reporting: Reporting) -> tuple[Mood, str | None]:
    if reporting.camera is not None and reporting.camera.level >= ERROR:
        return "trouble", reporting.camera.message
    if reporting.recognition is None:
        return "trouble", "the node hand_sign_recognition does not report"
    return "standing", _what_recognition_says(reporting.recognition) if reporting.recognition.sign == NONE else None


def _what_recognition_says(recognition: RecognitionStatus) -> str:
    is_lasting = recognition.no_frame_s is not None and recognition.no_frame_s >= _LASTING_S
    return (
        f"{recognition.message}: {_WITHOUT_FRAMES}" if is_lasting and not recognition.refused else recognition.message
    )


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
