"""Signs told by a trained network from the shape of the hand, and by where it points."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.protocol import Hand
from handsteer.signs.features import directions, shape_features
from handsteer.signs.model import SignModel
from handsteer.signs.protocol import SignGuess
from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

_DOUBT: Final = 1.5
"""Width of the doubt about a limit, degrees or pixels."""
_POINTING: Final = 52.0
"""How far off its axis an index finger or a thumb may point, degrees: people tilt their hands by up to 30, and their
fingers in their hands."""
_UPRIGHT: Final = 55.0
"""How far from upwards an open hand may point: others hang, or rest."""
_RAISED: Final = 120.0
"""How far from upwards a fist may point, likewise."""


_SMALLEST_PX: Final = 17.0
"""Longer side of the smallest hand that can be read, pixels; a fist 3 m from a webcam of 640x480 has some more."""


class TrainedClassifier:
    """A :class:`~handsteer.signs.protocol.Classifier` that knows the shapes of a model.

    The network says how likely it is that the hand is open, points with its index finger, stretches out its thumb or
    is a fist; where it points in the image makes a sign of that. The confidence is the likelihood of the shape, times
    that of the direction, times the landmark model's own that there is a hand; hands of too few pixels have none.

    Args:
        model: As :func:`~handsteer.signs.model.load_model` gives it.
    """

    def __init__(self, model: SignModel) -> None:
        self._model = model

    @property
    def signs(self) -> tuple[str, ...]:
        """The signs that it can tell, without ``NONE``."""
        return SIGNS

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign that ``hand`` shows; ``NONE`` when it is likelier that it shows none.

        Nothing can be said of a hand whose landmarks are not all finite: it is ``NONE`` with a confidence of 0.
        """
        if not (np.isfinite(hand.points[:, :2]).all() and np.isfinite(hand.world).all()):
            return SignGuess(NONE, 0.0, dict.fromkeys(SIGNS, 0.0))
        pixels = hand.pixels[None, :, :2].astype(np.float64)
        shapes = self._model.probabilities(shape_features(pixels, hand.world[None])[0])
        legible = legibility(hand)
        scores = {sign: score * legible for sign, score in _signs(shapes, pixels).items()}
        best = max(scores, key=scores.__getitem__)
        score = scores[best]
        return SignGuess(best, score, scores) if score >= 0.5 else SignGuess(NONE, 1.0 - score, scores)


def legibility(hand: Hand) -> float:
    """Return how far ``hand`` can be read at all, 0 to 1: that it is there, times that it has enough pixels."""
    return min(1.0, max(0.0, hand.presence)) * _within(-_SMALLEST_PX, -hand.longer_side_px)


def _signs(shapes: dict[str, float], pixels: NDArray[np.float64]) -> dict[str, float]:
    """Return how likely each sign is, given the shapes' likelihoods and (1, 21, 2) landmarks."""
    index, thumb, palm = (vectors[0] for vectors in directions(pixels))
    return {
        STOP: shapes.get("open", 0.0) * _within(_UPRIGHT, _from_up(palm)),
        GO: shapes.get("fist", 0.0) * _within(_RAISED, _from_up(palm)),
        FORWARD: shapes.get("index", 0.0) * _within(_POINTING, _from_up(index)),
        BACKWARD: shapes.get("index", 0.0) * _within(_POINTING, 180.0 - _from_up(index)),
        # The frame is not mirrored: the user's own right is the left of the image.
        TURN_LEFT: shapes.get("thumb", 0.0) * _within(_POINTING, _from_right(thumb)),
        TURN_RIGHT: shapes.get("thumb", 0.0) * _within(_POINTING, 180.0 - _from_right(thumb)),
    }


def _from_up(vector: NDArray[np.float64]) -> float:
    """Return the angle between ``vector``, x right and y down, and upwards in the image, degrees."""
    return math.degrees(math.atan2(abs(float(vector[0])), -float(vector[1])))


def _from_right(vector: NDArray[np.float64]) -> float:
    """Return the angle between ``vector``, x right and y down, and the image's right, degrees."""
    return math.degrees(math.atan2(abs(float(vector[1])), float(vector[0])))


def _within(limit: float, value: float) -> float:
    """Return how sure it is, 0 to 1, that ``value`` is below ``limit``."""
    return 1.0 / (1.0 + math.exp(min(50.0, (value - limit) / _DOUBT)))
