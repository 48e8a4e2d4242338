"""A small neural network with a check for inputs unlike its training data, in NumPy, and its arrays in a file."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.npz import Arrays

Array = NDArray[np.float64]

_LARGEST = 1e9  # trained values are far smaller; products of larger ones could be infinite


@dataclass(frozen=True)
class Network:
    """A multilayer perceptron from features to the scores of classes.

    Attributes:
        mean: (features,) subtracted from the features.
        scale: (features,) factors applied after that.
        weights: One (inputs, outputs) matrix per layer.
        biases: One (outputs,) vector per layer.
    """

    mean: Array
    scale: Array
    weights: tuple[Array, ...]
    biases: tuple[Array, ...]

    def probabilities(self, features: Array) -> Array:
        """Return the (n, classes) probabilities of (n, features)."""
        return softmax(self.layers(features)[-1])

    def layers(self, features: Array) -> list[Array]:
        """Return the input of each layer, beginning with the scaled features, and the scores."""
        passed = [(features - self.mean) * self.scale]
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True), 1):
            scores = passed[-1] @ weight + bias
            passed.append(np.tanh(scores) if layer < len(self.weights) else scores)
        return passed


def softmax(logits: Array) -> Array:
    """Return (n, classes) probabilities of (n, classes) scores."""
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    probabilities: Array = powers / powers.sum(axis=1, keepdims=True)
    return probabilities


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


def to_arrays(network: Network, novelty: Novelty) -> dict[str, NDArray[np.float32]]:
    """Return the arrays of both by name, without the novelty's limit."""
    numbers = {"mean": network.mean, "scale": network.scale, "centres": novelty.centres, "whitening": novelty.whitening}
    for layer, (weights, biases) in enumerate(zip(network.weights, network.biases, strict=True)):
        numbers |= {f"weights_{layer}": weights, f"biases_{layer}": biases}
    return {name: value.astype(np.float32) for name, value in numbers.items()}


def from_arrays(arrays: Arrays, inputs: int) -> tuple[Network, Novelty]:
    """Return the network and the novelty of a file.

    Args:
        arrays: As from :func:`to_arrays`, with ``limit``.
        inputs: Number of features.

    Raises:
        KeyError: An array is missing.
        ValueError: They are not numeric, not finite, or inconsistent.
    """
    layers = range(sum(name.startswith("weights_") for name in arrays))
    network = Network(
        mean=arrays["mean"].astype(np.float64),
        scale=arrays["scale"].astype(np.float64),
        weights=tuple(arrays[f"weights_{layer}"].astype(np.float64) for layer in layers),
        biases=tuple(arrays[f"biases_{layer}"].astype(np.float64) for layer in layers),
    )
    novelty = Novelty(
        mean=network.mean,
        scale=network.scale,
        centres=arrays["centres"].astype(np.float64),
        whitening=arrays["whitening"].astype(np.float64),
        limit=float(arrays["limit"]),
    )
    sizes = [inputs, *(len(biases) for biases in network.biases)]
    fits = (
        len(sizes) > 1
        and network.mean.shape == network.scale.shape == (inputs,)
        and [weights.shape for weights in network.weights] == list(itertools.pairwise(sizes))
        and novelty.centres.shape[1:] == (inputs,)
        and novelty.whitening.shape == (inputs, inputs)
    )
    if not fits:
        raise ValueError("its parts do not fit together")
    numbers = [network.mean, network.scale, *network.weights, *network.biases, novelty.centres, novelty.whitening]
    if not all((np.abs(each) <= _LARGEST).all() for each in [*numbers, np.array(novelty.limit)]):
        raise ValueError(f"some of its numbers are beyond {_LARGEST:g}, or none")
    return network, novelty
