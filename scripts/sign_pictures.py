"""Draws the six signs, mirrored, for the README: ``python scripts/sign_pictures.py``."""

from pathlib import Path

import cv2
import numpy as np

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.types import BACKWARD, FORWARD, GO, STOP, TURN_LEFT, TURN_RIGHT

OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "signs.png"
SIDE, LABEL = 200, 30
SIGNS = (FORWARD, BACKWARD, TURN_LEFT, TURN_RIGHT, GO, STOP)


def picture(sign: str) -> np.ndarray:
    """Return a mirrored picture of a sign and its name below, (SIDE + LABEL, SIDE, 3) uint8, BGR."""
    clock = SteppedClock()
    camera = VirtualHandCamera(VirtualHandConfig(script=f"{sign}:5"), width=640, height=480, fps=30, clock=clock)
    clock.advance(1.0)
    joints = camera.truth(clock.now()).joints_px
    middle = (joints.min(axis=0) + joints.max(axis=0)) / 2
    half = 140
    left = int(np.clip(middle[0] - half, 0, 640 - 2 * half))
    top = int(np.clip(middle[1] - half, 0, 480 - 2 * half))
    square = camera.read().image[top : top + 2 * half, left : left + 2 * half]
    small = cv2.resize(cv2.flip(square, 1), (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    label = np.full((LABEL, SIDE, 3), 255, np.uint8)
    (width, _), _ = cv2.getTextSize(sign, cv2.FONT_HERSHEY_DUPLEX, 0.6, 1)
    at = ((SIDE - width) // 2, LABEL - 9)
    cv2.putText(label, sign, at, cv2.FONT_HERSHEY_DUPLEX, 0.6, (60, 30, 20), 1, cv2.LINE_AA)
    return np.vstack([small, label])


def main() -> None:
    gap = np.full((SIDE + LABEL, 8, 3), 255, np.uint8)
    row = [part for sign in SIGNS for part in (picture(sign), gap)][:-1]
    cv2.imwrite(str(OUT), np.hstack(row), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{OUT.name}: {OUT.stat().st_size} bytes")


if __name__ == "__main__":
    main()
