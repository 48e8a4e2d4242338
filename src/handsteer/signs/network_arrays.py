"""Converts a network and its novelty to the arrays of a file, and back."""

import itertools

import numpy as np
from numpy.typing import NDArray

from handsteer.signs.network import Network
from handsteer.signs.novelty import Novelty
from handsteer.signs.npz import Arrays

_LARGEST = 1e9  # trained values are far smaller; products of larger ones could be infinite


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
