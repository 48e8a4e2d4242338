"""Features of a hand's shape and of its direction: unlike shipped shapes, taught signs may differ in direction only."""

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from handsteer.signs.features import (
    BEND_COUNT,
    COUNT,
    KNUCKLES,
    PAIR_COUNT,
    WRIST,
    bone_bends,
    directions,
    pair_distances,
    shape_features,
)

Array = NDArray[np.float64]

Depth = Literal["full", "flat"]
"""Whether landmarks have depth, or are known in the image only."""

_DIRECTIONS: Final = 6
FEATURE_COUNTS: Final[dict[Depth, int]] = {
    "full": COUNT + _DIRECTIONS,
    "flat": BEND_COUNT + PAIR_COUNT + _DIRECTIONS,
}
"""Number of features."""


def taught_features(pixels: Array, world: Array, depth: Depth) -> Array:
    """Return the (n, features) of n hands.

    They are those of :func:`~handsteer.signs.features.shape_features` (``flat``: the angles and distances in the image,
    in palm lengths), and unit vectors of the directions of index finger, thumb and palm in the image.

    Args:
        pixels: (n, 21, 2) landmarks in pixels, of an image that is not mirrored.
        world: (n, 21, 3) landmarks in metres, with the image's axes; ignored if ``flat``.
        depth: Kind of the landmarks.
    """
    pointing = [_unit(vectors) for vectors in directions(pixels)]
    if depth == "full":
        return np.concatenate([shape_features(pixels, world), *pointing], axis=1)
    palm = np.linalg.norm(pixels[:, KNUCKLES] - pixels[:, [WRIST]], axis=2).mean(axis=1, keepdims=True)
    lengths = np.clip(pair_distances(pixels) / np.maximum(palm, 1e-6), 0.0, 5.0)
    return np.concatenate([bone_bends(pixels), lengths, *pointing], axis=1, dtype=np.float64)


def _unit(vectors: NDArray[np.floating]) -> Array:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-9), np.float64)
