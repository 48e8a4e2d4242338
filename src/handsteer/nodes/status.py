"""What each node reports about itself: dataclasses with the sentences for people; ``diagnostics`` publishes them."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from handsteer.config import ControlConfig
from handsteer.control import Source
from handsteer.control.explain import Reason, warned
from handsteer.types import NONE, CourseState, Handedness, Pose2D, describe_seen

OK, WARN, ERROR = 0, 1, 2
"""Levels of ``diagnostic_msgs/DiagnosticStatus``."""

_SHORTLY_S = 3.0


class Status:
    """The state of a node; a subclass is a dataclass with the values.

    Attributes:
        node: Name of the node.
    """

    node: ClassVar[str]

    @property
    def level(self) -> int:
        """OK, WARN or ERROR."""
        return OK

    @property
    def message(self) -> str:
        """A sentence for people."""
        raise NotImplementedError


@dataclass(frozen=True)
class CameraStatus(Status):
    """The state of ``my_camera``.

    Attributes:
        camera: Name of the camera: ``webcam 0``, a path or an address.
        state: ``silent`` if it delivers nothing, ``frozen`` if the same picture, ``lost`` if it cannot be read.
        since_s: For how long it has been silent or frozen, in seconds.
        problem: Why it is lost.
        frames: Number of frames published.
    """

    node: ClassVar[str] = "my_camera"

    camera: str = ""
    state: Literal["waiting", "delivers", "silent", "frozen", "lost"] = "waiting"
    since_s: float = 0.0
    problem: str = ""
    frames: int = 0

    @property
    def level(self) -> int:
        """ERROR if there is no picture although the camera is open, or should be."""
        return ERROR if self.state in ("frozen", "lost") else OK

    @property
    def message(self) -> str:
        """A sentence for people."""
        if self.state == "lost":
            return self.problem
        words = {
            "waiting": "waiting for the first frame",
            "delivers": "delivers frames",
            "silent": f"no frame for {self.since_s:.0f} s",
            "frozen": f"frozen, the same picture for {self.since_s:.1f} s",
        }
        return f"{self.camera}: {words[self.state]}"

    @property
    def short_name(self) -> str:
        """The camera's name without folders or address."""
        return self.camera.rstrip("/").rpartition("/")[2]


@dataclass(frozen=True)
class RecognitionStatus(Status):
    """The state of ``hand_sign_recognition``.

    Attributes:
        sign: The confirmed sign.
        signs: The signs that can be recognised.
        seen: The sign in the newest frame alone; None without frames.
        confidence: Of ``seen``, 0 to 1.
        confidences: Of each of ``signs`` in the newest frame, 0 to 1, in the same order; empty without a hand.
        min_confidence: The smallest confidence that counts.
        progress: Progress of confirming ``seen``, 0 to 1.
        engage_progress: Progress of the gesture that engages, 0 to 1; 0 where nothing asks for it.
        handedness: Of the active hand; empty if there is none.
        no_hand_s: Time since a hand was seen; None if one is in view, or none was seen yet.
        no_frame_s: Time since the last frame; None if there are frames, even if they are refused.
        refused: Why frames are, or were, refused.
        processing_ms: Median time of processing a frame.
        processing_p99_ms: 99th percentile of the same.
        recording: Whether frames are followed as a recording's.
        frame_age_ms: Age of the last frame.
        clock_ahead_ms: By how much the camera's clock is ahead, at least.
        sides_swapped: Whether left and right of the frames are swapped, so that the annotated picture is not mirrored.
    """

    node: ClassVar[str] = "hand_sign_recognition"

    sign: str = NONE
    signs: tuple[str, ...] = ()
    seen: str | None = None
    confidence: float = 0.0
    confidences: tuple[float, ...] = ()
    min_confidence: float | None = None
    progress: float = 0.0
    engage_progress: float = 0.0
    handedness: Handedness | Literal[""] = ""
    no_hand_s: float | None = None
    no_frame_s: float | None = None
    refused: str = ""
    processing_ms: float | None = None
    processing_p99_ms: float | None = None
    recording: bool | None = None
    frame_age_ms: float | None = None
    clock_ahead_ms: float | None = None
    sides_swapped: bool = False

    @property
    def level(self) -> int:
        """WARN without frames that can be used."""
        return WARN if self.seen is None else OK

    @property
    def message(self) -> str:
        """A sentence for people."""
        if self.seen is None and self.no_frame_s is None:
            return self.refused or "no frame yet"
        if self.no_frame_s is not None:
            return f"no frame for {self.no_frame_s:.1f} s{f'; before: {self.refused}' if self.refused else ''}"
        if self.no_hand_s is not None:
            # Tenths matter only for a hand that was lost just now.
            return f"no hand seen for {self.no_hand_s:.{1 if self.no_hand_s < _SHORTLY_S else 0}f} s"
        return describe_seen(self.sign, self.seen or NONE, is_hand_in_view=bool(self.handedness))


@dataclass(frozen=True)
class ControlStatus(Status):
    """The state of ``hand_sign_control``.

    Attributes:
        reason: Why the robot is commanded to drive, or to stand.
        source: The active input.
        stopped: Whether the robot is stopped until reset.
        armed: Whether signs count; otherwise they must show neutral first.
        engaged: Whether the hand drives; otherwise it must engage first.
        engage_progress: Progress of engaging, 0 to 1.
        linear_mps: Commanded forward velocity.
        angular_radps: Commanded angular velocity, left positive.
        moving: Whether the robot is measured to move; None if it is unknown.
        renew_s: Seconds until the robot stops unless what drives changes; None if that is not soon.
        robot: The selected one of several robots; None if there is one.
        blind: Whether laser scans are required and missing.
        obstacle_m: Distance of the obstacle that limits the robot; None if none does.
        warning: A problem that does not stop operation; None if there is none.
        latency_median_ms: From the capture of a frame to the command; None if unknown.
        latency_p99_ms: 99th percentile of the same.
        rule: The parameters that can change, each under its own name; an action as ``actions.Peace``.
    """

    node: ClassVar[str] = "hand_sign_control"

    reason: Reason | None = None
    source: Source = "none"
    stopped: bool = False
    armed: bool = True
    engaged: bool = True
    engage_progress: float = 1.0
    linear_mps: float = 0.0
    angular_radps: float = 0.0
    moving: bool | None = None
    renew_s: int | None = None
    robot: str | None = None
    blind: bool = False
    obstacle_m: float | None = None
    warning: str | None = None
    latency_median_ms: float | None = None
    latency_p99_ms: float | None = None
    rule: ControlConfig | None = None

    @property
    def level(self) -> int:
        """WARN with a warning, or if nothing may move without scans."""
        return WARN if self.warning or self.blind else OK

    @property
    def message(self) -> str:
        """A sentence for people."""
        if self.reason is None:
            return "gives no reason"
        return f"{self.reason.state(is_moving=bool(self.moving))}: {self.explanation}"

    @property
    def explanation(self) -> str:
        """The message without what the robot does."""
        return warned(self.reason.explanation, self.renew_s) if self.reason else self.message


@dataclass(frozen=True)
class RobotStatus(Status):
    """The state of ``robot``.

    Attributes:
        collisions: Number of collisions with obstacles; None for a real robot.
        path_length_m: Distance driven.
        truth: Actual pose in the world; None if unknown.
        course: Progress on its world's course; None without one.
        world: Name of its world; empty for a real robot.
        warning: A problem that does not stop operation; None if there is none.
        trouble: What is wrong, to be read after "the robot"; empty if nothing is.
        touches: Names of the obstacles that it touches.
        no_command_s: Time since the last command, if that was to drive and has expired; else None.
    """

    node: ClassVar[str] = "robot"

    collisions: int | None = None
    path_length_m: float | None = None
    truth: Pose2D | None = None
    course: CourseState | None = None
    world: str = ""
    warning: str | None = None
    trouble: str = ""
    touches: tuple[str, ...] = ()
    no_command_s: float | None = None

    @property
    def level(self) -> int:
        """ERROR in trouble, WARN if something else limits it."""
        if self.trouble:
            return ERROR
        return WARN if self.touches or self.no_command_s is not None or self.warning else OK

    @property
    def message(self) -> str:
        """A sentence for people, to be read after "the robot"."""
        if self.trouble:
            return self.trouble
        if self.touches:
            return f"touches {', '.join(self.touches)}"
        if self.no_command_s is not None:
            return f"standing: no command for {self.no_command_s:.1f} s, and the last one was to drive"
        return "is commanded by more than one node" if self.warning else "moves freely"
