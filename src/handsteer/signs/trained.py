"""Signs recognised by a trained network from the shape of the hand, and by where it points."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.hand import Hand
from handsteer.signs.classifier import SignGuess
from handsteer.signs.features import (
    INDEX_BASE,
    INDEX_TIP,
    KNUCKLES,
    MIDDLE_BASE,
    MIDDLE_TIP,
    WRIST,
    directions,
    shape_features,
)
from handsteer.signs.model import SignModel
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

_DOUBT: Final = 1.5
"""Width of the doubt about a limit, degrees."""
_POINTING: Final = 52.0
"""How far off its axis an index finger may point, degrees: people tilt their hands by up to 30, and their fingers in
their hands."""
_SIDEWAYS: Final = 49.0
"""How far off the horizontal a thumb may point, degrees: about half-way to a thumb up or down."""
_UPRIGHT: Final = 55.0
"""How far from upwards an open hand may point: others hang, or rest."""
_RAISED: Final = 120.0
"""How far from upwards a fist may point, likewise."""
_HANGING: Final = 145.0
"""How far from upwards the palms of hands point that hang down: of people who do nothing, 156 to 178 degrees."""
_HANGING_TRUST: Final = 0.82
"""What a thumb of a hand that hangs is worth: it may lie beside the fingers, and look as if it pointed to a side."""
_AWAY: Final = 0.06
_AWAY_DOUBT: Final = 0.01
"""How much farther from the camera than its base the tip of an index finger is that hangs at rest, in palm lengths, and
the width of that: 0.08 to 0.18 of people who do nothing; of those who point, 99 of 100 point towards the camera."""
_HALF_OPEN: Final = 0.56
_HALF_OPEN_DOUBT: Final = 0.012
"""How far from its base the tip of the middle finger is then, likewise: 0.55 to 0.68; 0.45 in one that points."""

_PRESENT: Final = 0.7
_PRESENT_DOUBT: Final = 0.05
"""The landmark model's certainty at which it is as likely that there is no hand, and the width of that: of people's
hands 99 of 100 are above 0.85, of faces that it takes for a hand half are below."""
_SMALL_PX: Final = 17.0
_SMALL_DOUBT_PX: Final = 4.0
"""Longer side at which a hand is read half as surely, pixels, and the width of that: at 35 pixels a hundredth is
missing, and a fist 3 m from a webcam of 640x480 has some 17."""

_THRESHOLDS: Final = {STOP: 0.5, GO: 0.6, FORWARD: 0.7, BACKWARD: 0.9, TURN_LEFT: 0.65, TURN_RIGHT: 0.65}
"""Likelihood from which each sign is sure enough; docs/signs.md has the false rates that they were chosen for."""
SURE: Final = 0.8
"""The confidence of a sign whose likelihood is just at its threshold."""


class TrainedClassifier:
    """A :class:`~handsteer.signs.classifier.Classifier` that knows the shapes of a model.

    The network says how likely it is that the hand is open, points with its index finger, stretches out its thumb or
    is a fist; where it points in the image makes a sign of that. A sign's likelihood is that of the shape, times that
    of the direction, times how far the hand can be read (:func:`legibility`). Its confidence grows with it from 0 by
    0.8 at the sign's own threshold to 1: a motion has to be likelier than ``Go`` and ``Stop`` to be as sure.

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
        likelihoods = {sign: likelihood * legible for sign, likelihood in _signs(shapes, pixels, hand.world).items()}
        best = max(likelihoods, key=likelihoods.__getitem__)
        none = max(0.0, 1.0 - sum(likelihoods.values()))
        if none >= likelihoods[best]:
            return SignGuess(NONE, none, likelihoods)
        return SignGuess(best, self.confidence(best, likelihoods[best]), likelihoods)

    def confidence(self, sign: str, likelihood: float) -> float:
        """Return the confidence, 0 to 1, of ``sign`` when it is as likely as ``likelihood``."""
        return float(likelihood ** (math.log(SURE) / math.log(_THRESHOLDS[sign])))


def legibility(hand: Hand) -> float:
    """Return how far ``hand`` can be read at all, 0 to 1.

    That is how sure the landmark model is that it is there, times that it has enough pixels, times the share of its
    landmarks that are in the frame.
    """
    inside = ((hand.points[:, :2] >= 0.0) & (hand.points[:, :2] <= 1.0)).all(axis=1).mean()
    large = _within(-_SMALL_PX, -hand.longer_side_px, _SMALL_DOUBT_PX)
    present = _within(-_PRESENT, -hand.presence, _PRESENT_DOUBT)
    return present * large * float(inside)


def _signs(shapes: dict[str, float], pixels: NDArray[np.float64], world: NDArray[np.floating]) -> dict[str, float]:
    """Return how likely each sign is, given the shapes' likelihoods, (1, 21, 2) and (21, 3) world landmarks."""
    index, thumb, palm = (vectors[0] for vectors in directions(pixels))
    hangs = 1.0 - _within(_HANGING, _from_up(palm))
    sideways = shapes.get("thumb", 0.0) * (1.0 - (1.0 - _HANGING_TRUST) * hangs)
    return {
        STOP: shapes.get("open", 0.0) * _within(_UPRIGHT, _from_up(palm)),
        GO: shapes.get("fist", 0.0) * _within(_RAISED, _from_up(palm)),
        FORWARD: shapes.get("index", 0.0) * _within(_POINTING, _from_up(index)),
        BACKWARD: shapes.get("index", 0.0) * _within(_POINTING, 180.0 - _from_up(index)) * (1.0 - _at_rest(world)),
        # The frame is not mirrored: the user's own right is the left of the image.
        TURN_LEFT: sideways * _within(_SIDEWAYS, _from_right(thumb)),
        TURN_RIGHT: sideways * _within(_SIDEWAYS, 180.0 - _from_right(thumb)),
    }


def _at_rest(world: NDArray[np.floating]) -> float:
    """Return how sure it is, 0 to 1, that a hand whose index finger points down, (21, 3), is at rest.

    Then the finger points away from the camera, and the others are half open.
    """
    palm = max(float(np.linalg.norm(world[list(KNUCKLES)] - world[WRIST], axis=1).mean()), 1e-6)
    away = float(world[INDEX_TIP, 2] - world[INDEX_BASE, 2]) / palm
    reach = float(np.linalg.norm(world[MIDDLE_TIP] - world[MIDDLE_BASE])) / palm
    return (1.0 - _within(_AWAY, away, _AWAY_DOUBT)) * (1.0 - _within(_HALF_OPEN, reach, _HALF_OPEN_DOUBT))


def _from_up(vector: NDArray[np.float64]) -> float:
    """Return the angle between ``vector``, x right and y down, and upwards in the image, degrees."""
    return math.degrees(math.atan2(abs(float(vector[0])), -float(vector[1])))


def _from_right(vector: NDArray[np.float64]) -> float:
    """Return the angle between ``vector``, x right and y down, and the image's right, degrees."""
    return math.degrees(math.atan2(abs(float(vector[1])), float(vector[0])))


def _within(limit: float, value: float, doubt: float = _DOUBT) -> float:
    """Return how sure it is, 0 to 1, that ``value`` is below ``limit``."""
    return 1.0 / (1.0 + math.exp(min(50.0, (value - limit) / doubt)))
