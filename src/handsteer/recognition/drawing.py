"""Draws what was recognised into a frame."""

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.features import PALM, directions
from handsteer.recognition.hand import CONNECTIONS, Hand
from handsteer.recognition.recognizer import Recognition
from handsteer.types import NONE

_BONE = (255, 255, 255)
_JOINT = (60, 160, 255)
_COUNTS = (90, 200, 90)
_WAITS = (60, 180, 250)


def annotate(image: NDArray[np.uint8], recognition: Recognition, *, names_sign: bool = True) -> NDArray[np.uint8]:
    """Return a mirrored copy of ``image``, (height, width, 3) uint8, BGR, that shows what was recognised.

    It has the hand's skeleton, the palm's direction, with ``names_sign`` the name of the sign, and a ring around the
    palm that fills while the sign is confirmed.
    """
    picture = draw_hand(image, recognition.hand)
    if recognition.hand is not None:
        _draw_palm(picture, recognition.hand, recognition)
    if names_sign and recognition.seen != NONE:
        _draw_label(picture, recognition)
    return picture


def draw_hand(image: NDArray[np.uint8], hand: Hand | None) -> NDArray[np.uint8]:
    """Return a mirrored copy of ``image``, (height, width, 3) uint8, BGR, with the skeleton of ``hand``."""
    picture = np.asarray(cv2.flip(image, 1), np.uint8)
    if hand is not None:
        points = _mirrored(picture, hand.pixels[:, :2])
        thickness = max(1, picture.shape[0] // 240)
        for begin, end in CONNECTIONS:
            cv2.line(picture, points[begin], points[end], _BONE, thickness, cv2.LINE_AA)
        for point in points:
            cv2.circle(picture, point, 2 * thickness, _JOINT, -1, cv2.LINE_AA)
    return picture


def _mirrored(picture: NDArray[np.uint8], pixels: NDArray[np.floating]) -> list[tuple[int, int]]:
    """Return the places of (n, 2) pixels in the mirrored ``picture``."""
    width = picture.shape[1]
    points = np.stack([width - 1 - pixels[:, 0], pixels[:, 1]], axis=1)
    # Landmarks may lie far outside the frame; OpenCV requires coordinates that fit 16 bits.
    return [(x, y) for x, y in points.clip(-width, 2 * width).round().astype(int).tolist()]


def _draw_palm(picture: NDArray[np.uint8], hand: Hand, recognition: Recognition) -> None:
    """Draw the palm's direction, and around the palm the progress of confirming the sign."""
    pixels = hand.pixels[:, :2]
    direction = directions(pixels[None])[2][0]
    palm = pixels[PALM].mean(axis=0)
    centre, tip = _mirrored(picture, np.stack([palm, palm + 0.55 * direction]))
    thickness = max(1, picture.shape[0] // 240)
    colour = _colour(recognition) if recognition.seen != NONE else _BONE
    cv2.arrowedLine(picture, centre, tip, colour, thickness, cv2.LINE_AA, tipLength=0.3)
    radius = min(round(0.34 * float(np.hypot(*direction))), picture.shape[0])
    if recognition.seen != NONE and radius > 0:
        share = 1.0 if recognition.sign == recognition.seen else recognition.progress
        cv2.circle(picture, centre, radius, (60, 60, 60), thickness, cv2.LINE_AA)
        cv2.ellipse(picture, centre, (radius, radius), -90, 0, 360 * share, colour, 2 * thickness, cv2.LINE_AA)


def _draw_label(picture: NDArray[np.uint8], recognition: Recognition) -> None:
    scale = picture.shape[0] / 480
    colour, text = _colour(recognition), recognition.seen
    origin = (round(16 * scale), round(40 * scale))
    # An anti-aliased outline would double the drawing time for little visible effect.
    for ink, thickness, line in (((0, 0, 0), 5, cv2.LINE_8), (colour, 2, cv2.LINE_AA)):
        cv2.putText(picture, text, origin, cv2.FONT_HERSHEY_SIMPLEX, scale, ink, max(1, round(thickness * scale)), line)


def _colour(recognition: Recognition) -> tuple[int, int, int]:
    return _COUNTS if recognition.sign == recognition.seen else _WAITS
