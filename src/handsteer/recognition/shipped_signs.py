"""Recognises signs by the hand's shape, with a trained network, and by its direction."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.recognition.features import (
    COUNT,
    directions,
    shape_features,
)
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.network import Network, Novelty, from_arrays, to_arrays
from handsteer.recognition.npz import Arrays, NpzFormat
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

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

_DOUBT: Final = 1.5
"""Width of the soft limits below, in degrees."""
_POINTING: Final = 52.0
"""Largest angle of an index finger to its axis, in degrees.

People tilt their hands by up to 30 degrees, and their fingers relative to the hand.
"""
_SIDEWAYS: Final = 40.0
"""Largest angle of a thumb to the horizontal, in degrees.

Thumbs that turn are within 23 degrees of it, thumbs up and down that are tilted by 30 degrees mostly beyond 40. Other
measures of the hand's tilt, such as the direction of its palm, do not separate them better.
"""
_UPRIGHT: Final = 55.0
"""Largest angle of an open hand to upwards: beyond it, hands hang or rest."""
_RAISED: Final = 120.0
"""Likewise, of a fist."""
_HANGING: Final = 145.0
"""Smallest angle of a hanging hand's palm to upwards: 156 to 178 degrees for people at rest."""
_HANGING_TRUST: Final = 0.82
"""Factor on the thumb's likelihood for a hanging hand: next to the fingers, it may seem to point sideways."""
_BENT_UP: Final = 0.6
"""Share of the likelihood of an index finger that is bent at its knuckle, or has the thumb out, that counts upwards.

So such a finger is ``Backward`` if it points down, and no sign if it points up, unless it may as well be straight.
"""

_PRESENT: Final = 0.7
_PRESENT_DOUBT: Final = 0.05
"""Presence at which a hand and none are equally likely, and the width of that limit.

The landmark model reports above 0.85 for 99 of 100 hands, and less than the limit for half of the faces it mistakes for
one.
"""
_SMALL_PX: Final = 17.0
_SMALL_DOUBT_PX: Final = 4.0
"""Longer side of a hand at which likelihoods are halved, in pixels, and the width of that limit.

At 35 pixels they lose a hundredth; a fist 3 m from a webcam of 640x480 has some 17.
"""

_THRESHOLDS: Final = {STOP: 0.5, GO: 0.6, FORWARD: 0.7, BACKWARD: 0.75, TURN_LEFT: 0.65, TURN_RIGHT: 0.65}
"""Likelihood thresholds of the signs; docs/signs.md has the false rates that they were chosen for."""
SURE: Final = 0.8
"""The confidence of a sign whose likelihood equals its threshold."""


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
    return _FILE.read(path, _built)


def _built(arrays: Arrays) -> SignModel:
    network, novelty = from_arrays(arrays, COUNT)
    shapes = tuple(str(shape) for shape in arrays["shapes"])
    classes = len(network.biases[-1])
    if not (len(shapes) == len(set(shapes)) == classes == len(novelty.centres)) or "other" not in shapes:
        raise ValueError("its parts do not fit together")
    return SignModel(shapes, network, novelty, dict(json.loads(str(arrays["trained_on"]))))


class ShippedClassifier:
    """A :class:`~handsteer.recognition.hand.Classifier` for the shapes of a model.

    The network gives the likelihoods that the hand is open, points with its index finger, extends its thumb or is a
    fist; the direction in the image determines the sign. A sign's likelihood is the product of those of its shape, of
    its direction and of the hand's :func:`legibility`. The confidence increases with it from 0 through 0.8 at the
    sign's threshold to 1. Motions have higher thresholds than ``Go`` and ``Stop``.

    Attributes:
        model: Its model.
    """

    def __init__(self, model: SignModel) -> None:
        self.model = model

    @property
    def signs(self) -> tuple[str, ...]:
        """The recognised signs, without ``NONE``."""
        return SIGNS

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows; ``NONE`` if that is likelier.

        A hand with landmarks that are not finite is ``NONE`` with a confidence of 0.
        """
        if not (np.isfinite(hand.points[:, :2]).all() and np.isfinite(hand.world).all()):
            return SignGuess(NONE, 0.0, dict.fromkeys(SIGNS, 0.0))
        pixels = hand.pixels[None, :, :2].astype(np.float64)
        shapes = self.model.probabilities(shape_features(pixels, hand.world[None])[0])
        likelihoods = self.likelihoods(shapes, hand)
        best = max(likelihoods, key=likelihoods.__getitem__)
        none = max(0.0, 1.0 - sum(likelihoods.values()))
        if none >= likelihoods[best]:
            return SignGuess(NONE, none, likelihoods)
        return SignGuess(best, self.confidence(best, likelihoods[best]), likelihoods)

    def likelihoods(self, shapes: dict[str, float], hand: Hand) -> dict[str, float]:
        """Return the likelihood of each sign, 0 to 1, if the shape of ``hand`` has the probabilities ``shapes``.

        The landmarks of ``hand`` are finite.
        """
        legible, pixels = legibility(hand), hand.pixels[None, :, :2].astype(np.float64)
        return {sign: likelihood * legible for sign, likelihood in _signs(shapes, pixels).items()}

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign`` with this ``likelihood``."""
        return float(likelihood ** (math.log(SURE) / math.log(_THRESHOLDS[sign])))


def legibility(hand: Hand) -> float:
    """Return how reliably ``hand`` can be read, 0 to 1.

    The product of the likelihood that it is present, the likelihood that it has enough pixels, and the share of its
    landmarks that are in the frame.
    """
    inside = ((hand.points[:, :2] >= 0.0) & (hand.points[:, :2] <= 1.0)).all(axis=1).mean()
    large = _within(-_SMALL_PX, -hand.longer_side_px, _SMALL_DOUBT_PX)
    present = _within(-_PRESENT, -hand.presence, _PRESENT_DOUBT)
    return present * large * float(inside)


def _signs(shapes: dict[str, float], pixels: NDArray[np.float64]) -> dict[str, float]:
    """Return the likelihood of each sign from those of the shapes and (1, 21, 2) landmarks in pixels."""
    index, thumb, palm = (vectors[0] for vectors in directions(pixels))
    hangs = 1.0 - _within(_HANGING, _from_up(palm))
    straight, bent = shapes.get("index", 0.0), shapes.get("index_down", 0.0)
    sideways = shapes.get("thumb", 0.0) * (1.0 - (1.0 - _HANGING_TRUST) * hangs)
    return {
        STOP: shapes.get("open", 0.0) * _within(_UPRIGHT, _from_up(palm)),
        GO: shapes.get("fist", 0.0) * _within(_RAISED, _from_up(palm)),
        FORWARD: (straight + _BENT_UP * bent) * _within(_POINTING, _from_up(index)),
        BACKWARD: (straight + bent) * _within(_POINTING, 180.0 - _from_up(index)),
        # The frame is not mirrored: the user's right is the left of the image.
        TURN_LEFT: sideways * _within(_SIDEWAYS, _from_right(thumb)),
        TURN_RIGHT: sideways * _within(_SIDEWAYS, 180.0 - _from_right(thumb)),
    }


def _from_up(vector: NDArray[np.float64]) -> float:
    """Return the angle of ``vector``, x right and y down, to upwards in the image, in degrees."""
    return math.degrees(math.atan2(abs(float(vector[0])), -float(vector[1])))


def _from_right(vector: NDArray[np.float64]) -> float:
    """Return the angle of ``vector``, x right and y down, to the image's right, in degrees."""
    return math.degrees(math.atan2(abs(float(vector[1])), float(vector[0])))


def _within(limit: float, value: float, doubt: float = _DOUBT) -> float:
    """Return the likelihood, 0 to 1, that ``value`` is below ``limit``."""
    return 1.0 / (1.0 + math.exp(min(50.0, (value - limit) / doubt)))
