"""Taught signs: their model file, and a classifier that adds them to the shipped signs."""

import json
import math
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import DatasetError, ModelCorrupt, ModelError, ModelMissing
from handsteer.recognition.features import (
    BEND_COUNT,
    COUNT,
    KNUCKLES,
    PAIR_COUNT,
    WRIST,
    bone_bends,
    directions,
    pair_distances,
    shape_features,
    unit,
)
from handsteer.recognition.hand import Classifier, Hand, SignGuess
from handsteer.recognition.network import Network, Novelty, from_arrays, to_arrays
from handsteer.recognition.npz import Arrays, NpzFormat
from handsteer.recognition.shipped_signs import SURE, legibility
from handsteer.types import NONE, SIGNS, find_sign

Array = NDArray[np.float64]

Depth = Literal["full", "flat"]
"""Whether landmarks have depth, or are known in the image only."""

_DIRECTIONS: Final = 6
FEATURE_COUNTS: Final[dict[Depth, int]] = {
    "full": COUNT + _DIRECTIONS,
    "flat": BEND_COUNT + PAIR_COUNT + _DIRECTIONS,
}
"""Number of features."""

FORMAT: Final = 1
"""Version of the file format and of the features."""

_LONGEST_NAME: Final = 40
_FILE: Final = NpzFormat(
    "model of taught signs",
    FORMAT,
    missing=ModelMissing,
    corrupt=ModelCorrupt,
    remedy="give one that `handsteer signs train` has written, train it again, or remove the parameter signs.model",
)


def custom_features(pixels: Array, world: Array, depth: Depth) -> Array:
    """Return the (n, features) of n hands.

    They are those of :func:`~handsteer.recognition.features.shape_features` (``flat``: the angles and distances in the
    image, in palm lengths), and unit vectors of the directions of index finger, thumb and palm in the image.

    Args:
        pixels: (n, 21, 2) landmarks in pixels, of an image that is not mirrored.
        world: (n, 21, 3) landmarks in metres, with the image's axes; ignored if ``flat``.
        depth: Kind of the landmarks.
    """
    pointing = [unit(vectors) for vectors in directions(pixels)]
    if depth == "full":
        return np.concatenate([shape_features(pixels, world), *pointing], axis=1, dtype=np.float64)
    palm = np.linalg.norm(pixels[:, KNUCKLES] - pixels[:, [WRIST]], axis=2).mean(axis=1, keepdims=True)
    lengths = np.clip(pair_distances(pixels) / np.maximum(palm, 1e-6), 0.0, 5.0)
    return np.concatenate([bone_bends(pixels), lengths, *pointing], axis=1, dtype=np.float64)


@dataclass(frozen=True)
class CustomModel:
    """Distinguishes taught signs from all other hands.

    Attributes:
        labels: The signs, in the order of the network's classes; the last class is all other hands.
        depth: Kind of its features.
        network: From features to classes.
        novelty: Limits the distance from the training data.
        thresholds: (labels,) likelihood thresholds, between 0 and 1.
        trained_on: Description of the training data and versions, as plain values.
    """

    labels: tuple[str, ...]
    depth: Depth
    network: Network
    novelty: Novelty
    thresholds: Array
    trained_on: Mapping[str, Any]

    def confidences(self, pixels: Array, world: Array) -> Array:
        """Return the (n, labels) confidences, 0 to 1, of (n, 21, 2) pixels and (n, 21, 3) metres.

        Only the likeliest sign has a confidence above 0. All are 0 for a new shape, and for landmarks that are NaN.
        """
        features = custom_features(pixels, world, self.depth)
        chances = np.nan_to_num(self.network.probabilities(features)[:, :-1])
        rows, best = np.arange(len(chances)), chances.argmax(axis=1)
        near = self.novelty.distances(features, best) <= self.novelty.limit
        confidences = np.zeros_like(chances)
        confidences[rows, best] = chances[rows, best] ** (math.log(SURE) / np.log(self.thresholds[best])) * near
        return confidences


class CustomClassifier:
    """A :class:`~handsteer.recognition.hand.Classifier` that adds taught signs to another classifier's.

    Confident results of the other are kept, so that no taught sign changes how the shipped ones drive.

    Args:
        other: Recognises the shipped signs.
        model: As from :func:`load_custom_model`.
    """

    def __init__(self, other: Classifier, model: CustomModel) -> None:
        self._other = other
        self._model = model

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        return (*self._other.signs, *self._model.labels)

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows; ``NONE`` if that is likelier.

        The likelihoods of the taught signs are 0 if the other is confident, because they are not used then.
        """
        known = self._other.classify(hand)
        if known.sign != NONE and known.confidence >= SURE:
            return replace(known, likelihoods={**known.likelihoods, **dict.fromkeys(self._model.labels, 0.0)})
        confidences = self._model.confidences(
            hand.pixels[None, :, :2].astype(np.float64), hand.world[None].astype(np.float64)
        )[0]
        taught = dict(zip(self._model.labels, (confidences * legibility(hand)).tolist(), strict=True))
        likelihoods = {**known.likelihoods, **taught}
        best = max(taught, key=taught.__getitem__)
        if taught[best] < 0.5 or (known.sign != NONE and known.confidence >= taught[best]):
            return replace(known, likelihoods=likelihoods)
        return SignGuess(best, taught[best], likelihoods)

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign``; for a taught sign it is the likelihood."""
        return likelihood if sign in self._model.labels else self._other.confidence(sign, likelihood)

    @property
    def signs_without_depth(self) -> tuple[str, ...]:
        """The signs that can be recognised from landmarks without depth, such as imported ones."""
        return self._model.labels if self._model.depth == "flat" else ()


def label_for(name: str, known: Sequence[str] = ()) -> str:
    """Return the label for ``name``: a sign of handsteer, one of ``known``, or a new one, in Unicode's form NFC.

    Raises:
        DatasetError: It is empty, too long, or not printable.
    """
    name = unicodedata.normalize("NFC", " ".join(name.split()))
    if not _is_name(name):
        raise DatasetError(
            f"{name[:60]!r} is not a valid name for a sign: give 1 to {_LONGEST_NAME} printable characters, as 'Hi'"
        )
    return find_sign(name, (*SIGNS, NONE, *known)) or name


def is_label(text: str) -> bool:
    """Return whether ``text`` is a label that this version or an earlier one has stored."""
    # Earlier versions stored names in any Unicode form, and took those of full width for signs of their own.
    is_own = find_sign(text, (*SIGNS, NONE)) in (None, text) or not unicodedata.is_normalized("NFKC", text)
    return is_own and _is_name(text) and text == " ".join(text.split())


def _is_name(text: str) -> bool:
    return 1 <= len(text) <= _LONGEST_NAME and text.isprintable()


def save_custom_model(model: CustomModel, path: Path) -> None:
    """Write ``model`` to ``path``, atomically and deterministically.

    Raises:
        ModelError: It cannot be written.
    """
    try:
        _FILE.write(path, model_arrays(model))
    except OSError as error:
        raise ModelError(f"cannot write the model of taught signs {path}: {error.strerror}") from None


def model_arrays(model: CustomModel) -> Arrays:
    """Return the arrays of the file of ``model``, without its format."""
    content = {
        "taught": np.array(model.labels),
        "depth": np.array(model.depth),
        "limit": np.array(model.novelty.limit),
        "thresholds": model.thresholds,
        "trained_on": np.array(json.dumps(model.trained_on, sort_keys=True)),
    }
    return content | to_arrays(model.network, model.novelty)


def load_custom_model(path: Path) -> CustomModel:
    """Return the model in the file ``path``, which may be untrusted: loading executes nothing.

    Raises:
        ModelMissing: It cannot be read.
        ModelCorrupt: It is not a model of taught signs, is damaged, or has another format.
    """
    return _FILE.read(path, model_from)


def model_from(arrays: Arrays) -> CustomModel:
    """Return the model of the arrays of an untrusted file; errors of many types are raised for damaged ones."""
    depth = cast(Depth, str(arrays["depth"]))
    network, novelty = from_arrays(arrays, FEATURE_COUNTS[depth])  # KeyError for another depth
    labels = tuple(str(label) for label in arrays["taught"])
    thresholds = arrays["thresholds"].astype(np.float64)
    count = len(labels)
    if not (
        len(network.biases[-1]) == count + 1 > 1 and len(novelty.centres) == count and thresholds.shape == (count,)
    ):
        raise ValueError("its parts do not fit together")
    if not ((thresholds > 0) & (thresholds < 1)).all():
        raise ValueError("a threshold is not between 0 and 1")
    if len(set(labels)) < count or {*SIGNS, NONE} & set(labels) or not all(map(is_label, labels)):
        raise ValueError("its signs are not named as taught signs are")
    return CustomModel(labels, depth, network, novelty, thresholds, dict(json.loads(str(arrays["trained_on"]))))
