"""A model of taught signs that was not taught."""

import numpy as np

from handsteer.signs.network import Network
from handsteer.signs.novelty import Novelty
from handsteer.signs.teaching.features import FEATURE_COUNTS, Depth
from handsteer.signs.teaching.taught import TaughtModel

COUNT = FEATURE_COUNTS["full"]


def model(
    *, hi: float = 0.9, ho: float | None = None, limit: float = 1e9, threshold: float = 0.8, depth: Depth = "full"
) -> TaughtModel:
    """Return a model that takes every hand for Hi with that likelihood, and for Ho with the other."""
    ho = (1 - hi) / 2 if ho is None else ho
    biases = np.log([hi, ho, 1 - hi - ho])
    count = FEATURE_COUNTS[depth]
    network = Network(np.zeros(count), np.ones(count), (np.zeros((count, 3)),), (biases,))
    novelty = Novelty(network.mean, network.scale, np.zeros((2, count)), np.eye(count), limit)
    return TaughtModel(("Hi", "Ho"), depth, network, novelty, np.array([threshold, 0.8]), {"persons": 1})
