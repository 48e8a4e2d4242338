"""A plain drawing of an open hand, enough for the real models to find it: frames for tests that need no photos."""

import cv2
import numpy as np

from tests.recognition.golden_frames import FIXTURE

_SKIN = (120, 150, 205)
_SHADOW = (70, 95, 140)
_WALL = (150, 140, 120)
_PALM = (0, 1, 5, 9, 13, 17)
_FINGERS = ((0, 1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16), (17, 18, 19, 20))


def open_right_hand(x: float, y: float, size: float = 90) -> np.ndarray:
    """Return (21, 2) landmarks of an open right hand about ``(x, y)``; from wrist to fingers it is ``size`` pixels."""
    with np.load(FIXTURE) as golden:
        row = next(i for i, path in enumerate(golden["photo_paths"]) if path.startswith("stop/sld"))
        points = golden["photos_pixels"][row, :, :2]
        centred = points - points.mean(axis=0)
    return np.asarray(centred * (size / np.linalg.norm(points[9] - points[0])) + (x, y))


def open_left_hand(x: float, y: float, size: float = 90) -> np.ndarray:
    """Return (21, 2) landmarks of an open left hand, as :func:`open_right_hand`."""
    return open_right_hand(-x, y, size) * (-1, 1)


def draw(*hands: np.ndarray, width: int = 640, height: int = 480) -> np.ndarray:
    """Return a (height, width, 3) uint8 BGR frame with ``hands``, each (21, 2) in pixels."""
    image = np.full((height, width, 3), _WALL, np.uint8)
    for points in hands:
        _draw_hand(image, points)
    return cv2.GaussianBlur(image, (0, 0), 2)


def _draw_hand(image: np.ndarray, points: np.ndarray) -> None:
    along = points[9] - points[0]
    thick = round(0.26 * np.linalg.norm(along))
    palm = cv2.convexHull(points[list(_PALM)].round().astype(np.int32))
    cv2.fillPoly(image, [palm], _SKIN)
    cv2.polylines(image, [palm], isClosed=True, color=_SKIN, thickness=thick)
    _line(image, [points[0], points[0] - 0.9 * along], _SKIN, 2 * thick)
    for finger in _FINGERS:
        _line(image, points[list(finger)], _SHADOW, thick + 2)
        _line(image, points[list(finger)], _SKIN, thick - 2)


def _line(
    image: np.ndarray, points: np.ndarray | list[np.ndarray], color: tuple[int, int, int], thickness: int
) -> None:
    line = np.array(points).round().astype(np.int32)
    cv2.polylines(image, [line], isClosed=False, color=color, thickness=thickness)
