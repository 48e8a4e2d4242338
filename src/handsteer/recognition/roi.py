"""The region of interest: the rotated square of a frame that is a model's input.

The regions from a palm and from landmarks (points, scale and shift) follow MediaPipe 0.10.21's graphs
``palm_detection_detection_to_roi`` and ``hand_landmark_landmarks_to_roi``.
"""

from dataclasses import dataclass
from math import atan2, cos, pi, sin
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

_BASES_OF_INDEX_MIDDLE_RING: Final = (5, 9, 13)
# Wrist, thumb without its tip, and the two lower joints of each finger: these move least when a finger bends.
_STEADY_LANDMARKS: Final = (0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18)


@dataclass(frozen=True)
class Roi:
    """A rotated square in a frame; all lengths in pixels.

    Attributes:
        center_x: From the left edge of the frame.
        center_y: From the top edge of the frame.
        side: Length of its sides.
        rotation: Angle of its x axis from the frame's, in radians, clockwise as seen.
    """

    center_x: float
    center_y: float
    side: float
    rotation: float = 0.0

    @property
    def axes(self) -> Array:
        """(2, 2) float64 rotation of a row of the square's coordinates ``p`` into the frame's: ``p @ axes``."""
        c, s = cos(self.rotation), sin(self.rotation)
        return np.array([[c, s], [-s, c]])

    def to_frame(self, points: Array) -> Array:
        """Return ``points``, (..., 2) with 0 to 1 across the square, in pixels of the frame."""
        return (points - 0.5) * self.side @ self.axes + (self.center_x, self.center_y)

    def crop(self, image: NDArray[np.uint8], pixels: int, border: int) -> NDArray[np.uint8]:
        """Return the square as a (pixels, pixels, 3) image, bilinearly sampled.

        Args:
            image: (height, width, 3) uint8.
            pixels: Side of the result.
            border: OpenCV's border mode outside the frame, such as ``cv2.BORDER_REPLICATE``.
        """
        scale = self.side / pixels
        c, s = cos(self.rotation) * scale, sin(self.rotation) * scale
        half = pixels / 2
        crop_to_frame = np.array(
            [[c, -s, self.center_x - (c - s) * half], [s, c, self.center_y - (s + c) * half]],
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpAffine(image, crop_to_frame, (pixels, pixels), flags=flags, borderMode=border)  # type: ignore[return-value]

    def grown(self, factor: float) -> "Roi":
        """Return the square scaled by ``factor`` about its centre."""
        return Roi(self.center_x, self.center_y, self.side * factor, self.rotation)

    def overlap(self, other: "Roi") -> float:
        """Return the intersection over union of the two squares as if neither were rotated, 0 to 1."""
        reach = (self.side + other.side) / 2
        smaller = min(self.side, other.side)
        width = min(smaller, reach - abs(self.center_x - other.center_x))
        height = min(smaller, reach - abs(self.center_y - other.center_y))
        if width <= 0 or height <= 0:
            return 0.0
        shared = width * height
        return shared / (self.side**2 + other.side**2 - shared)


def whole_frame(width: int, height: int, widened: float = 1.0) -> Roi:
    """Return the smallest upright square around a frame of that size in pixels, enlarged by the factor ``widened``."""
    return Roi(width / 2, height / 2, max(width, height) * widened)


def from_palm(corners: Array, wrist: Array, middle_base: Array) -> Roi:
    """Return the region of the hand of a detected palm; all arguments in pixels.

    Args:
        corners: (2, 2) top left and bottom right of the palm's box, x and y.
        wrist: (2,).
        middle_base: (2,) base of the middle finger.
    """
    width, height = corners[1] - corners[0]
    return _grown(corners.mean(axis=0), width, height, _upright(wrist, middle_base), shift=0.5, scale=2.6)


def from_landmarks(points: Array) -> Roi:
    """Return the region of the hand for the next frame from (21, 2) landmarks in pixels of this frame."""
    index, middle, ring = points[list(_BASES_OF_INDEX_MIDDLE_RING)]
    rotation = _upright(points[0], ((index + ring) / 2 + middle) / 2)
    steady = points[list(_STEADY_LANDMARKS)]
    axes = Roi(0, 0, 1, rotation).axes
    about = (steady.min(axis=0) + steady.max(axis=0)) / 2
    turned = (steady - about) @ axes.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    width, height = high - low
    return _grown((low + high) / 2 @ axes + about, width, height, rotation, shift=0.1, scale=2.0)


def _upright(wrist: Array, fingers: Array) -> float:
    """Return the rotation of a region in which ``fingers`` is straight above ``wrist``, -pi to pi."""
    x, y = fingers - wrist
    rotation = pi / 2 - atan2(-y, x)
    return rotation - 2 * pi if rotation > pi else rotation


def _grown(center: Array, width: float, height: float, rotation: float, *, shift: float, scale: float) -> Roi:
    """Return a square around a box, shifted by ``shift`` of its height towards the fingers and scaled by ``scale``."""
    x = center[0] + shift * height * sin(rotation)
    y = center[1] - shift * height * cos(rotation)
    return Roi(float(x), float(y), float(max(width, height) * scale), rotation)
