"""The operator's hand as a camera sees it, or as its landmarks, and what recognition and control make of it."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import SensorNoise
from handsteer.config import Config
from handsteer.plugins.bench.hands import OperatorsHand
from handsteer.plugins.bench.interfaces import TICK_S
from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import HandPose, Pinhole, sign_pose
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import Recognizer
from handsteer.teleop import Teleop
from handsteer.types import NONE, Velocity

Image = NDArray[np.uint8]

Through = Literal["landmarks", "pictures"]
"""Whether the hand's landmarks are given with errors, or found by the landmark models in rendered pictures."""


@dataclass(frozen=True)
class LandmarkErrors:
    """Errors of landmarks of a tracked hand, as ``benchmarks/landmark_errors.py`` measures them on videos of people.

    Attributes:
        apart: Standard deviation of each landmark's x and y, in palm lengths.
        together: Likewise, of all of them together.
        depth: Likewise, of each landmark's z.
        missed: Probability that a hand in view is not found in a frame.
    """

    apart: float = 0.006
    together: float = 0.012
    depth: float = 0.03
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

    def detect(self, image: Image, *, search: bool = True, dt_s: float = math.inf) -> list[Hand]:
        """Return the hand unless it is missed, or its palm is outside of the picture; ignores the arguments."""
        hand = self._hand()
        is_missed = self._random.random() < self._errors.missed
        palm = hand.points[[0, 5, 17], :2].mean(axis=0)
        is_inside = bool(((palm > 0.0) & (palm < 1.0)).all())
        return [hand] if is_inside and not is_missed else []

    def look_again(self, image: Image, hand: Hand) -> Hand:
        """Return ``hand``: it is located already."""
        return hand

    def second_opinion(self, image: Image, hand: Hand, *, mirrored: bool = False) -> Hand:
        """Return ``hand``: it is seen well already."""
        return hand

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
        apart, together = self._random.standard_normal((21, 3)), self._random.standard_normal(2)
        moved = np.array([errors.apart, errors.apart, errors.depth]) * apart * palm_m
        shift = errors.together * together * palm_m
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


class HandView:
    """The operator's hand in front of the camera, and what recognition and control make of it.

    Args:
        config: All parameters; ``camera`` has size and frame rate.
        through: How the hand is seen.
        errors: Errors of landmarks, unless through pictures.
        seed: Of background, noise and errors.

    Attributes:
        teleop: Recognition and control.
        since_s: Time between the last two frames, in seconds.
    """

    def __init__(self, config: Config, through: Through, errors: LandmarkErrors, seed: int) -> None:
        camera = Pinhole.webcam(config.camera.width, config.camera.height)
        self._landmarker = HandLandmarker(camera, errors, np.random.default_rng([seed, 2]))
        self._pictures = HandCamera(camera, seed) if through == "pictures" else None
        self.teleop = Teleop(config, Recognizer(config, landmarker=None if self._pictures else self._landmarker))
        self._period_s = 1.0 / config.camera.fps
        self._frames = 0
        self._ticks, self._last = 0, 0
        self.since_s = 0.0

    def step(self, hand: OperatorsHand) -> Velocity | None:
        """Advance time by one tick; return the velocity of a new frame, None if none is due."""
        self._ticks += 1
        if self._ticks * TICK_S + 1e-9 < self._frames * self._period_s:
            return None
        self.since_s, self._last = (self._ticks - self._last) * TICK_S, self._ticks
        self._frames += 1
        pose = self._landmarker.pose = hand.pose()
        pictures = self._pictures
        image = pictures.picture(pose, self._ticks * TICK_S) if pictures else blank_picture(self._frames)
        return self.teleop.step(image, self.since_s)

    @property
    def sign(self) -> str:
        """The sign that counts."""
        return self.teleop.recognition.sign if self.teleop.recognition else NONE
