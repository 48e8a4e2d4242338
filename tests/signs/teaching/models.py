"""A model of taught signs that was not taught."""

import numpy as np

from handsteer.signs.network import Network
from handsteer.signs.novelty import Novelty
from handsteer.signs.teaching.features import FEATURE_COUNTS
from handsteer.signs.teaching.taught import TaughtModel

COUNT = FEATURE_COUNTS["full"]


def model(*, hi: float = 0.9, ho: float | None = None, limit: float = 1e9, threshold: float = 0.8) -> TaughtModel:
    """Return a model that takes every hand for Hi with that likelihood, and for Ho with the other."""
    ho = (1 - hi) / 2 if ho is None else ho
    biases = np.log([hi, ho, 1 - hi - ho])
    network = Network(np.zeros(COUNT), np.ones(COUNT), (np.zeros((COUNT, 3)),), (biases,))
    novelty = Novelty(network.mean, network.scale, np.zeros((2, COUNT)), np.eye(COUNT), limit)
    return TaughtModel(("Hi", "Ho"), "full", network, novelty, np.array([threshold, 0.8]), {"persons": 1})
