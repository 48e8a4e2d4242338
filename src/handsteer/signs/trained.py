"""Recognises signs by the hand's shape, with a trained network, and by its direction."""

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
"""Width of the soft limits below, in degrees."""
_POINTING: Final = 52.0
"""Largest angle of an index finger to its axis, in degrees.

People tilt their hands by up to 30 degrees, and their fingers relative to the hand.
"""
_SIDEWAYS: Final = 49.0
"""Largest angle of a thumb to the horizontal, in degrees: about half-way to a thumb up or down."""
_UPRIGHT: Final = 55.0
"""Largest angle of an open hand to upwards: beyond it, hands hang or rest."""
_RAISED: Final = 120.0
"""Likewise, of a fist."""
_HANGING: Final = 145.0
"""Smallest angle of a hanging hand's palm to upwards: 156 to 178 degrees for people at rest."""
_HANGING_TRUST: Final = 0.82
"""Factor on the thumb's likelihood for a hanging hand: next to the fingers, it may seem to point sideways."""
_AWAY: Final = 0.06
_AWAY_DOUBT: Final = 0.01
"""Depth of a resting index finger's tip beyond its base, in palm lengths, and the width of that limit.

0.08 to 0.18 for people at rest; of people who point, 99 of 100 point towards the camera.
"""
_HALF_OPEN: Final = 0.56
_HALF_OPEN_DOUBT: Final = 0.012
"""Likewise, the distance of the middle finger's tip from its base: 0.55 to 0.68 at rest; 0.45 in a pointing hand."""

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

_THRESHOLDS: Final = {STOP: 0.5, GO: 0.6, FORWARD: 0.7, BACKWARD: 0.9, TURN_LEFT: 0.65, TURN_RIGHT: 0.65}
"""Likelihood thresholds of the signs; docs/signs.md has the false rates that they were chosen for."""
SURE: Final = 0.8
"""The confidence of a sign whose likelihood equals its threshold."""


class TrainedClassifier:
    """A :class:`~handsteer.signs.classifier.Classifier` for the shapes of a model.

    The network gives the likelihoods that the hand is open, points with its index finger, extends its thumb or is a
    fist; the direction in the image determines the sign. A sign's likelihood is the product of those of its shape, of
    its direction and of the hand's :func:`legibility`. The confidence increases with it from 0 through 0.8 at the
    sign's threshold to 1. Motions have higher thresholds than ``Go`` and ``Stop``.

    Args:
        model: As from :func:`~handsteer.signs.model.load_model`.
    """

    def __init__(self, model: SignModel) -> None:
        self._model = model

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
        shapes = self._model.probabilities(shape_features(pixels, hand.world[None])[0])
        legible = legibility(hand)
        likelihoods = {sign: likelihood * legible for sign, likelihood in _signs(shapes, pixels, hand.world).items()}
        best = max(likelihoods, key=likelihoods.__getitem__)
        none = max(0.0, 1.0 - sum(likelihoods.values()))
        if none >= likelihoods[best]:
            return SignGuess(NONE, none, likelihoods)
        return SignGuess(best, self.confidence(best, likelihoods[best]), likelihoods)

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


def _signs(shapes: dict[str, float], pixels: NDArray[np.float64], world: NDArray[np.floating]) -> dict[str, float]:
    """Return the likelihood of each sign from those of the shapes, (1, 21, 2) pixels and (21, 3) world landmarks."""
    index, thumb, palm = (vectors[0] for vectors in directions(pixels))
    hangs = 1.0 - _within(_HANGING, _from_up(palm))
    sideways = shapes.get("thumb", 0.0) * (1.0 - (1.0 - _HANGING_TRUST) * hangs)
    return {
        STOP: shapes.get("open", 0.0) * _within(_UPRIGHT, _from_up(palm)),
        GO: shapes.get("fist", 0.0) * _within(_RAISED, _from_up(palm)),
        FORWARD: shapes.get("index", 0.0) * _within(_POINTING, _from_up(index)),
        BACKWARD: shapes.get("index", 0.0) * _within(_POINTING, 180.0 - _from_up(index)) * (1.0 - _at_rest(world)),
        # The frame is not mirrored: the user's right is the left of the image.
        TURN_LEFT: sideways * _within(_SIDEWAYS, _from_right(thumb)),
        TURN_RIGHT: sideways * _within(_SIDEWAYS, 180.0 - _from_right(thumb)),
    }


def _at_rest(world: NDArray[np.floating]) -> float:
    """Return the likelihood, 0 to 1, that a hand with its index finger down, (21, 3), is at rest.

    At rest, the finger points away from the camera, and the others are half open.
    """
    palm = max(float(np.linalg.norm(world[list(KNUCKLES)] - world[WRIST], axis=1).mean()), 1e-6)
    away = float(world[INDEX_TIP, 2] - world[INDEX_BASE, 2]) / palm
    reach = float(np.linalg.norm(world[MIDDLE_TIP] - world[MIDDLE_BASE])) / palm
    return (1.0 - _within(_AWAY, away, _AWAY_DOUBT)) * (1.0 - _within(_HALF_OPEN, reach, _HALF_OPEN_DOUBT))


def _from_up(vector: NDArray[np.float64]) -> float:
    """Return the angle of ``vector``, x right and y down, to upwards in the image, in degrees."""
    return math.degrees(math.atan2(abs(float(vector[0])), -float(vector[1])))


def _from_right(vector: NDArray[np.float64]) -> float:
    """Return the angle of ``vector``, x right and y down, to the image's right, in degrees."""
    return math.degrees(math.atan2(abs(float(vector[1])), float(vector[0])))


def _within(limit: float, value: float, doubt: float = _DOUBT) -> float:
    """Return the likelihood, 0 to 1, that ``value`` is below ``limit``."""
    return 1.0 / (1.0 + math.exp(min(50.0, (value - limit) / doubt)))
