"""Scripts of signs, such as ``Forward:3 Turn Left:2 NONE:1``, and the hand's motion through them."""

import math
import re
from dataclasses import dataclass

import numpy as np

from handsteer.errors import PoseError
from handsteer.hand.kinematics import ANGLES, Array, clamp
from handsteer.hand.poses import HandPose, View, sign_pose
from handsteer.types import Handedness

_CHANGE_S = 0.30
_MAX_S = 3600.0
_PART = re.compile(r"([^:]*):(\S*)\s*")

# The sway of a raised hand: sums of slow waves of these amplitudes, in radians and metres.
_SWAY_HZ = (0.23, 0.41, 0.67)
_SWAY_JOINTS = 0.010
_SWAY_VIEW = np.array([0.030, 0.022, 0.022, 0.003, 0.003, 0.004])


@dataclass(frozen=True)
class Part:
    """One sign of a script and its duration in seconds."""

    sign: str
    duration_s: float


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


def parse_script(text: str) -> tuple[Part, ...]:
    """Return the parts of ``text``: signs with durations in seconds, ``SIGN:SECONDS``, separated by spaces.

    Raises:
        PoseError: The script is empty, or a sign or duration in it is wrong; the message names the place.
    """
    parts: list[Part] = []
    rest = text.strip()
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


def _part(sign: str, duration: str, number: int) -> Part:
    try:
        sign_pose(sign)
    except PoseError as error:
        raise PoseError(f"script part {number}, {sign + ':' + duration!r}: {error}") from None
    try:
        seconds = float(duration)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds <= _MAX_S:
        raise PoseError(
            f"script part {number}, {sign + ':' + duration!r}: {duration!r} is no duration; "
            f"write seconds above 0 and up to {_MAX_S:g}"
        )
    return Part(sign, seconds)


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
        self._poses = [_numbers(sign_pose(part.sign, handedness)) for part in self._parts]
        self._ends = np.cumsum([part.duration_s for part in self._parts])
        self._phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(_SWAY_HZ), len(self._poses[0])))

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
        share = _ease(elapsed / change)
        numbers = (1.0 - share) * self._poses[index - 1] + share * self._poses[index]
        return Moment(_pose(numbers + self._sway(time_s)), part.sign, elapsed >= change)

    def _sway(self, time_s: float) -> Array:
        waves = np.sin(2 * np.pi * time_s * np.array(_SWAY_HZ)[:, None] + self._phases).mean(axis=0)
        sizes = np.concatenate([np.full(len(ANGLES), _SWAY_JOINTS), _SWAY_VIEW])
        return np.asarray(sizes * waves)


def _numbers(pose: HandPose) -> Array:
    return np.concatenate([pose.angles, pose.view.to_array()])


def _pose(numbers: Array) -> HandPose:
    return HandPose(clamp(numbers[: len(ANGLES)]), View.from_array(numbers[len(ANGLES) :]))


def _ease(share: float) -> float:
    """Map 0 to 1 onto 0 to 1 with zero velocity at both ends (K. Perlin's smootherstep)."""
    share = min(max(share, 0.0), 1.0)
    return share**3 * (share * (6.0 * share - 15.0) + 10.0)
