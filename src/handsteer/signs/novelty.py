"""How far a hand is from all that was learned: landmarks that are no hand at all should not get a sign by chance."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.signs.network import rounded

Array = NDArray[np.float64]

_SHRINKAGE: Final = 0.1


@dataclass(frozen=True)
class Novelty:
    """Mahalanobis distances to the classes, with one covariance for all of them.

    Attributes:
        mean: (features,) subtracted from the features first.
        scale: (features,) that they are multiplied by then.
        centres: (classes, features) mean of each class, scaled.
        whitening: (features, features) after which all classes spread alike in all directions.
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
    """Return what is normal for (n, features) of (n,) classes: as far as 999 of 1000 are.

    Args:
        features: (n, features).
        classes: (n,) from 0; each occurs.
        mean: (features,) subtracted from the features first.
        scale: (features,) that they are multiplied by then.
        margin: How many times as far as those a hand may be.
    """
    scaled = (features - mean) * scale
    centres = rounded(np.stack([scaled[classes == each].mean(axis=0) for each in range(classes.max() + 1)]))
    gaps = scaled - centres[classes]
    # The covariance is mixed with an even one, as real hands differ from made ones in ways that these never do.
    covariance = (1 - _SHRINKAGE) * (gaps.T @ gaps) / len(gaps) + _SHRINKAGE * np.eye(gaps.shape[1])
    whitening = rounded(np.linalg.cholesky(np.linalg.inv(covariance)))
    novelty = Novelty(mean, scale, centres, whitening, np.inf)
    farthest = np.quantile(novelty.distances(features, classes), 0.999)
    return Novelty(mean, scale, centres, whitening, round(margin * float(farthest), 2))
