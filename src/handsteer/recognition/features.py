"""Features of a hand's shape, invariant to side, position, size and rotation in the image.

They are distances in palm lengths and angles between bones, which translation, scaling, mirroring and rotation of the
picture do not change. So one side and one direction are enough to train on. Pointing directions are measured separately
(:func:`directions`).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

WRIST, THUMB_TIP, INDEX_BASE, INDEX_TIP, MIDDLE_BASE, MIDDLE_TIP, LITTLE_BASE = 0, 4, 5, 8, 9, 12, 17
KNUCKLES: Final = (5, 9, 13, 17)
PALM: Final = [WRIST, *KNUCKLES]
"""Landmarks that the fingers do not move."""

_DIGITS: Final = np.array(
    [[0, 1, 2, 3, 4], [0, 5, 6, 7, 8], [0, 9, 10, 11, 12], [0, 13, 14, 15, 16], [0, 17, 18, 19, 20]]
)
BONE_ENDS: Final = (_DIGITS[:, 1:].ravel(), _DIGITS[:, :-1].ravel())
"""Landmarks at the far and the near ends of the 20 bones, digit by digit."""

PAIRS: Final = np.array(
    [
        *((tip, WRIST) for tip in (4, 8, 12, 16, 20)),
        *((tip, tip - 3) for tip in (4, 8, 12, 16, 20)),
        *((tip, tip - 2) for tip in (8, 12, 16, 20)),
        *((8, 9), (12, 13), (16, 9), (20, 13), (8, 17), (20, 5)),
        *((THUMB_TIP, other) for other in (5, 6, 7, 8, 9, 10, 11, 13, 14, 17)),
        *((3, 5), (3, 6), (3, 17), (2, 5), (2, 17)),
        *((8, 12), (12, 16), (16, 20), (6, 10), (10, 14), (14, 18)),
        *((5, 17), (5, 0), (17, 0)),
    ]
)
"""Pairs of landmarks whose distances distinguish shapes."""

BEND_COUNT: Final = 15
PAIR_COUNT: Final = len(PAIRS)
COUNT: Final = BEND_COUNT + 2 * PAIR_COUNT + 1
"""Number of features."""


def shape_features(pixels: Array, world: Array) -> NDArray[np.float64]:
    """Return the (n, :data:`COUNT`) features of n hands; finite for all finite landmarks.

    Args:
        pixels: (n, 21, 2) landmarks in pixels.
        world: (n, 21, 3) landmarks in metres, with the image's axes.
    """
    world = np.asarray(world, np.float64)
    palm = np.linalg.norm(world[:, KNUCKLES] - world[:, :1], axis=2).mean(axis=1)
    palm = np.maximum(palm, 1e-6)[:, None]
    image = _in_metres(np.asarray(pixels, np.float64), world)
    facing = _facing(world)
    features = np.concatenate(
        [bone_bends(world), pair_distances(world) / palm, pair_distances(image) / palm, facing], axis=1
    )
    clipped: NDArray[np.float64] = np.clip(features, -5.0, 5.0)
    return clipped


def directions(pixels: Array) -> tuple[Array, Array, Array]:
    """Return the directions of index finger, thumb and palm in the image: (n, 2) vectors each, x right, y down.

    The thumb's direction is the mean of two: from the middle of the knuckles to the thumb's tip, and from the little
    finger's knuckle to the index finger's. Thumbs bend: on photos of thumbs up this direction deviated from the
    vertical by 9 degrees (root mean square), each of the two alone by 12, and the thumb's own direction by 25. The
    palm's direction is from the wrist to the middle of the knuckles.

    Args:
        pixels: (n, 21, 2) landmarks in pixels.
    """
    knuckles = pixels[:, KNUCKLES].mean(axis=1)
    index = pixels[:, INDEX_TIP] - pixels[:, INDEX_BASE]
    thumb = unit(pixels[:, THUMB_TIP] - knuckles) + unit(pixels[:, INDEX_BASE] - pixels[:, LITTLE_BASE])
    return index, thumb, knuckles - pixels[:, WRIST]


def unit(vectors: Array) -> Array:
    """Return (n, axes) ``vectors`` with the length 1, or 0."""
    lengths: Array = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(lengths, 1e-9)


def _facing(world: Array) -> Array:
    """Return (n, 1) cosines, 0 to 1, between the palm's normal and the camera's axis."""
    # Written out, because numpy's cross product takes as long as all other features together.
    ax, ay, az = (world[:, 5] - world[:, 0]).T
    bx, by, bz = (world[:, 17] - world[:, 0]).T
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    facing: Array = (np.abs(z) / np.maximum(np.sqrt(x * x + y * y + z * z), 1e-12))[:, None]
    return facing


def _in_metres(pixels: Array, world: Array) -> Array:
    """Return (n, 21, 2) centred image points, scaled to the size of the world landmarks in the image plane."""
    flat = world[:, :, :2] - world[:, :, :2].mean(axis=1, keepdims=True)
    pixels = pixels - pixels.mean(axis=1, keepdims=True)
    scale = np.sqrt((flat**2).sum(axis=(1, 2)) / np.maximum((pixels**2).sum(axis=(1, 2)), 1e-12))
    scaled: Array = pixels * scale[:, None, None]
    return scaled


def bone_bends(points: Array) -> Array:
    """Return (n, 15) angles between adjacent bones of (n, 21, 2 or 3) landmarks, in radians, digit by digit."""
    bones = points[:, BONE_ENDS[0]] - points[:, BONE_ENDS[1]]
    bones = (bones / np.maximum(np.linalg.norm(bones, axis=2, keepdims=True), 1e-9)).reshape(-1, 5, 4, bones.shape[2])
    cosines = (bones[:, :, 1:] * bones[:, :, :-1]).sum(axis=3)
    angles: Array = np.arccos(np.clip(cosines, -1.0, 1.0)).reshape(-1, 15)
    return angles


def pair_distances(points: Array) -> Array:
    """Return (n, :data:`PAIR_COUNT`) distances that distinguish shapes of (n, 21, 2 or 3) landmarks, in their unit."""
    gaps = points[:, PAIRS[:, 0]] - points[:, PAIRS[:, 1]]
    lengths: Array = np.sqrt((gaps**2).sum(axis=2))
    return lengths
