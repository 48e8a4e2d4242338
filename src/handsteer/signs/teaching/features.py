"""Numbers that say what shape a hand has and where it points: a thumb up is another sign than a thumb sideways."""

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
"""Whether hands are known in space, or in the image only."""

_DIRECTIONS: Final = 6
FEATURE_COUNTS: Final[dict[Depth, int]] = {
    "full": COUNT + _DIRECTIONS,
    "flat": BEND_COUNT + PAIR_COUNT + _DIRECTIONS,
}
"""How many features there are."""


def taught_features(pixels: Array, world: Array, depth: Depth) -> Array:
    """Return the (n, features) of n hands.

    They are those of :func:`~handsteer.signs.features.shape_features` (``flat``: the angles and distances in the image,
    in palm lengths), and unit vectors for where index finger, thumb and palm point in the image.

    Args:
        pixels: (n, 21, 2) landmarks in pixels, of an image that is not mirrored.
        world: (n, 21, 3) landmarks in metres, axes as the image's; not looked at when ``flat``.
        depth: What is known of the hands.
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
