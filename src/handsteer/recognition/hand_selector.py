"""Selects the active hand when several are in view."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from handsteer.config import SignsConfig
from handsteer.recognition.features import PALM
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.types import NONE, STOP

_JUMP: Final = 1.0
"""Largest movement of a hand between two frames, in hand sizes."""
_MUCH_SMALLER: Final = 0.6
"""Hands smaller than this fraction of the active one belong to people in the background."""


@dataclass(frozen=True)
class HandPosition:
    """A hand's position in the image: the centre of its box and the box's longer side, in pixels."""

    x: float
    y: float
    size: float

    @classmethod
    def of(cls, hand: Hand) -> "HandPosition":
        """Return the position of ``hand``."""
        low, high = hand.pixels[:, :2].min(axis=0), hand.pixels[:, :2].max(axis=0)
        x, y = ((low + high) / 2).tolist()
        return cls(x, y, max(1.0, float(np.max(high - low))))

    @classmethod
    def of_palm(cls, hand: Hand) -> "HandPosition":
        """Return the position of the palm of ``hand``, independent of the fingers, with the size of the whole hand."""
        x, y = hand.pixels[PALM, :2].mean(axis=0).tolist()
        return cls(x, y, max(1.0, hand.longer_side_px))

    def distance(self, other: "HandPosition") -> float:
        """Return the distance to ``other`` in sizes of this hand."""
        return float(np.hypot(self.x - other.x, self.y - other.y)) / self.size


class HandSelector:
    """Selects the active hand, which gives the signs, and follows it.

    - Without an active hand, it selects one that shows a sign, by confidence and size.
    - Once a sign of the active hand is confirmed, it stays active while in view, until it has had no confirmed sign for
      ``switch_time`` and another hand, not much smaller, shows one: a resting hand or a bystander does not take over.
    - A hand that is out of view for ``dropout_hold`` is no longer active; until then, any hand may show ``Stop``.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self.reset()

    def reconfigure(self, config: SignsConfig) -> None:
        """Change the times; the active hand stays."""
        self._config = config

    def reset(self) -> None:
        """Forget the active hand."""
        self._followed: HandPosition | None = None
        self._unseen_s = 0.0
        self._idle_s = math.inf

    def wants_search(self) -> bool:
        """Return whether to search for further hands, which takes time: while the active one shows no sign."""
        return self._idle_s > 0.0

    def choose(self, hands: Sequence[Hand], guesses: Sequence[SignGuess], dt_s: float) -> int | None:
        """Return the index of the active hand; None if it is not in view.

        Args:
            hands: The hands of one frame.
            guesses: The sign of each hand; ``NONE`` below the threshold.
            dt_s: Seconds since the last frame, >= 0.
        """
        places = [HandPosition.of(hand) for hand in hands]
        showing = [index for index, guess in enumerate(guesses) if guess.sign != NONE]
        self._idle_s += dt_s
        followed = self._find(places, dt_s)
        if self._followed is not None and followed is None:
            # Any hand may stop the robot, including the active one after a jump.
            showing = [index for index in showing if guesses[index].sign == STOP]
            if not showing:
                return None
        if followed is not None and followed not in showing and self._idle_s >= self._config.switch_time:
            showing = [index for index in showing if places[index].size >= _MUCH_SMALLER * places[followed].size]
        elif followed is not None:
            showing = []
        if showing:
            followed = max(showing, key=lambda index: guesses[index].confidence * places[index].size ** 0.5)
            self._idle_s = math.inf
        if followed is None:
            return max(range(len(places)), key=lambda index: places[index].size, default=None)
        self._followed = places[followed]
        return followed

    def confirm(self) -> None:
        """Report that the active hand's sign is confirmed: from now on the hand stays active."""
        self._idle_s = 0.0

    def _find(self, places: list[HandPosition], dt_s: float) -> int | None:
        """Return the index of the active hand among ``places``; None if it is not there, or there is none."""
        before = self._followed
        if before is None:
            return None
        nearest = min(range(len(places)), key=lambda index: before.distance(places[index]), default=None)
        if nearest is not None and before.distance(places[nearest]) <= _JUMP:
            self._unseen_s = 0.0
            return nearest
        self._unseen_s += dt_s
        if self._unseen_s > self._config.dropout_hold:
            self.reset()
        return None
