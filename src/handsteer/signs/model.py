"""The file of a sign model: what tells hand shapes apart, and what it was trained on."""

import itertools
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.signs.features import COUNT
from handsteer.signs.network import Network
from handsteer.signs.novelty import Novelty

FORMAT: Final = 1
"""Version of the file format and of the features."""

DEFAULT_MODEL: Final = Path(__file__).parent / "default_model.npz"
"""The model that handsteer ships; ``make signs-model`` makes it again."""

_REMEDY: Final = "train it again, or use the one that is shipped"


@dataclass(frozen=True)
class SignModel:
    """Tells the shape of a hand from its features.

    Attributes:
        shapes: Names of the shapes, in the order of the network's classes; ``other`` is none of the rest.
        network: From features to shapes.
        novelty: Knows how far from all that was learned a hand may be.
        trained_on: What it was trained on, with which version, as plain values.
    """

    shapes: tuple[str, ...]
    network: Network
    novelty: Novelty
    trained_on: Mapping[str, Any]

    def probabilities(self, features: NDArray[np.float64]) -> dict[str, float]:
        """Return how likely each shape is for the (features,) of one hand; nothing but ``other`` if it is all new."""
        row = features[None]
        chances = self.network.probabilities(row)[0]
        if self.novelty.distances(row, np.array([chances.argmax()]))[0] > self.novelty.limit:
            return dict.fromkeys(self.shapes, 0.0) | {"other": 1.0}
        return dict(zip(self.shapes, chances.tolist(), strict=True))


def save_model(model: SignModel, path: Path) -> None:
    """Write ``model`` to ``path``: the same model always gives the same bytes."""
    network, novelty = model.network, model.novelty
    numbers = {"mean": network.mean, "scale": network.scale, "centres": novelty.centres, "whitening": novelty.whitening}
    for layer, (weights, biases) in enumerate(zip(network.weights, network.biases, strict=True)):
        numbers |= {f"weights_{layer}": weights, f"biases_{layer}": biases}
    np.savez(
        path,
        format=np.array(FORMAT),
        shapes=np.array(model.shapes),
        limit=np.array(novelty.limit),
        trained_on=np.array(json.dumps(model.trained_on, sort_keys=True)),
        **{name: value.astype(np.float32) for name, value in numbers.items()},  # type: ignore[arg-type]
    )


def load_model(path: Path = DEFAULT_MODEL) -> SignModel:
    """Return the model in the file ``path``. Nothing in a file is ever run.

    Raises:
        ModelMissing: It cannot be read.
        ModelCorrupt: It is no sign model, is damaged, or has another format.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise ModelCorrupt(f"{path}: not a sign model; {_REMEDY}")
            arrays = {name: file[name] for name in file.files}
    except OSError as error:
        raise ModelMissing(f"cannot read the sign model {path} ({error.strerror or error}): {_REMEDY}") from None
    except (ValueError, EOFError, KeyError, zipfile.BadZipFile, NotImplementedError, SyntaxError):
        raise ModelCorrupt(f"{path}: not a sign model, or damaged; {_REMEDY}") from None
    version = arrays.get("format")
    if version is None or version.shape != () or version != FORMAT:
        raise ModelCorrupt(f"{path}: format {version} of sign models is not known, expected {FORMAT}; {_REMEDY}")
    try:
        model = _built(arrays)
        _check(model)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ModelCorrupt(f"{path}: a damaged sign model ({error}); {_REMEDY}") from None
    return model


def _built(arrays: dict[str, NDArray[Any]]) -> SignModel:
    layers = sum(name.startswith("weights_") for name in arrays)
    network = Network(
        mean=arrays["mean"].astype(np.float64),
        scale=arrays["scale"].astype(np.float64),
        weights=tuple(arrays[f"weights_{layer}"].astype(np.float64) for layer in range(layers)),
        biases=tuple(arrays[f"biases_{layer}"].astype(np.float64) for layer in range(layers)),
    )
    novelty = Novelty(
        mean=network.mean,
        scale=network.scale,
        centres=arrays["centres"].astype(np.float64),
        whitening=arrays["whitening"].astype(np.float64),
        limit=float(arrays["limit"]),
    )
    shapes = tuple(str(shape) for shape in arrays["shapes"])
    return SignModel(shapes, network, novelty, dict(json.loads(str(arrays["trained_on"]))))


def _check(model: SignModel) -> None:
    """Raise ValueError unless all parts of ``model`` fit together."""
    network, novelty = model.network, model.novelty
    sizes = [COUNT, *(len(biases) for biases in network.biases)]
    shapes = list(itertools.pairwise(sizes))
    numbers = [network.mean, network.scale, *network.weights, *network.biases, novelty.centres, novelty.whitening]
    fits = (
        network.mean.shape == network.scale.shape == (COUNT,)
        and [weights.shape for weights in network.weights] == shapes
        and len(model.shapes) == sizes[-1] == len(set(model.shapes))
        and novelty.centres.shape == (sizes[-1], COUNT)
        and novelty.whitening.shape == (COUNT, COUNT)
        and "other" in model.shapes
    )
    if not fits:
        raise ValueError("its parts do not fit together")
    if not all(np.isfinite(each).all() for each in [*numbers, np.array(novelty.limit)]):
        raise ValueError("some of its numbers are not finite")
