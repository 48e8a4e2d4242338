"""The operator's limbs: submovements, tremor and slips, and the virtual hand as the camera or its landmarks see it."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import SensorNoise
from handsteer.hand.kinematics import ANGLES, Array, clamp, pose_skeleton
from handsteer.hand.poses import HandPose, Pinhole, View, sign_pose
from handsteer.hand.renderer import Look, make_background, render
from handsteer.recognition.hand import Hand
from handsteer.types import NONE

Image = NDArray[np.uint8]

SUBMOVEMENT_S = 0.1
"""How often a movement is corrected: the aim of the limb changes at this interval."""

_SPREAD = 0.05
"""Standard deviation of where a movement ends, relative to its length (R. Schmidt et al., Psychol. Rev. 86, 1979)."""

_QUICKEST_S, _SLOWEST_S = 0.15, 0.30
"""Range of the time from one sign to the next."""

# Physiological tremor of a raised arm: 4 to 5 times the 30 µm of a resting one (W. Growdon et al., Electromyogr. Clin.
# Neurophysiol. 40, 2000), at 8 to 12 Hz. The sway is that of the virtual hand (hand.script).
_TREMOR_M, _TREMOR_HZ = 0.00014, (8.0, 12.0)
_SWAY_HZ = (0.23, 0.41, 0.67)
_SWAY_JOINTS = 0.010
_SWAY_VIEW = np.array([0.030, 0.022, 0.022, 0.003, 0.003, 0.004])

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

    def step(self, dt_s: float) -> Array:
        """Return the (size,) position ``dt_s`` seconds later."""
        self._since_s += dt_s
        self._next_s -= dt_s
        if self._next_s <= 1e-9:
            self._plan()
            self._next_s = SUBMOVEMENT_S
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
        self._offset = np.zeros(2)
        self._from = self._to = _numbers(sign_pose(NONE))
        self._share, self._change_s = 1.0, 1.0
        self._notice_s = math.inf
        self._time_s = 0.0
        self._phases = random.uniform(0, math.tau, (len(_SWAY_HZ), len(self._to)))
        self._tremor = random.uniform(*_TREMOR_HZ, 3), random.uniform(0, math.tau, 3)

    @property
    def is_settled(self) -> bool:
        """Whether the hand has reached the sign."""
        return self._share >= 1.0

    def show(self, sign: str) -> None:
        """Begin to show ``sign``; nothing if it is shown already."""
        if sign == self.intended:
            return
        self.intended = sign
        self.changes += 1
        slip = self._random.random()
        if slip < self._slips.wrong:
            self._move_to(_numbers(sign_pose(str(self._random.choice(self._choices)))))
        elif slip < self._slips.wrong + self._slips.unclear:
            target, relaxed = _numbers(sign_pose(sign)), _numbers(sign_pose(NONE))
            target[: len(ANGLES)] += _UNCLEAR * (relaxed - target)[: len(ANGLES)]
            self._move_to(target)
        else:
            self._move_to(_numbers(sign_pose(sign)))
            return
        self._notice_s = self._slips.noticed_s

    def reach(self, offset_m: Array) -> None:
        """Move the wrist to ``offset_m``, (2,) metres to the image's right and down from where it is held."""
        self._wrist = self._wrist or Limb(2, _ARM_S, self._random)
        self._wrist.aim(offset_m)

    def step(self, dt_s: float) -> None:
        """Advance time by ``dt_s`` seconds."""
        self._time_s += dt_s
        self._share = min(1.0, self._share + dt_s / self._change_s)
        self._notice_s -= dt_s
        if self._notice_s <= 0.0:
            self._notice_s = math.inf
            self._move_to(_numbers(sign_pose(self.intended)))
        if self._wrist is not None:
            self._offset = self._wrist.step(dt_s)

    def _move_to(self, numbers: Array) -> None:
        self._from, self._to = self._now(), numbers
        self._share, self._change_s = 0.0, float(self._random.uniform(_QUICKEST_S, _SLOWEST_S))
        self._notice_s = math.inf

    def _now(self) -> Array:
        share = self._share**3 * (self._share * (6.0 * self._share - 15.0) + 10.0)  # minimum jerk
        return np.asarray((1.0 - share) * self._from + share * self._to)

    def pose(self) -> HandPose:
        """Return the hand now."""
        waves = np.sin(math.tau * self._time_s * np.array(_SWAY_HZ)[:, None] + self._phases).mean(axis=0)
        numbers = self._now() + np.concatenate([np.full(len(ANGLES), _SWAY_JOINTS), _SWAY_VIEW]) * waves
        hertz, phases = self._tremor
        numbers[-3:] += math.sqrt(2.0) * _TREMOR_M * np.sin(math.tau * self._time_s * hertz + phases)
        numbers[-3:-1] += self._offset
        return HandPose(clamp(numbers[: len(ANGLES)]), View.from_array(numbers[len(ANGLES) :]))


def _numbers(pose: HandPose) -> Array:
    return np.concatenate([pose.angles, pose.view.to_array()])


@dataclass(frozen=True)
class LandmarkErrors:
    """Errors of landmarks of a tracked hand, as ``benchmarks/landmark_errors.py`` measures them on videos of people.

    Attributes:
        apart: Standard deviation of each landmark's x and y, in palm lengths.
        together: Likewise, of all of them together.
        depth: Likewise, of each landmark's z.
        keep: Correlation of an error with that of the frame before, at 30 frames a second.
        missed: Probability that a hand in view is not found in a frame.
    """

    apart: float = 0.006
    together: float = 0.012
    depth: float = 0.03
    keep: float = 0.0
    missed: float = 0.001

    def scaled(self, factor: float) -> "LandmarkErrors":
        """Return errors that are ``factor`` times as large and as frequent."""
        return replace(
            self,
            apart=factor * self.apart,
            together=factor * self.together,
            depth=factor * self.depth,
            missed=min(1.0, factor * self.missed),
        )


class HandLandmarker:
    """A :class:`~handsteer.recognition.hand.Landmarker` that returns the landmarks of a virtual hand, with errors.

    Args:
        camera: Projects the hand.
        errors: Errors to add.
        random: Source of the errors.

    Attributes:
        pose: The hand to find in the next frame.
    """

    def __init__(self, camera: Pinhole, errors: LandmarkErrors, random: np.random.Generator) -> None:
        self.pose = sign_pose(NONE)
        self._camera, self._errors, self._random = camera, errors, random
        self._apart, self._together = np.zeros((21, 3)), np.zeros(2)

    def detect(self, image: Image, *, search: bool = True, dt_s: float = math.inf) -> list[Hand]:
        """Return the hand unless it is missed, or its palm is outside of the picture; ignores the arguments."""
        keep = self._errors.keep
        fresh = math.sqrt(1 - keep**2)
        self._apart = keep * self._apart + fresh * self._random.standard_normal((21, 3))
        self._together = keep * self._together + fresh * self._random.standard_normal(2)
        is_missed = self._random.random() < self._errors.missed
        hand = self._hand()
        palm = hand.points[[0, 5, 17], :2].mean(axis=0)
        is_inside = bool(((palm > 0.0) & (palm < 1.0)).all())
        return [hand] if is_inside and not is_missed else []

    def follow_only(self, hand: Hand) -> None:
        """Do nothing: there is one hand."""

    def reset(self) -> None:
        """Do nothing: the hand is found again in the next frame."""

    def _hand(self) -> Hand:
        skeleton, placement = pose_skeleton(self.pose.angles), self.pose.view.placement("Right")
        joints = placement.apply(skeleton.joints[0])
        pixels = self._camera.project(joints)
        scale = self._camera.focal_px / joints[0, 2]
        palm_m = float(np.linalg.norm(skeleton.joints[0, 9]))
        errors = self._errors
        moved = np.array([errors.apart, errors.apart, errors.depth]) * self._apart * palm_m
        shift = errors.together * self._together * palm_m
        size = np.array([self._camera.width, self._camera.height])
        depth = (joints[:, 2] - joints[0, 2] + moved[:, 2]) * scale / self._camera.width
        points = np.column_stack([(pixels + (moved[:, :2] + shift) * scale) / size, depth])
        world = joints - joints.mean(axis=0) + moved
        return Hand(
            points.astype(np.float32),
            world.astype(np.float32),
            "Right",
            0.98,
            0.98,
            (self._camera.width, self._camera.height),
        )


class HandCamera:
    """Takes pictures of the operator's hand.

    Args:
        camera: Its projection.
        seed: Of background and sensor noise.
    """

    def __init__(self, camera: Pinhole, seed: int) -> None:
        self._camera = camera
        self._background = make_background("plain", camera.width, camera.height, seed)
        self._noise = SensorNoise(seed)

    def picture(self, pose: HandPose, time_s: float) -> Image:
        """Return the picture of the hand, (height, width, 3) uint8."""
        skeleton, placement = pose_skeleton(pose.angles), pose.view.placement("Right")
        image = render(skeleton, placement, self._camera, Look(), self._background)
        return self._noise.on(image, time_s)


def blank_picture(number: int) -> Image:
    """Return a tiny picture that differs from all recent ones, for landmarks that come from elsewhere."""
    return np.full((4, 4, 3), (64 + number % 128, 64 + number // 128 % 128, 100), np.uint8)
