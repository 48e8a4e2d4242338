"""A model of taught signs that was not taught."""

import numpy as np

from handsteer.recognition.custom_signs import FEATURE_COUNTS, CustomModel, Depth
from handsteer.recognition.network import Network, Novelty

COUNT = FEATURE_COUNTS["full"]


def model(
    *, hi: float = 0.9, ho: float | None = None, limit: float = 1e9, threshold: float = 0.8, depth: Depth = "full"
) -> CustomModel:
    """Return a model that takes every hand for Hi with that likelihood, and for Ho with the other."""
    ho = (1 - hi) / 2 if ho is None else ho
    biases = np.log([hi, ho, 1 - hi - ho])
    count = FEATURE_COUNTS[depth]
    network = Network(np.zeros(count), np.ones(count), (np.zeros((count, 3)),), (biases,))
    novelty = Novelty(network.mean, network.scale, np.zeros((2, count)), np.eye(count), limit)
    return CustomModel(("Hi", "Ho"), depth, network, novelty, np.array([threshold, 0.8]), {"persons": 1})
