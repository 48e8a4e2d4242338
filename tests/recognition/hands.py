"""Hands with a known shape, as a landmark model would see them if it made no errors."""

from collections.abc import Iterable
from math import inf

import numpy as np

from handsteer.plugins.teach.synthetic.hands import BONES_M
from handsteer.plugins.virtual_hand.kinematics import angles_of, pose_joints, turn_z
from handsteer.plugins.virtual_hand.poses import FIST, HandPose, Pinhole, Placement, View, sign_pose
from handsteer.recognition.hand import Hand
from handsteer.types import Handedness

SIZE = (640, 480)
_CAMERA = Pinhole.webcam(*SIZE)


def show_sign(sign: str, handedness: Handedness = "Right", *, tilt: float = 0.0, away_m: float = 0.6) -> Hand:
    """Return a hand that shows ``sign``, tilted in the image by ``tilt`` radians, ``away_m`` metres off."""
    return show_pose(sign_pose(sign, handedness), handedness, tilt=tilt, away_m=away_m)


def show_pose(pose: HandPose, handedness: Handedness = "Right", *, tilt: float = 0.0, away_m: float = 0.6) -> Hand:
    """Return the hand that is posed like this; arguments as :func:`show_sign`."""
    placement = pose.view.placement(handedness)
    turned = Placement(turn_z(tilt) @ placement.matrix, np.array([0.0, 0.0, away_m]))
    joints = turned.apply(pose_joints(pose.angles, BONES_M)[0])
    return hand_of(_CAMERA.project(joints), joints - joints.mean(axis=0), handedness)


def show_fingers(
    *straight: str, thumb: dict[str, float] | None = None, roll: float = 0.0, bend: dict[str, float] | None = None
) -> Hand:
    """Return a right hand, palm to the camera, of which only some fingers are straight.

    Args:
        straight: Names of the straight fingers.
        thumb: Its angles in degrees; folded over the fingers by default.
        roll: Radians in the image, clockwise; at 0 the fingers point up.
        bend: Further angles in degrees, of any finger.
    """
    folded = {"spread": 9.0, "opposition": 50.0, "mcp": 35.0, "ip": 60.0}
    degrees = {f"thumb_{joint}": angle for joint, angle in (thumb or folded).items()}
    for finger in straight:
        degrees |= {f"{finger}_mcp": 3.0, f"{finger}_pip": 5.0, f"{finger}_dip": 3.0}
    degrees |= bend or {}
    closed = {"mcp": 70.0, "pip": 92.0, "dip": 50.0}
    for finger in ("index", "middle", "ring", "little"):
        for joint, angle in closed.items():
            degrees.setdefault(f"{finger}_{joint}", angle)
    return show_pose(HandPose(angles_of(**degrees), View(yaw=0.15, roll=roll)))


def fist() -> HandPose:
    """Return a fist, upright, palm to the camera."""
    return HandPose(FIST, View())


def hand_of(pixels: np.ndarray, world: np.ndarray, handedness: Handedness = "Right") -> Hand:
    """Return a hand from (21, 2) pixels and (21, 3) metres."""
    points = np.column_stack([pixels / SIZE, np.zeros(21)])
    return Hand(points.astype(np.float32), world.astype(np.float32), handedness, 0.99, 0.99, SIZE)


def moved(hand: Hand, x_px: float, scale: float = 1.0) -> Hand:
    """Return ``hand`` moved to the right by ``x_px`` pixels, after it was scaled about the image's middle."""
    pixels = (hand.pixels[:, :2] - np.array(SIZE) / 2) * scale + np.array(SIZE) / 2 + (x_px, 0.0)
    return hand_of(pixels, hand.world, hand.handedness)


class RecordedLandmarker:
    """A landmarker that returns the recorded hands of ``frames``, one list per frame, and then none."""

    def __init__(self, frames: Iterable[list[Hand]]) -> None:
        self._frames = [list(hands) for hands in frames]
        self._next = 0

    def detect(self, image: np.ndarray, *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands of the next frame, an empty list after the last one; ignores the arguments."""
        hands = self._frames[self._next] if self._next < len(self._frames) else []
        self._next += 1
        return list(hands)

    def look_again(self, image: np.ndarray, hand: Hand) -> Hand:
        """Return ``hand``: there is nothing else in a recording."""
        return hand

    def second_opinion(self, image: np.ndarray, hand: Hand, *, mirrored: bool = False) -> Hand | None:
        """Return ``hand``: there is nothing else in a recording."""
        return hand

    def follow_only(self, hand: Hand) -> None:
        """Do nothing: a recording continues with all its hands."""

    def reset(self) -> None:
        """Do nothing: a recording tracks no hands, and continues where it is."""
