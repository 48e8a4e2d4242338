"""The operator's limbs: submovements, and a hand that shows signs, with tremor and slips."""

import math
from dataclasses import dataclass

import numpy as np

from handsteer.plugins.virtual_hand.kinematics import ANGLES, Array
from handsteer.plugins.virtual_hand.poses import HandPose, sign_pose
from handsteer.plugins.virtual_hand.script import Sway, ease, numbers_of, pose_of
from handsteer.types import NONE

SUBMOVEMENT_S = 0.1
"""How often a movement is corrected: the aim of the limb changes at this interval."""

_SPREAD = 0.05
"""Standard deviation of where a movement ends, relative to its length (R. Schmidt et al., Psychol. Rev. 86, 1979)."""

_QUICKEST_S, _SLOWEST_S = 0.15, 0.30
"""Range of the time from one sign to the next."""

# Physiological tremor of a raised arm: 4 to 5 times the 30 µm of a resting one (W. Growdon et al., Electromyogr. Clin.
# Neurophysiol. 40, 2000), at 8 to 12 Hz.
_TREMOR_M, _TREMOR_HZ = 0.00014, (8.0, 12.0)

_ARM_S = 0.25
"""Duration of a movement of the wrist by a few centimetres."""

_UNCLEAR = 0.35
"""How far towards a relaxed hand an unclear sign is."""


class Limb:
    """A part of the body that moves to a changing aim by minimum-jerk submovements, each continuing the one before.

    Args:
        size: Number of coordinates.
        movement_s: Duration of a movement to an aim that stays.
        random: Source of the spread of movements.
    """

    def __init__(self, size: int, movement_s: float, random: np.random.Generator) -> None:
        self._movement_s = movement_s
        self._random = random
        self._curve = np.zeros((6, size))
        self._since_s = 0.0
        self._next_s = 0.0
        self._aim = np.zeros(size)

    def aim(self, target: Array) -> None:
        """Set the aim, (size,), from the next submovement on."""
        self._aim = np.asarray(target, float)

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        self._since_s += dt_s
        self._next_s -= dt_s
        if self._next_s <= 1e-9:
            self._plan()
            self._next_s = SUBMOVEMENT_S

    def place(self) -> Array:
        """Return the (size,) position now."""
        return self._derivatives(min(self._since_s, self._movement_s))[0]

    def _derivatives(self, t: float) -> tuple[Array, Array, Array]:
        powers = t ** np.arange(6)
        order = np.arange(6)
        speed = np.concatenate([[0.0], order[1:] * powers[:-1]])
        bend = np.concatenate([[0.0, 0.0], order[2:] * order[1:-1] * powers[:-2]])
        return powers @ self._curve, speed @ self._curve, bend @ self._curve

    def _plan(self) -> None:
        """Begin the polynomial of fifth degree that comes to rest at the aim (T. Flash and N. Hogan, 1985)."""
        ended = self._since_s >= self._movement_s
        place, speed, bend = self._derivatives(min(self._since_s, self._movement_s))
        if ended:
            speed, bend = np.zeros_like(speed), np.zeros_like(bend)
        spread = _SPREAD * np.abs(self._aim - place) * self._random.standard_normal(len(place))
        way = self._aim + spread - place
        t = self._movement_s
        rest = np.stack([way - speed * t - bend * t**2 / 2, -speed - bend * t, -bend])
        matrix = np.array([[t**3, t**4, t**5], [3 * t**2, 4 * t**3, 5 * t**4], [6 * t, 12 * t**2, 20 * t**3]])
        self._curve = np.concatenate([np.stack([place, speed, bend / 2]), np.linalg.solve(matrix, rest)])
        self._since_s = 0.0


@dataclass(frozen=True)
class Slips:
    """How often the operator errs.

    Attributes:
        wrong: Probability that another sign is shown than intended, for each change of sign.
        unclear: Probability that the sign is shown unclearly, for each change of sign.
        noticed_s: Time until it is noticed and corrected.
    """

    wrong: float = 0.01
    unclear: float = 0.03
    noticed_s: float = 0.5


class OperatorsHand:
    """A right hand that shows signs, and moves about the place where it is held.

    Args:
        random: Source of times, slips, tremor and sway.
        slips: How often it errs.

    Attributes:
        intended: The sign that the operator wants to show.
        changes: How often that changed.
    """

    def __init__(self, random: np.random.Generator, slips: Slips, choices: tuple[str, ...]) -> None:
        self._random, self._slips, self._choices = random, slips, choices
        self.intended = NONE
        self.changes = 0
        self._wrist: Limb | None = None
        self._turned: Limb | None = None
        self._from = self._to = numbers_of(sign_pose(NONE))
        self._share, self._change_s = 1.0, 1.0
        self._notice_s = math.inf
        self._time_s = 0.0
        self._sway = Sway(random)
        self._tremor = random.uniform(*_TREMOR_HZ, 3), random.uniform(0, math.tau, 3)

    def show(self, sign: str) -> None:
        """Begin to show ``sign``; nothing if it is shown already."""
        if sign == self.intended:
            return
        self.intended = sign
        self.changes += 1
        slip = self._random.random()
        if slip < self._slips.wrong:
            self._move_to(numbers_of(sign_pose(str(self._random.choice(self._choices)))))
        elif slip < self._slips.wrong + self._slips.unclear:
            target, relaxed = numbers_of(sign_pose(sign)), numbers_of(sign_pose(NONE))
            target[: len(ANGLES)] += _UNCLEAR * (relaxed - target)[: len(ANGLES)]
            self._move_to(target)
        else:
            self._move_to(numbers_of(sign_pose(sign)))
            return
        self._notice_s = self._slips.noticed_s

    def reach(self, offset_m: Array) -> None:
        """Move the wrist to ``offset_m``, (2,) metres to the image's right and down from where it is held."""
        self._wrist = self._wrist or Limb(2, _ARM_S, self._random)
        self._wrist.aim(offset_m)

    def turn(self, roll_rad: float) -> None:
        """Tilt the hand in the picture by ``roll_rad``, clockwise as the camera sees it."""
        self._turned = self._turned or Limb(1, _ARM_S, self._random)
        self._turned.aim(np.array([roll_rad]))

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        self._time_s += dt_s
        self._share = min(1.0, self._share + dt_s / self._change_s)
        self._notice_s -= dt_s
        if self._notice_s <= 0.0:
            self._notice_s = math.inf
            self._move_to(numbers_of(sign_pose(self.intended)))
        if self._wrist is not None:
            self._wrist.step(dt_s)
        if self._turned is not None:
            self._turned.step(dt_s)

    def _move_to(self, numbers: Array) -> None:
        self._from, self._to = self._now(), numbers
        self._share, self._change_s = 0.0, float(self._random.uniform(_QUICKEST_S, _SLOWEST_S))
        self._notice_s = math.inf

    def _now(self) -> Array:
        share = ease(self._share)
        return np.asarray((1.0 - share) * self._from + share * self._to)

    def pose(self) -> HandPose:
        """Return the hand now."""
        numbers = self._now() + self._sway.at(self._time_s)
        hertz, phases = self._tremor
        numbers[-3:] += math.sqrt(2.0) * _TREMOR_M * np.sin(math.tau * self._time_s * hertz + phases)
        if self._wrist is not None:
            numbers[-3:-1] += self._wrist.place()
        if self._turned is not None:
            numbers[-4] += self._turned.place()[0]
        return pose_of(numbers)
