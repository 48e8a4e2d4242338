"""Trains the network of a sign model, and learns its novelty limit."""

import itertools
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.network import Array, Network, Novelty, softmax

_GRID: Final = 2.0**-14
_BATCH: Final = 512
_STEP: Final = 2e-3
_DECAY: Final = 1e-5
_SMOOTHING: Final = 0.01
_SHRINKAGE: Final = 0.1


def train(
    features: Array,
    targets: NDArray[np.int64],
    *,
    hidden: tuple[int, ...],
    epochs: int,
    seed: int,
    progress: Callable[[int], object] = lambda _: None,
) -> Network:
    """Return a classification network, trained with equal weight for all classes.

    Adam (D. Kingma and J. Ba, 2015) on the cross entropy, with a step that decays to zero. After each epoch the weights
    are rounded to a grid, so that differences in rounding between processors do not grow: the same data gives the same
    network everywhere.

    Args:
        features: (n, features).
        targets: (n,) class of each row, 0 to classes - 1; each class occurs.
        hidden: Sizes of the hidden layers.
        epochs: Number of passes over all rows.
        seed: Of the initial weights and the order of the rows.
        progress: Called after each epoch with its number, from 1.
    """
    random = np.random.default_rng(seed)
    mean, scale = rounded(features.mean(axis=0)), rounded(1.0 / np.maximum(features.std(axis=0), 1e-3))
    sizes = (features.shape[1], *hidden, int(targets.max()) + 1)
    weights = [rounded(random.normal(0, n**-0.5, (n, m))) for n, m in itertools.pairwise(sizes)]
    biases = [np.zeros(m) for m in sizes[1:]]
    importance = (len(targets) / len(np.unique(targets)) / np.bincount(targets))[targets]
    optimiser = _Adam([*weights, *biases])
    network = Network(mean, scale, tuple(weights), tuple(biases))
    for epoch in range(epochs):
        order = random.permutation(len(targets))
        for batch in np.array_split(order, max(1, len(order) // _BATCH)):
            step = _STEP * 0.5 * (1 + np.cos(np.pi * epoch / epochs))
            gradients = _gradients(network, features[batch], targets[batch], importance[batch])
            optimiser.step(gradients, step)
        optimiser.round()
        progress(epoch + 1)
    return network


def _gradients(network: Network, features: Array, targets: NDArray[np.int64], importance: Array) -> list[Array]:
    """Return the gradients of the mean cross entropy for all weights, then all biases."""
    *passed, scores = network.layers(features)
    wanted = np.eye(scores.shape[1])[targets] * (1 - _SMOOTHING) + _SMOOTHING / scores.shape[1]
    error = (softmax(scores) - wanted) * importance[:, None] / len(targets)
    weights: list[Array] = []
    biases: list[Array] = []
    for layer in reversed(range(len(network.weights))):
        inputs = passed[layer]
        weights.insert(0, inputs.T @ error + _DECAY * network.weights[layer])
        biases.insert(0, error.sum(axis=0))
        error = (error @ network.weights[layer].T) * (1 - inputs**2)
    return [*weights, *biases]


class _Adam:
    """The Adam optimiser; updates parameters in place."""

    def __init__(self, parameters: list[Array]) -> None:
        self._parameters = parameters
        self._means = [np.zeros_like(each) for each in parameters]
        self._squares = [np.zeros_like(each) for each in parameters]
        self._steps = 0

    def step(self, gradients: list[Array], step: float) -> None:
        self._steps += 1
        for parameter, mean, square, gradient in zip(
            self._parameters, self._means, self._squares, gradients, strict=True
        ):
            mean[:] += 0.1 * (gradient - mean)
            square[:] += 0.001 * (gradient**2 - square)
            corrected = mean / (1 - 0.9**self._steps)
            parameter[:] -= step * corrected / (np.sqrt(square / (1 - 0.999**self._steps)) + 1e-8)

    def round(self) -> None:
        """Round the parameters to a grid, and clear the moments."""
        for parameter, mean, square in zip(self._parameters, self._means, self._squares, strict=True):
            parameter[:] = rounded(parameter)
            mean[:] = 0.0
            square[:] = 0.0
        self._steps = 0


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


def rounded(values: Array) -> Array:
    """Return ``values`` rounded to a grid much coarser than any processor's rounding errors."""
    on_grid: Array = np.round(values / _GRID) * _GRID
    return on_grid
