"""Hands made of straight lines, for tests of rules: what they show is plain from how they are made."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.protocol import Hand

SIZE = (640, 480)
_BASES = {"index": (-0.03, 0.09), "middle": (-0.01, 0.095), "ring": (0.01, 0.09), "little": (0.03, 0.08)}


def make_hand(
    *, straight: tuple[str, ...] = (), thumb_out: bool = False, turn: float = 0.0, mirrored: bool = False
) -> Hand:
    """Return a hand seen from its palm, fingers up; in metres, x right, y up before it is turned left by ``turn`` rad.

    Unturned and not mirrored, the thumb is at the image's left.
    """
    points = [(0.0, 0.0, 0.0), (-0.02, 0.02, 0.0), (-0.035, 0.045, 0.0)]
    points += (
        [(-0.06, 0.06, 0.0), (-0.085, 0.075, 0.0)] if thumb_out else [(-0.03, 0.065, -0.02), (-0.005, 0.06, -0.03)]
    )
    for finger, (x, y) in _BASES.items():
        if finger in straight:
            points += [(x, y, 0.0), (x, y + 0.04, 0.0), (x, y + 0.065, 0.0), (x, y + 0.085, 0.0)]
        else:
            points += [(x, y, 0.0), (x, y + 0.02, -0.03), (x, y - 0.01, -0.04), (x, y - 0.02, -0.02)]
    world = np.array(points, np.float64)
    if mirrored:
        world[:, 0] *= -1
    cos, sin = math.cos(turn), math.sin(turn)
    world[:, :2] = world[:, :2] @ np.array([[cos, sin], [-sin, cos]])
    world[:, 1] *= -1
    return Hand(
        points=_project(world),
        world=world.astype(np.float32),
        handedness="Left" if mirrored else "Right",
        handedness_score=0.99,
        presence=0.99,
        image_size=SIZE,
    )


def _project(world: NDArray[np.float64]) -> NDArray[np.float32]:
    pixels = world * 1200 + np.array([320.0, 280.0, 0.0])
    points: NDArray[np.float32] = (pixels / np.array([SIZE[0], SIZE[1], SIZE[0]])).astype(np.float32)
    return points
