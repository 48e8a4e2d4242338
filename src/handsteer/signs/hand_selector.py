"""Whose hand it is that gives the signs, when there are several in view."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from handsteer.config import SignsConfig
from handsteer.landmarks.hand import Hand
from handsteer.signs.classifier import SignGuess
from handsteer.signs.features import KNUCKLES, WRIST
from handsteer.types import NONE, STOP

_PALM: Final = [WRIST, *KNUCKLES]
_JUMP: Final = 1.0
"""How far a hand can move from one frame to the next, in its own sizes."""
_MUCH_SMALLER: Final = 0.6
"""A hand that is smaller than this share of the followed one is somebody's in the background."""


@dataclass(frozen=True)
class HandPosition:
    """Where a hand is in the image: the centre of its box and the box's longer side, in pixels."""

    x: float
    y: float
    size: float

    @classmethod
    def of(cls, hand: Hand) -> "HandPosition":
        """Return where ``hand`` is."""
        low, high = hand.pixels[:, :2].min(axis=0), hand.pixels[:, :2].max(axis=0)
        x, y = ((low + high) / 2).tolist()
        return cls(x, y, max(1.0, float(np.max(high - low))))

    @classmethod
    def of_palm(cls, hand: Hand) -> "HandPosition":
        """Return where the palm of ``hand`` is, which stays when fingers move, and how large the whole hand is."""
        x, y = hand.pixels[_PALM, :2].mean(axis=0).tolist()
        return cls(x, y, max(1.0, hand.longer_side_px))

    def distance(self, other: "HandPosition") -> float:
        """Return how far ``other`` is from here, in sizes of this one."""
        return float(np.hypot(self.x - other.x, self.y - other.y)) / self.size


class HandSelector:
    """Chooses the hand that gives the signs, and stays with it.

    - While none is followed, it is the hand that shows a sign: the surest and largest of them.
    - Once a sign of it counts, it stays the one while it is in view, until none has counted for ``switch_time`` and
      another hand, which is not much smaller, shows one: a resting hand or a bystander doesn't take over.
    - A hand that is out of view for ``dropout_hold`` is followed no more; while it is, any hand may show ``Stop``.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self.reset()

    def reconfigure(self, config: SignsConfig) -> None:
        """Go on with other times; the hand that is followed stays."""
        self._config = config

    def reset(self) -> None:
        """Forget the hand that is followed."""
        self._followed: HandPosition | None = None
        self._unseen_s = 0.0
        self._idle_s = math.inf

    def wants_search(self) -> bool:
        """Return whether to look for further hands, which takes time: while the followed one gives no sign."""
        return self._idle_s > 0.0

    def choose(self, hands: Sequence[Hand], guesses: Sequence[SignGuess], dt_s: float) -> int | None:
        """Return the index of the hand that gives the signs; None when it is not in view.

        Args:
            hands: Those of one frame.
            guesses: What each of them shows; ``NONE`` where it is not sure enough.
            dt_s: Seconds since the last frame, >= 0.
        """
        places = [HandPosition.of(hand) for hand in hands]
        showing = [index for index, guess in enumerate(guesses) if guess.sign != NONE]
        self._idle_s += dt_s
        followed = self._find(places, dt_s)
        if self._followed is not None and followed is None:
            # Anybody may stop the robot, and so may the hand that was followed where it has jumped to.
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
        """Note that the sign of the followed hand counts: from now on it is kept."""
        self._idle_s = 0.0

    def _find(self, places: list[HandPosition], dt_s: float) -> int | None:
        """Return the index of the followed hand among ``places``; None when it is not there, or none is followed."""
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
