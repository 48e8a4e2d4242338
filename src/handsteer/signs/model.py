"""The file of a sign model: the classifier of hand shapes, and its training data's description."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.signs.features import COUNT
from handsteer.signs.network import Network
from handsteer.signs.network_arrays import from_arrays, to_arrays
from handsteer.signs.novelty import Novelty
from handsteer.signs.npz import Arrays, NpzFormat

FORMAT: Final = 1
"""Version of the file format and of the features."""

DEFAULT_MODEL: Final = Path(__file__).parent / "default_model.npz"
"""The shipped model, which ``make signs-model`` reproduces."""

_FILE: Final = NpzFormat(
    "sign model",
    FORMAT,
    missing=ModelMissing,
    corrupt=ModelCorrupt,
    remedy="train it again, or use the one that is shipped",
)


@dataclass(frozen=True)
class SignModel:
    """Classifies the shape of a hand from its features.

    Attributes:
        shapes: Names of the shapes, in the order of the network's classes; ``other`` is any other shape.
        network: From features to shapes.
        novelty: Limits the distance from the training data.
        trained_on: Description of the training data and versions, as plain values.
    """

    shapes: tuple[str, ...]
    network: Network
    novelty: Novelty
    trained_on: Mapping[str, Any]

    def probabilities(self, features: NDArray[np.float64]) -> dict[str, float]:
        """Return the probability of each shape for the (features,) of one hand; only ``other`` for a new shape."""
        row = features[None]
        chances = self.network.probabilities(row)[0]
        if self.novelty.distances(row, np.array([chances.argmax()]))[0] > self.novelty.limit:
            return dict.fromkeys(self.shapes, 0.0) | {"other": 1.0}
        return dict(zip(self.shapes, chances.tolist(), strict=True))


def save_model(model: SignModel, path: Path) -> None:
    """Write ``model`` to ``path``, deterministically."""
    content = {
        "shapes": np.array(model.shapes),
        "limit": np.array(model.novelty.limit),
        "trained_on": np.array(json.dumps(model.trained_on, sort_keys=True)),
    }
    _FILE.write(path, content | to_arrays(model.network, model.novelty))


def load_model(path: Path = DEFAULT_MODEL) -> SignModel:
    """Return the model in the file ``path``, which may be untrusted: loading executes nothing.

    Raises:
        ModelMissing: It cannot be read.
        ModelCorrupt: It is not a sign model, is damaged, or has another format.
    """
    arrays = _FILE.read(path)
    try:
        return _built(arrays)
    except (KeyError, ValueError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise _FILE.damaged(path, error) from None


def _built(arrays: Arrays) -> SignModel:
    network, novelty = from_arrays(arrays, COUNT)
    shapes = tuple(str(shape) for shape in arrays["shapes"])
    classes = len(network.biases[-1])
    if not (len(shapes) == len(set(shapes)) == classes == len(novelty.centres)) or "other" not in shapes:
        raise ValueError("its parts do not fit together")
    return SignModel(shapes, network, novelty, dict(json.loads(str(arrays["trained_on"]))))
