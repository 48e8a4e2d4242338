"""Distance of a hand from the training data, so that landmarks that are no hand get no sign by chance."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.signs.network import rounded

Array = NDArray[np.float64]

_SHRINKAGE: Final = 0.1


@dataclass(frozen=True)
class Novelty:
    """Mahalanobis distances to the classes, with one shared covariance.

    Attributes:
        mean: (features,) subtracted from the features.
        scale: (features,) factors applied after that.
        centres: (classes, features) mean of each class, scaled.
        whitening: (features, features) whitens the shared covariance.
        limit: Distance beyond which a hand counts as new.
    """

    mean: Array
    scale: Array
    centres: Array
    whitening: Array
    limit: float

    def distances(self, features: Array, classes: NDArray[np.integer]) -> Array:
        """Return the (n,) distances of (n, features) from the centres of their (n,) classes; typically about 1."""
        gaps = ((features - self.mean) * self.scale - self.centres[classes]) @ self.whitening
        distances: Array = np.sqrt((gaps**2).mean(axis=1))
        return distances


def learn_novelty(
    features: Array, classes: NDArray[np.int64], mean: Array, scale: Array, margin: float = 1.0
) -> Novelty:
    """Return the novelty of (n, features) of (n,) classes, with the 99.9 % quantile of their distances as limit.

    Args:
        features: (n, features).
        classes: (n,) from 0; each occurs.
        mean: (features,) subtracted from the features.
        scale: (features,) factors applied after that.
        margin: Factor on the limit.
    """
    scaled = (features - mean) * scale
    centres = rounded(np.stack([scaled[classes == each].mean(axis=0) for each in range(classes.max() + 1)]))
    gaps = scaled - centres[classes]
    # Shrinkage towards a uniform covariance, because real hands vary in ways that synthetic ones never do.
    covariance = (1 - _SHRINKAGE) * (gaps.T @ gaps) / len(gaps) + _SHRINKAGE * np.eye(gaps.shape[1])
    whitening = rounded(np.linalg.cholesky(np.linalg.inv(covariance)))
    novelty = Novelty(mean, scale, centres, whitening, np.inf)
    farthest = np.quantile(novelty.distances(features, classes), 0.999)
    return Novelty(mean, scale, centres, whitening, round(margin * float(farthest), 2))
