"""Replays hands that are already known, without looking at the frames."""

from collections.abc import Iterable
from math import inf

import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.hand import Hand


class RecordedLandmarker:
    """A landmarker that gives the recorded hands, one list a frame, and then none.

    Args:
        frames: The hands of each frame, in the order of the frames.
    """

    def __init__(self, frames: Iterable[list[Hand]]) -> None:
        self._frames = [list(hands) for hands in frames]
        self._next = 0

    def detect(self, image: NDArray[np.uint8], *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        """Return the hands of the next frame; an empty list after the last one.

        Args:
            image: Not looked at.
            search: Makes no difference.
            dt_s: Makes no difference.
        """
        hands = self._frames[self._next] if self._next < len(self._frames) else []
        self._next += 1
        return list(hands)

    def follow_only(self, hand: Hand) -> None:
        """Do nothing: a recording goes on with all its hands."""

    def reset(self) -> None:
        """Do nothing: a recording goes on where it is, as it follows no hands."""
