"""Draws the recognition into the picture, mirrored, as people see themselves."""

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.hand import CONNECTIONS, Hand
from handsteer.recognition.recognizer import Recognition
from handsteer.types import NONE

_BONE = (255, 255, 255)
_JOINT = (60, 160, 255)
_COUNTS = (90, 200, 90)
_WAITS = (60, 180, 250)


def annotate(image: NDArray[np.uint8], recognition: Recognition) -> NDArray[np.uint8]:
    """Return a mirrored copy of ``image``, (height, width, 3) uint8, BGR, with the hand's skeleton and the sign."""
    picture = draw_hand(image, recognition.hand)
    if recognition.seen != NONE:
        _draw_label(picture, recognition)
    return picture


def draw_hand(image: NDArray[np.uint8], hand: Hand | None) -> NDArray[np.uint8]:
    """Return a mirrored copy of ``image``, (height, width, 3) uint8, BGR, with the skeleton of ``hand``."""
    picture = np.asarray(cv2.flip(image, 1), np.uint8)
    if hand is not None:
        _draw_skeleton(picture, hand.pixels[:, :2])
    return picture


def _draw_skeleton(picture: NDArray[np.uint8], pixels: NDArray[np.float32]) -> None:
    height, width = picture.shape[:2]
    x = width - 1 - pixels[:, 0]
    # Landmarks may lie far outside the frame; OpenCV requires coordinates that fit 16 bits.
    points = np.stack([x, pixels[:, 1]], axis=1).clip(-width, 2 * width).round().astype(int).tolist()
    thickness = max(1, height // 240)
    for begin, end in CONNECTIONS:
        cv2.line(picture, points[begin], points[end], _BONE, thickness, cv2.LINE_AA)
    for point in points:
        cv2.circle(picture, point, 2 * thickness, _JOINT, -1, cv2.LINE_AA)


def _draw_label(picture: NDArray[np.uint8], recognition: Recognition) -> None:
    scale = picture.shape[0] / 480
    colour = _COUNTS if recognition.sign == recognition.seen else _WAITS
    text = f"{recognition.seen} {recognition.confidence:.0%}"
    origin = (round(16 * scale), round(40 * scale))
    # An anti-aliased outline would double the drawing time for little visible effect.
    for ink, thickness, line in (((0, 0, 0), 5, cv2.LINE_8), (colour, 2, cv2.LINE_AA)):
        cv2.putText(picture, text, origin, cv2.FONT_HERSHEY_SIMPLEX, scale, ink, max(1, round(thickness * scale)), line)
