"""Data augmentation: varies the hands of a few takes, to resemble other people who show the same sign."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.virtual_hand.kinematics import turn_x, turn_y, turn_z
from handsteer.recognition.features import KNUCKLES, WRIST

Array = NDArray[np.float64]

_TILT_RAD: Final = np.radians(30.0)
_VIEW_RAD: Final = np.radians(12.0)
_BONES: Final = 0.06
_ERROR: Final = 0.02
_DEPTH_ERROR: Final = 0.04
_SIDEWAYS: Final = np.cos(np.radians(35.0))
_TIPS: Final = (4, 8, 12, 16, 20)
_PARENTS: Final = (0, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 0, 13, 14, 15, 0, 17, 18, 19)


def vary(
    pixels: Array, world: Array, count: int, random: np.random.Generator, *, both_hands: bool
) -> tuple[Array, Array]:
    """Return pixels and world landmarks of ``count`` hands, each a variation of a given one.

    They are rotated in the image by up to 30 degrees, turned sideways, up or down by 12 degrees (standard deviation),
    with bones longer or shorter by 6 % and landmark errors of 2 % of the hand; half of them are mirrored if
    ``both_hands``. Without world landmarks the same is done in the image.

    Args:
        pixels: (n, 21, 2) landmarks in pixels.
        world: (n, 21, 3) landmarks in metres, or NaN.
        count: Number of hands to return.
        random: Random generator.
        both_hands: Whether the mirrored hand shows the same sign.

    Returns:
        (count, 21, 2) pixels and (count, 21, 3) metres, relative to the hands' centres.
    """
    chosen = random.integers(0, len(pixels), count)
    image = _about_centre(pixels[chosen])
    flat = not np.isfinite(world).all()
    solid = np.concatenate([image, np.zeros((count, 21, 1))], axis=2) if flat else _about_centre(world[chosen])
    # In the unit of the world landmarks from here on; differences between the two remain.
    image = image * _sizes(solid[..., :2]) / np.maximum(_sizes(image), 1e-12)
    rest = image - solid[..., :2]
    solid = _with_other_bones(solid, 1.0 + _BONES * random.normal(0, 1, (count, 21, 1)))
    turn_in_image = turn_z(random.uniform(-_TILT_RAD, _TILT_RAD, count))
    aside = turn_x(random.normal(0, _VIEW_RAD, count)) @ turn_y(random.normal(0, _VIEW_RAD, count))
    solid = solid @ np.swapaxes(turn_in_image @ aside, 1, 2)
    rest = rest @ np.swapaxes(turn_in_image[:, :2, :2], 1, 2)
    size = _sizes(solid) / np.sqrt(21)
    image = solid[..., :2] + rest + _ERROR * size * random.normal(0, 1, (count, 21, 2))
    solid = solid + size * random.normal(0, (_ERROR, _ERROR, _DEPTH_ERROR), (count, 21, 3))
    if both_hands:
        side = np.where(random.random((count, 1)) < 0.5, -1.0, 1.0)
        image[..., 0] *= side
        solid[..., 0] *= side
    return image, (np.full_like(solid, np.nan) if flat else solid)


def mirrored(points: Array) -> Array:
    """Return (n, 21, 2 or 3) landmarks, mirrored."""
    other = points.copy()
    other[..., 0] *= -1
    return other


def points_sideways(pixels: Array) -> bool:
    """Return whether (n, 21, 2) hands all point to one side of the image, so that mirroring reverses their meaning.

    Both the palm, from the wrist to the knuckles, and the mean of the fingertips, from the middle of the palm, must
    point sideways. A thumb alone is not enough: its side only distinguishes left from right hands.
    """
    knuckles = pixels[:, KNUCKLES].mean(axis=1)
    palm = _mean_direction(knuckles - pixels[:, WRIST])
    fingers = _mean_direction(pixels[:, _TIPS].mean(axis=1) - (knuckles + pixels[:, WRIST]) / 2)
    return bool(min(abs(palm), abs(fingers)) >= _SIDEWAYS and palm * fingers > 0)


def _mean_direction(vectors: Array) -> float:
    """Return the mean horizontal direction of (n, 2) vectors, -1 to 1, right positive."""
    lengths = np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)
    return float((vectors[:, 0] / lengths).mean())


def _with_other_bones(points: Array, factors: Array) -> Array:
    """Return (n, 21, 3) points with each bone scaled by its (n, 21, 1) factor, in the same directions."""
    grown = points.copy()
    for joint, parent in enumerate(_PARENTS):
        if joint != parent:
            grown[:, joint] = grown[:, parent] + (points[:, joint] - points[:, parent]) * factors[:, joint]
    return grown


def _about_centre(points: Array) -> Array:
    centred: Array = points - points.mean(axis=1, keepdims=True)
    return centred


def _sizes(points: Array) -> Array:
    """Return (n, 1, 1) sizes of (n, points, axes): the root of the sum of squares."""
    sizes: Array = np.sqrt((points**2).sum(axis=(1, 2), keepdims=True))
    return sizes
