"""The hand's pose relative to a camera, and the camera's projection.

The camera frame is ROS's optical frame (REP 103): x to the image's right, y down, z forward, metres. Frames are not
mirrored, so the left edge of the image is the user's right.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handsteer.hand.kinematics import Array, turn_x, turn_y, turn_z

_PALM_TO_CAMERA: Array = np.diag([1.0, -1.0, -1.0])
_MIRROR: Array = np.diag([-1.0, 1.0, 1.0])
PALM_CENTRE_M: Array = np.array([0.0, 0.06, 0.0])
"""The point of the hand frame that a placement moves to its position."""


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

    def turn(self, directions: ArrayLike) -> Array:
        """Transform (..., 3) directions from the hand frame to the camera frame."""
        return np.asarray(directions) @ self.matrix.T

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
