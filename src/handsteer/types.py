"""Basic types of the whole project: signs and their actions, velocities, poses, a course's progress.

Imports nothing of handsteer.

Signs are named from the user's own point of view. Axes and units follow REP 103: x forward, y left, a left turn is
positive; metres, radians, seconds.
"""

import math
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

Handedness = Literal["Left", "Right"]
"""The person's hand."""

CmdVelType = Literal["auto", "twist", "twist_stamped"]
"""Type of velocity commands: geometry_msgs/Twist, geometry_msgs/TwistStamped, or the one the robot subscribes to."""

Phase = Literal["ready", "running", "finished"]
"""Of a course."""

BUMP_S = 2.0
"""Penalty for each bump."""

MISS_S = 10.0
"""Penalty for each missed gate."""

STOP = "Stop"
FORWARD = "Forward"
BACKWARD = "Backward"
TURN_RIGHT = "Turn Right"
TURN_LEFT = "Turn Left"
GO = "Go"
NONE = "NONE"
"""No hand, or a hand that shows none of the signs."""

SIGNS = (STOP, FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT, GO)
LONGEST_SIGN = 100
"""Longer words, in characters, are not names of signs."""
MOTION_SIGNS = frozenset({FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT})
"""The signs that can make a robot move."""


def find_sign(name: str, known: Iterable[str]) -> str | None:
    """Return the sign of ``known`` that ``name`` means; None if there is none.

    Case, spaces, ``_`` and ``-`` are ignored: ``TurnRight``, ``turn_right`` and ``turn right`` all mean ``Turn Right``.
    So are Unicode forms: an accent may be part of its letter or follow it, and letters may have full width.
    """
    bare = bare_sign(name)
    return next((sign for sign in known if bare_sign(sign) == bare), None)


def bare_sign(name: str) -> str:
    """Return ``name`` as :func:`find_sign` compares it: two names with the same result mean the same sign."""
    return "".join(letter for letter in unicodedata.normalize("NFKC", name).casefold() if letter not in " _-\t")


def describe_seen(sign: str, seen: str, *, is_hand_in_view: bool) -> str:
    """Return in words what one frame shows, and whether it counts.

    Args:
        sign: The confirmed sign.
        seen: The sign in this frame alone.
        is_hand_in_view: Whether there is a hand.
    """
    if not is_hand_in_view:
        return "no hand is in view"
    if seen == NONE:
        return "the hand shows none of the signs"
    return f"{sign} is shown" if sign == seen else f"hold {seen} a moment longer"


Action = Literal["forward", "backward", "turn_left", "turn_right", "stop", "go", "turbo", "next_robot"]
"""All effects of a sign on the velocity."""

ACTIONS: tuple[Action, ...] = get_args(Action)
MOTION_ACTIONS: frozenset[Action] = frozenset({"forward", "backward", "turn_left", "turn_right", "turbo"})
"""The actions that can make a robot move, or move faster."""

BUILT_IN: Mapping[str, Action] = {
    FORWARD: "forward",
    BACKWARD: "backward",
    TURN_LEFT: "turn_left",
    TURN_RIGHT: "turn_right",
    GO: "go",
    STOP: "stop",
    NONE: "stop",
}
"""The rule of the ROS 101 course, chapter 12."""

ALWAYS_STOP = frozenset({STOP, NONE})
"""Signs that stop the robot in every configuration."""


def action_of(sign: str, given: Mapping[str, Action]) -> Action:
    """Return the action of ``sign``: from ``given``, else the built-in one; an unknown sign changes nothing, as ``Go``.

    Names in ``given`` may have any case, and ``_`` or ``-`` for spaces.
    """
    name = find_sign(sign, given)
    return given[name] if name is not None else BUILT_IN.get(sign, "go")


def motion_signs(given: Mapping[str, Action], signs: Iterable[str] = ()) -> frozenset[str]:
    """Return the signs, built in or from ``given`` or ``signs``, that can make the robot move.

    Args:
        given: Actions that override the built-in ones.
        signs: Further signs, by their own names.
    """
    return frozenset(sign for sign in {*BUILT_IN, *given, *signs} if action_of(sign, given) in MOTION_ACTIONS)


@dataclass(frozen=True)
class Velocity:
    """Forward velocity in m/s and turning velocity in rad/s, left positive (REP 103)."""

    linear_mps: float = 0.0
    angular_radps: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Whether the robot is to stop."""
        return self.linear_mps == 0.0 and self.angular_radps == 0.0

    @property
    def is_rest(self) -> bool:
        """Whether a measured velocity is about zero: standing robots measure up to 0.02 m/s and 0.05 rad/s."""
        return abs(self.linear_mps) <= 0.02 and abs(self.angular_radps) <= 0.05

    @property
    def is_finite(self) -> bool:
        """Whether both parts are finite."""
        return math.isfinite(self.linear_mps) and math.isfinite(self.angular_radps)

    def clamped(self, max_linear_mps: float, max_angular_radps: float) -> "Velocity":
        """Return the nearest velocity within the limits; 0 for a part that, or whose limit, is not a number."""
        return Velocity(_clamped(self.linear_mps, max_linear_mps), _clamped(self.angular_radps, max_angular_radps))


def _clamped(value: float, most: float) -> float:
    # min and max of a number that is none return the other one: full speed backward.
    return 0.0 if math.isnan(value) or math.isnan(most) else max(-most, min(value, most))


ZERO = Velocity()


def changed_towards(wanted: Velocity, now: Velocity, most: Velocity) -> Velocity:
    """Return the velocity nearest to ``wanted`` whose parts differ from those of ``now`` by at most ``most``, >= 0."""
    return Velocity(
        max(now.linear_mps - most.linear_mps, min(wanted.linear_mps, now.linear_mps + most.linear_mps)),
        max(now.angular_radps - most.angular_radps, min(wanted.angular_radps, now.angular_radps + most.angular_radps)),
    )


@dataclass(frozen=True)
class Stick:
    """State of a joystick: whether it is held, and its deflection, each -1 to 1; 0 while it is not held.

    Attributes:
        held: Whether its enable button is pressed; for a hand, whether the fist is closed.
        forward: Positive away from the person.
        left: Positive to the person's left, as ROS's ``joy`` has it.
    """

    held: bool = False
    forward: float = 0.0
    left: float = 0.0

    @property
    def is_valid(self) -> bool:
        """Whether both deflections are finite; if not, the state is not known: that is not a release either."""
        return math.isfinite(self.forward) and math.isfinite(self.left)


RELEASED = Stick()


@dataclass(frozen=True)
class Pose2D:
    """A pose on the floor: x and y in metres, yaw in radians, left positive (REP 103)."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class CourseState:
    """The progress of a robot on a course.

    Attributes:
        gates: Number of gates.
        next_gate: Index of the gate to pass next; ``gates`` once the course is finished.
        missed: Indices of the missed gates.
        bumps: How often it has begun to touch an obstacle since the start.
        time_s: Time since the start gate.
        phase: ``ready`` before the start gate, then ``running``, ``finished`` after the last one.
    """

    gates: int
    next_gate: int = 0
    missed: frozenset[int] = frozenset()
    bumps: int = 0
    time_s: float = 0.0
    phase: Phase = "ready"

    @property
    def passed(self) -> int:
        """Number of gates passed."""
        return self.next_gate - len(self.missed)

    @property
    def score_s(self) -> float:
        """The score so far, in seconds."""
        return self.time_s + BUMP_S * self.bumps + MISS_S * len(self.missed)

    def as_dict(self) -> dict[str, Any]:
        """Return the fields and the score as plain values, for JSON."""
        return {**asdict(self), "missed": sorted(self.missed), "passed": self.passed, "score_s": self.score_s}

    def __str__(self) -> str:
        """Return it in words, as ``gates 8/8, missed 1, bumps 2, 0:23.4, score 37.4 s``."""
        missed = f", missed {len(self.missed)}" if self.missed else ""
        score = f", score {self.score_s:.1f} s" if self.phase == "finished" else ""
        return f"gates {self.passed}/{self.gates}{missed}, bumps {self.bumps}, {stopwatch(self.time_s)}{score}"


def stopwatch(time_s: float) -> str:
    """Return seconds as minutes, seconds and tenths, as ``1:05.3``, rounded down."""
    tenths = int(time_s * 10 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"
