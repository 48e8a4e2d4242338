"""The signs as hand poses: the shape of the hand, its pose relative to a camera, and the camera's projection.

The camera frame is ROS's optical frame (REP 103): x to the image's right, y down, z forward, metres. Frames are not
mirrored, so the left edge of the image is the user's right.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.errors import PoseError
from handsteer.plugins.virtual_hand.kinematics import FINGERS, Array, angles_of, turn_x, turn_y, turn_z
from handsteer.types import BACKWARD, FORWARD, GO, NONE, STOP, TURN_LEFT, TURN_RIGHT, Handedness

_PALM_TO_CAMERA: Array = np.diag([1.0, -1.0, -1.0])
_MIRROR: Array = np.diag([-1.0, 1.0, 1.0])
PALM_CENTRE_M: Array = np.array([0.0, 0.06, 0.0])
"""The point of the hand frame that a placement moves to its position."""

_JOINTS = ("spread", "mcp", "pip", "dip")
_CLOSED = {
    "index": (0.0, 76.0, 98.0, 52.0),
    "middle": (0.0, 80.0, 100.0, 55.0),
    "ring": (0.0, 82.0, 100.0, 55.0),
    "little": (2.0, 80.0, 98.0, 52.0),
}
_STRAIGHT_INDEX = (2.0, 2.0, 4.0, 2.0)
_THUMB_OVER_INDEX = (19.0, 39.0, 26.0, 64.0, -1.0)
_THUMB_OVER_MIDDLE = (9.0, 41.0, 29.0, 66.0, -2.0)
_THUMB_OUT = (58.0, 12.0, -6.0, -14.0, 0.0)

_STRAIGHT = (0.0, 3.0, 5.0, 3.0)
_STRAIGHT_LITTLE = (-8.0, 4.0, 6.0, 4.0)
_THUMB_ACROSS = (9.0, 45.0, 32.0, 62.0, 0.0)

_HEIGHT_M, _DEPTH_M = 0.03, 0.55
_LOWERED_M = 0.75 * _DEPTH_M + 0.20  # below the picture, for any aspect ratio

_OTHER_HANDS = {TURN_LEFT: TURN_RIGHT, TURN_RIGHT: TURN_LEFT}


@dataclass(frozen=True)
class Placement:
    """The hand's pose in the camera frame.

    Attributes:
        matrix: (3, 3) from the hand frame to the camera frame: a rotation, with a reflection for a left hand.
        position: (3,) centre of the palm in metres.
    """

    matrix: Array
    position: Array

    def apply(self, points: ArrayLike) -> Array:
        """Transform (..., 3) points from the hand frame to the camera frame, in metres."""
        return (np.asarray(points) - PALM_CENTRE_M) @ self.matrix.T + self.position

    def mirrored(self) -> "Placement":
        """Return the placement of the other hand whose picture is the mirror image of this one's."""
        return Placement(_MIRROR @ self.matrix, _MIRROR @ self.position)


def orientation(*, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """Return the (3, 3) rotation of a right hand from the hand frame to the camera frame.

    Args:
        yaw: Radians about the hand's length. At 0 the palm faces the camera, at pi the back of the hand.
        pitch: Radians; positive tips the fingers away from the camera.
        roll: Radians in the image, clockwise as the camera sees it. At 0 the fingers point up.
    """
    return turn_z(roll) @ turn_x(-pitch) @ _PALM_TO_CAMERA @ turn_y(yaw)


@dataclass(frozen=True)
class Pinhole:
    """An ideal pinhole camera.

    Attributes:
        width: Pixels.
        height: Pixels.
        focal_px: Focal length in pixels.
    """

    width: int
    height: int
    focal_px: float

    @classmethod
    def webcam(cls, width: int, height: int) -> "Pinhole":
        """Return a webcam of that size with a diagonal field of view of 70 degrees (60 to 78 are common)."""
        return cls(width, height, float(np.hypot(width, height)) / (2 * np.tan(np.radians(35.0))))

    def project(self, points: ArrayLike) -> Array:
        """Return (..., 2) pixels of (..., 3) points in the camera frame; pixel centres are at integers + 0.5."""
        points = np.asarray(points, float)
        pixels: Array = points[..., :2] / points[..., 2:] * self.focal_px + np.array([self.width, self.height]) / 2
        return pixels

    def rays(self, columns: ArrayLike, rows: ArrayLike) -> NDArray[np.float32]:
        """Return (3, ...) unit directions through the pixels at (...) ``columns`` and ``rows``."""
        x = (np.asarray(columns) - self.width / 2) / self.focal_px
        y = (np.asarray(rows) - self.height / 2) / self.focal_px
        directions = np.stack([x, y, np.ones_like(x)])
        return np.asarray(directions / np.linalg.norm(directions, axis=0), np.float32)


@dataclass(frozen=True)
class View:
    """Pose of a right hand relative to the camera; a left hand has its mirror image.

    Attributes:
        yaw: Radians about the hand's length: at 0 the camera sees the palm, at pi the back.
        pitch: Radians; positive tips the fingers away from the camera.
        roll: Radians in the image, clockwise; at 0 the fingers point up.
        position: (x, y, z) of the palm in the camera frame, metres.
    """

    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    position: tuple[float, float, float] = (0.0, 0.0, 0.55)

    def placement(self, handedness: Handedness) -> Placement:
        """Return the placement of that hand."""
        matrix = orientation(yaw=self.yaw, pitch=self.pitch, roll=self.roll)
        right = Placement(matrix, np.array(self.position))
        return right if handedness == "Right" else right.mirrored()

    def to_array(self) -> Array:
        """Return (6,): yaw, pitch, roll, x, y, z."""
        return np.array([self.yaw, self.pitch, self.roll, *self.position])

    @classmethod
    def from_array(cls, numbers: Array) -> "View":
        """Return the view from the (6,) array of :meth:`to_array`."""
        yaw, pitch, roll, x, y, z = (float(number) for number in numbers)
        return cls(yaw, pitch, roll, (x, y, z))


@dataclass(frozen=True)
class HandPose:
    """A hand shape and its pose relative to the camera.

    Attributes:
        angles: (23,) joint angles, radians, in the order of :data:`handsteer.plugins.virtual_hand.kinematics.ANGLES`.
        view: Its pose.
    """

    angles: Array
    view: View


def _shape(*, thumb: tuple[float, ...], **fingers: tuple[float, ...]) -> Array:
    """Return angles from degrees: thumb and fingers in the order of ``ANGLES``; omitted fingers are closed."""
    names = ("spread", "opposition", "mcp", "ip", "rotation")
    degrees = {f"thumb_{name}": value for name, value in zip(names, thumb, strict=True)}
    for finger in FINGERS:
        values = fingers.get(finger, _CLOSED[finger])
        degrees |= {f"{finger}_{joint}": value for joint, value in zip(_JOINTS, values, strict=True)}
    return angles_of(**degrees)


OPEN = _shape(
    thumb=(46.0, 12.0, 4.0, 2.0, 0.0),
    index=(6.0, 3.0, 5.0, 3.0),
    middle=(0.0, 2.0, 5.0, 3.0),
    ring=(-6.0, 3.0, 6.0, 3.0),
    little=(-14.0, 4.0, 6.0, 4.0),
)
RELAXED = _shape(
    thumb=(28.0, 28.0, 15.0, 20.0, 0.0),
    index=(1.0, 25.0, 30.0, 15.0),
    middle=(0.0, 32.0, 36.0, 18.0),
    ring=(-1.0, 38.0, 40.0, 20.0),
    little=(-4.0, 42.0, 42.0, 22.0),
)
FIST = _shape(thumb=_THUMB_OVER_INDEX)
INDEX = _shape(thumb=_THUMB_OVER_MIDDLE, index=_STRAIGHT_INDEX)
THUMB = _shape(
    # From the back, only a tight fist is distinguishable from straight fingers.
    thumb=_THUMB_OUT,
    index=(0.0, 80.0, 106.0, 62.0),
    middle=(0.0, 82.0, 108.0, 66.0),
    ring=(0.0, 84.0, 108.0, 66.0),
    little=(2.0, 86.0, 108.0, 66.0),
)

PEACE = _shape(thumb=_THUMB_ACROSS, index=(8.0, 3.0, 5.0, 3.0), middle=(-6.0, 3.0, 5.0, 3.0))
THREE = _shape(thumb=_THUMB_ACROSS, index=(8.0, 3.0, 5.0, 3.0), middle=_STRAIGHT, ring=(-8.0, 4.0, 6.0, 3.0))
FOUR = _shape(
    thumb=_THUMB_ACROSS,
    index=(6.0, 3.0, 5.0, 3.0),
    middle=_STRAIGHT,
    ring=(-5.0, 4.0, 6.0, 3.0),
    little=_STRAIGHT_LITTLE,
)
HORNS = _shape(thumb=_THUMB_ACROSS, index=_STRAIGHT_INDEX, little=_STRAIGHT_LITTLE)
CALL = _shape(thumb=_THUMB_OUT, little=_STRAIGHT_LITTLE)
OK = _shape(
    thumb=(28.0, 45.0, 5.0, 20.0, 0.0),
    index=(0.0, 50.0, 60.0, 35.0),
    middle=(0.0, 8.0, 12.0, 6.0),
    ring=(-4.0, 5.0, 8.0, 4.0),
    little=_STRAIGHT_LITTLE,
)


def _held(angles: Array, *, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0, y: float = _HEIGHT_M) -> HandPose:
    view = View(np.radians(yaw), np.radians(pitch), np.radians(roll), (-0.02, y, _DEPTH_M))
    return HandPose(angles, view)


_POSES = {
    STOP: _held(OPEN),
    FORWARD: _held(INDEX, yaw=8, y=_HEIGHT_M + 0.02),
    BACKWARD: _held(INDEX, yaw=12, roll=180, y=-0.02),
    TURN_LEFT: _held(THUMB, yaw=20, pitch=-20, roll=10),
    TURN_RIGHT: _held(THUMB, yaw=150, pitch=-30, roll=-28),
    GO: _held(FIST, yaw=10, pitch=3),
    NONE: _held(RELAXED, y=_LOWERED_M),
    # Not signs until they are taught.
    "Peace": _held(PEACE, yaw=8),
    "Three": _held(THREE, yaw=8),
    "Four": _held(FOUR, yaw=8),
    "Horns": _held(HORNS, yaw=8),
    "Call": _held(CALL, yaw=8),
    "OK": _held(OK, yaw=8),
}


def sign_pose(sign: str, handedness: Handedness = "Right") -> HandPose:
    """Return how people show ``sign`` with that hand.

    A left hand is the mirror image of a right one: it shows ``Turn Left`` as the right hand does ``Turn Right``, with
    the back to the camera. ``NONE`` is the hand lowered out of the picture. ``Peace``, ``Three``, ``Four``, ``Horns``,
    ``Call`` and ``OK`` are available too, and are not signs until they are taught.

    Raises:
        PoseError: ``sign`` is unknown.
    """
    shown = _OTHER_HANDS.get(sign, sign) if handedness == "Left" else sign
    if shown not in _POSES:
        raise PoseError(f"unknown sign {sign!r}: the virtual hand shows {', '.join(_POSES)}")
    return _POSES[shown]
