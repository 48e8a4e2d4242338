"""What to do better while a sign is shown: pure functions of the hands that were seen."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from handsteer.landmarks.protocol import Hand
from handsteer.signs.features import KNUCKLES, WRIST
from handsteer.signs.protocol import SignGuess
from handsteer.signs.trained import SURE
from handsteer.types import NONE

_SMALL_PX: Final = 60.0
_ENOUGH_HANDS: Final = 15
_LEAST_TURN_RAD: Final = np.radians(6.0)
_LEAST_GROWTH: Final = 1.12

NO_HAND: Final = "No hand is in view."
SMALL: Final = "Come nearer: the hand is small in the picture."
STILL: Final = "Move the hand a little: nearer, farther, tilted."


def hint(hand: Hand | None, guess: SignGuess, hands: Sequence[Hand]) -> str:
    """Return one sentence on what to do better; empty when all is well.

    Args:
        hand: The hand in the newest frame.
        guess: What that is told as by the signs that are shipped.
        hands: Those of the take that is under way, the oldest first.
    """
    if hand is None:
        return NO_HAND
    if hand.longer_side_px < _SMALL_PX:
        return SMALL
    if guess.sign != NONE and guess.confidence >= SURE:
        return f"This looks like {guess.sign}, which is known already: show another shape."
    return STILL if is_still(hands) else ""


def is_still(hands: Sequence[Hand]) -> bool:
    """Return whether many ``hands`` are all of one size and one tilt."""
    if len(hands) < _ENOUGH_HANDS:
        return False
    pixels = np.array([hand.pixels[:, :2] for hand in hands], np.float64)
    palms = pixels[:, KNUCKLES].mean(axis=1) - pixels[:, WRIST]
    lengths = np.maximum(np.linalg.norm(palms, axis=1), 1e-9)
    # About the mean direction, so that a hand that points up or down is no different.
    mean = palms.mean(axis=0)
    turns = np.arctan2(palms[:, 1] * mean[0] - palms[:, 0] * mean[1], palms @ mean)
    return bool(np.ptp(turns) < _LEAST_TURN_RAD and lengths.max() / lengths.min() < _LEAST_GROWTH)
