"""Scripts of signs and places, such as ``Stop:1 Go:1 Go@0.05,-0.05:2``, and the hand's motion through them."""

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from handsteer.errors import PoseError
from handsteer.plugins.virtual_hand.kinematics import ANGLES, Array, clamp
from handsteer.plugins.virtual_hand.poses import HandPose, View, sign_pose
from handsteer.types import Handedness

AUTO = "auto"
"""The script that shows what the run needs to drive: :func:`chosen_script`."""

_SIGNS = "Forward:3 Turn Left:2 Forward:2 Turn Right:2 Go:1 Backward:3 Stop:0.7 Go:0.6 Stop:0.7 NONE:1"
_JOYSTICK = "Stop:1.5 Go:1 Go@0,-0.06:2 Go@0.05,-0.06:1.5 Go@-0.05,-0.06:1.5 Go@0.06,0:3 Stop:1"
_ENGAGES = "Stop:1.2 Go:0.6 Stop:0.7"  # by the gesture, and by a palm that is held

_CHANGE_S = 0.30
_MAX_S = 3600.0
_MAX_M = 0.5
_PART = re.compile(r"([^:]*):(\S*)\s*")

# The sway of a raised hand, with amplitudes in radians and metres.
_SWAY_HZ = (0.23, 0.41, 0.67)
_SWAY_JOINTS = 0.010
_SWAY_VIEW = np.array([0.030, 0.022, 0.022, 0.003, 0.003, 0.004])


@dataclass(frozen=True)
class Part:
    """One sign of a script.

    Attributes:
        sign: Its name.
        duration_s: Seconds.
        right_m: How far the hand is from its usual place, to the person's right.
        down_m: Likewise, downwards.
    """

    sign: str
    duration_s: float
    right_m: float = 0.0
    down_m: float = 0.0


@dataclass(frozen=True)
class Moment:
    """The hand at one moment.

    Attributes:
        pose: Shape and view.
        sign: The sign that is shown or approached.
        settled: Whether the hand has reached it.
    """

    pose: HandPose
    sign: str
    settled: bool


def chosen_script(text: str, *, joystick: bool, engage: bool) -> str:
    """Return ``text``; if it is ``auto``, a script that drives.

    Args:
        text: A script, or ``auto``.
        joystick: Whether the hand is a joystick, instead of showing signs.
        engage: Whether the hand has to engage before it drives.
    """
    if text.strip() != AUTO:
        return text
    shown = _JOYSTICK if joystick else _SIGNS
    return f"{_ENGAGES} {shown}" if engage else shown


def parse_script(text: str) -> tuple[Part, ...]:
    """Return the parts of ``text``: signs with durations in seconds, ``SIGN:SECONDS``, separated by spaces.

    ``SIGN@RIGHT,DOWN:SECONDS`` shows the sign so many metres to the person's right of the usual place, and below it.
    ``auto`` is all six signs.

    Raises:
        PoseError: The script is empty, or a sign, place or duration in it is wrong; the message names the part.
    """
    parts: list[Part] = []
    rest = chosen_script(text, joystick=False, engage=False).strip()
    while rest:
        number = len(parts) + 1
        match = _PART.match(rest)
        if not match:
            raise PoseError(f"script part {number}, {rest!r}: no duration; write it as SIGN:SECONDS, 'Forward:3'")
        parts.append(_part(match[1].strip(), match[2], number))
        rest = rest[match.end() :]
    if not parts:
        raise PoseError("the script is empty; write signs with seconds, as 'Forward:3 Turn Left:2 NONE:1'")
    return tuple(parts)


def _part(shown: str, duration: str, number: int) -> Part:
    sign, at, place = shown.partition("@")
    where = f"script part {number}, {shown + ':' + duration!r}"
    try:
        sign_pose(sign)
    except PoseError as error:
        raise PoseError(f"{where}: {error}") from None
    right_m, down_m = _read_place(place, where) if at else (0.0, 0.0)
    seconds = _number(duration)
    if not 0 < seconds <= _MAX_S:
        raise PoseError(f"{where}: {duration!r} is not a valid duration; write seconds above 0 and up to {_MAX_S:g}")
    return Part(sign, seconds, right_m, down_m)


def _read_place(text: str, where: str) -> tuple[float, float]:
    """Return metres to the right and down; ``where`` names the part of the script."""
    metres = [_number(each) for each in text.split(",")]
    if len(metres) != 2 or not all(abs(each) <= _MAX_M for each in metres):
        raise PoseError(
            f"{where}: {text!r} is not a valid place; write metres to the right and down, up to {_MAX_M:g}, "
            "as in Go@0.1,-0.05:2"
        )
    return metres[0], metres[1]


def _number(text: str) -> float:
    """Return the number in ``text``; NaN if it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


class Motion:
    """A hand that repeats a script; deterministic.

    Args:
        script: As for :func:`parse_script`.
        handedness: ``Left`` or ``Right``.
        seed: Seed of the sway.

    Raises:
        PoseError: The script is wrong.
    """

    def __init__(self, script: str, handedness: Handedness = "Right", seed: int = 0) -> None:
        self._parts = parse_script(script)
        self._poses = [numbers_of(_placed(part, handedness)) for part in self._parts]
        self._ends = np.cumsum([part.duration_s for part in self._parts])
        self._sway = Sway(np.random.default_rng(seed))

    @property
    def duration_s(self) -> float:
        """The duration of one repetition in seconds."""
        return float(self._ends[-1])

    def at(self, time_s: float) -> Moment:
        """Return the hand ``time_s`` seconds after the start; the start for negative times."""
        time_s = max(0.0, time_s)
        within = math.fmod(time_s, self.duration_s)
        index = min(int(np.searchsorted(self._ends, within, side="right")), len(self._parts) - 1)
        part = self._parts[index]
        elapsed = within - (float(self._ends[index]) - part.duration_s)
        change = min(_CHANGE_S, part.duration_s)
        share = ease(elapsed / change)
        numbers = (1.0 - share) * self._poses[index - 1] + share * self._poses[index]
        return Moment(pose_of(numbers + self._sway.at(time_s)), part.sign, elapsed >= change)


class Sway:
    """The sway of a raised hand: sums of slow waves.

    Args:
        random: Source of their phases.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self._sizes = np.concatenate([np.full(len(ANGLES), _SWAY_JOINTS), _SWAY_VIEW])
        self._phases = random.uniform(0, math.tau, (len(_SWAY_HZ), len(self._sizes)))

    def at(self, time_s: float) -> Array:
        """Return what it adds to :func:`numbers_of` a hand after ``time_s`` seconds."""
        waves = np.sin(math.tau * time_s * np.array(_SWAY_HZ)[:, None] + self._phases).mean(axis=0)
        return np.asarray(self._sizes * waves)


def _placed(part: Part, handedness: Handedness) -> HandPose:
    pose = sign_pose(part.sign, handedness)
    x, y, z = pose.view.position
    # Views are of a right hand; a left one has the mirror image. The camera's right is the person's left.
    right_m = part.right_m if handedness == "Left" else -part.right_m
    return replace(pose, view=replace(pose.view, position=(x + right_m, y + part.down_m, z)))


def numbers_of(pose: HandPose) -> Array:
    """Return the angles and the view of ``pose`` as one array, so that hands can be mixed."""
    return np.concatenate([pose.angles, pose.view.to_array()])


def pose_of(numbers: Array) -> HandPose:
    """Return the hand of such an array, its angles within their limits."""
    return HandPose(clamp(numbers[: len(ANGLES)]), View.from_array(numbers[len(ANGLES) :]))


def ease(share: float) -> float:
    """Map 0 to 1 onto 0 to 1 with zero velocity at both ends: minimum jerk (K. Perlin's smootherstep)."""
    share = min(max(share, 0.0), 1.0)
    return share**3 * (share * (6.0 * share - 15.0) + 10.0)
