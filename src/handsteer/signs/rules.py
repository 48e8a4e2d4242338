"""Signs told by rules on the fingers: which are straight, and where the index finger or the thumb points."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.protocol import Hand
from handsteer.signs.protocol import SignGuess
from handsteer.signs.vocabulary import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

_WRIST, _THUMB_TIP, _INDEX_MCP, _INDEX_TIP, _MIDDLE_MCP, _LITTLE_MCP = 0, 4, 5, 8, 9, 17
_FINGER_BASES = (5, 9, 13, 17)

# A finger's bend at which it counts as half straight, and the width of the doubt around it, in radians.
_STRAIGHT_BEND, _STRAIGHT_DOUBT = 1.05, 0.12
# Distance of the thumb's tip from the little finger's base, in palm lengths, at which it counts as half stretched out.
_THUMB_REACH, _THUMB_DOUBT = 0.85, 0.06
# An index finger that points leaves the thumb free, short of the L that both make together.
_L_REACH = 1.05
# Angle off the axis, in the image, at which a pointing direction counts by half, and the doubt around it.
_POINTING_ANGLE, _POINTING_DOUBT = math.radians(48), math.radians(4)


@dataclass(frozen=True)
class HandShape:
    """A hand in the terms of the rules; the first three are 0 to 1, 0.5 where it is undecided.

    Attributes:
        straight: How straight the index, middle, ring and little finger are.
        thumb_out: How far the thumb is stretched away from the palm.
        thumb_wide: How far the thumb makes an L with the index finger.
        index_angle: Where the index finger points in the image: 0 to image right, pi / 2 up, in radians.
        thumb_angle: Where the tip of the thumb lies from the knuckles in the image, likewise: it shows better than the
            thumb's own direction where the hand points, as thumbs bend.
    """

    straight: tuple[float, float, float, float]
    thumb_out: float
    thumb_wide: float
    index_angle: float
    thumb_angle: float


class RuleClassifier:
    """A :class:`~handsteer.signs.protocol.Classifier` that needs no training; the confidence is the weakest rule's."""

    signs = SIGNS

    def classify(self, hand: Hand) -> SignGuess:
        """Return the sign whose rules hold best, or ``NONE`` when none of them holds."""
        shape = measure(hand)
        scores = {sign: min(rule(shape)) for sign, rule in _RULES.items()}
        best = max(scores, key=scores.__getitem__)
        if scores[best] < 0.5:
            return SignGuess(NONE, 1.0 - scores[best])
        return SignGuess(best, scores[best])


def measure(hand: Hand) -> HandShape:
    """Return the shape of ``hand``."""
    world, pixels = hand.world, hand.pixels
    palm = float(np.linalg.norm(world[_MIDDLE_MCP] - world[_WRIST])) or 1.0
    reach = float(np.linalg.norm(world[_THUMB_TIP] - world[_LITTLE_MCP])) / palm
    index, middle, ring, little = (_straightness(world, base) for base in _FINGER_BASES)
    return HandShape(
        straight=(index, middle, ring, little),
        thumb_out=_soft(reach - _THUMB_REACH, _THUMB_DOUBT),
        thumb_wide=_soft(reach - _L_REACH, _THUMB_DOUBT),
        index_angle=_angle(pixels[_INDEX_TIP] - pixels[_INDEX_MCP]),
        thumb_angle=_angle(pixels[_THUMB_TIP] - pixels[list(_FINGER_BASES)].mean(axis=0)),
    )


def _straightness(world: NDArray[np.float32], base: int) -> float:
    first, last = world[base + 1] - world[base], world[base + 3] - world[base + 1]
    lengths = float(np.linalg.norm(first) * np.linalg.norm(last)) or 1.0
    bend = math.acos(max(-1.0, min(1.0, float(first @ last) / lengths)))
    return _soft(_STRAIGHT_BEND - bend, _STRAIGHT_DOUBT)


def _angle(vector: NDArray[np.float32]) -> float:
    return math.atan2(-float(vector[1]), float(vector[0]))


def _soft(margin: float, doubt: float) -> float:
    return 1.0 / (1.0 + math.exp(-max(-50.0, min(50.0, margin / doubt))))


def _points(angle: float, towards: float) -> float:
    off = abs(math.remainder(angle - towards, math.tau))
    return _soft(_POINTING_ANGLE - off, _POINTING_DOUBT)


def _closed(shape: HandShape, first_finger: int = 0) -> tuple[float, ...]:
    return tuple(1.0 - straight for straight in shape.straight[first_finger:])


def _stop(shape: HandShape) -> tuple[float, ...]:
    return (*shape.straight, shape.thumb_out)


def _index_towards(towards: float) -> Callable[[HandShape], tuple[float, ...]]:
    def rule(shape: HandShape) -> tuple[float, ...]:
        pointing = _points(shape.index_angle, towards)
        return (shape.straight[0], *_closed(shape, 1), 1.0 - shape.thumb_wide, pointing)

    return rule


def _thumb_towards(towards: float) -> Callable[[HandShape], tuple[float, ...]]:
    def rule(shape: HandShape) -> tuple[float, ...]:
        return (*_closed(shape), shape.thumb_out, _points(shape.thumb_angle, towards))

    return rule


def _go(shape: HandShape) -> tuple[float, ...]:
    return (*_closed(shape), 1.0 - shape.thumb_out)


_RULES: dict[str, Callable[[HandShape], tuple[float, ...]]] = {
    STOP: _stop,
    FORWARD: _index_towards(math.pi / 2),
    BACKWARD: _index_towards(-math.pi / 2),
    # The frame is not mirrored: the user's own right is the left of the image.
    TURN_RIGHT: _thumb_towards(math.pi),
    TURN_LEFT: _thumb_towards(0.0),
    GO: _go,
}
