"""Labels the shape of a hand by its true joints; ambiguous hands get no label and are not trained on."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.hand.kinematics import ANGLES, Array

OPEN, INDEX, THUMB, FIST, OTHER = "open", "index", "thumb", "fist", "other"
SHAPES: Final = (OPEN, INDEX, THUMB, FIST, OTHER)
"""The classes of the network."""

Flags = NDArray[np.bool_]

_UNSURE: Final = -1
_FIRST_FINGER: Final = ANGLES.index("index_spread")


def name_shapes(angles: Array, joints: Array, elevations: Array, facing: Array) -> NDArray[np.int64]:
    """Return (n,) indices into :data:`SHAPES`, -1 if ambiguous.

    Args:
        angles: (n, 23) joint angles, radians.
        joints: (n, 21, 3) metres.
        elevations: (n, 2) angles of the index finger and of the thumb's tip to the image plane, radians, 0 to pi / 2.
        facing: (n,) 0 to 1, how directly the palm or the back of the hand faces the camera.
    """
    reach = thumb_reach(joints)
    straight, open_enough = _straight(angles)
    closed, closed_enough = _closed(angles)
    apart, aslant = thumb_gap(joints), np.degrees(thumb_angle(joints))
    curled, curled_enough = _closed(angles, ease=10.0)
    elevation = np.degrees(elevations)
    sure = {
        OPEN: straight.all(axis=1) & (reach >= 0.92) & (facing >= 0.4),
        INDEX: straight[:, 0] & curled[:, 1:].all(axis=1) & (reach <= 1.0) & (elevation[:, 0] <= 55),
        THUMB: closed.all(axis=1) & (reach >= 1.05) & (apart >= 0.5) & (aslant >= 38) & (elevation[:, 1] <= 55),
        FIST: closed.all(axis=1) & ((reach <= 0.82) | (aslant <= 28) & (reach <= 1.1)),
    }
    possible = {
        OPEN: open_enough.all(axis=1) & (reach >= 0.82),
        INDEX: open_enough[:, 0] & curled_enough[:, 1:].all(axis=1) & (reach <= 1.2) & (elevation[:, 0] <= 68),
        THUMB: closed_enough.all(axis=1) & (reach >= 0.9) & (apart >= 0.35) & (aslant >= 28) & (elevation[:, 1] <= 68),
        FIST: closed_enough.all(axis=1) & ((reach <= 0.98) | (aslant <= 36) & (reach <= 1.25)),
    }
    named = np.full(len(angles), _UNSURE)
    for shape, holds in sure.items():
        named[holds] = SHAPES.index(shape)
    named[~np.any(list(possible.values()), axis=0)] = SHAPES.index(OTHER)
    return named


def thumb_reach(joints: Array) -> Array:
    """Return (n,) distances of the thumb's tip from the little finger's base, in palm lengths."""
    palm = np.linalg.norm(joints[:, [5, 9, 13, 17]] - joints[:, :1], axis=2).mean(axis=1)
    reach: Array = np.linalg.norm(joints[:, 4] - joints[:, 17], axis=1) / palm
    return reach


def thumb_gap(joints: Array) -> Array:
    """Return (n,) distances of the thumb's tip from the nearer of the index and middle fingertips, in palm lengths."""
    palm = np.linalg.norm(joints[:, [5, 9, 13, 17]] - joints[:, :1], axis=2).mean(axis=1)
    gaps: Array = np.linalg.norm(joints[:, [8, 12]] - joints[:, 4:5], axis=2).min(axis=1) / palm
    return gaps


def thumb_angle(joints: Array) -> Array:
    """Return (n,) angles between the thumb, from its knuckle to its tip, and the palm, radians.

    A thumb along the index finger belongs to a fist, as the landmark model reports most plain fists.
    """
    thumb = joints[:, 4] - joints[:, 2]
    palm = joints[:, [5, 9, 13, 17]].mean(axis=1) - joints[:, 0]
    cosines = (thumb * palm).sum(axis=1) / np.linalg.norm(thumb, axis=1) / np.linalg.norm(palm, axis=1)
    angles: Array = np.arccos(np.clip(cosines, -1.0, 1.0))
    return angles


def _straight(angles: Array) -> tuple[Flags, Flags]:
    """Return (n, 4) flags of fingers that are surely straight, and of those that may be."""
    mcp, pip, dip = _degrees(angles)
    fold = mcp + pip + 0.5 * dip
    return (pip <= 32) & (fold <= 70), (pip <= 52) & (fold <= 100)


def _closed(angles: Array, ease: float = 0.0) -> tuple[Flags, Flags]:
    """Return (n, 4) flags of fingers that are surely closed, and that may be; ``ease`` relaxes both, in degrees."""
    mcp, pip, dip = _degrees(angles)
    # Little fingers bend less than the others, even in a fist.
    fold = (mcp + pip + 0.5 * dip) * (1.0, 1.0, 1.0, 1.15) + ease
    return (pip >= 62 - ease) & (fold >= 115), (pip >= 46 - ease) & (fold >= 95)


def _degrees(angles: Array) -> Array:
    """Return (3, n, 4) mcp, pip and dip of the fingers in degrees."""
    fingers = angles[:, _FIRST_FINGER:].reshape(-1, 4, 4)
    degrees: Array = np.degrees(np.moveaxis(fingers[:, :, 1:], 2, 0))
    return degrees
