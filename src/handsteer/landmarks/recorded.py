"""Replays recorded hands, without processing the frames."""

from collections.abc import Iterable
from math import inf

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.hand import Hand


class RecordedLandmarker:
    """A landmarker that returns the recorded hands of ``frames``, one list per frame, and then none."""

    def __init__(self, frames: Iterable[list[Hand]]) -> None:
        self._frames = [list(hands) for hands in frames]
        self._next = 0

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands of the next frame, an empty list after the last one; ignores the arguments."""
        hands = self._frames[self._next] if self._next < len(self._frames) else []
        self._next += 1
        return list(hands)

    def follow_only(self, hand: Hand) -> None:
        """Do nothing: a recording continues with all its hands."""

    def reset(self) -> None:
        """Do nothing: a recording tracks no hands, and continues where it is."""
