"""Detects whether a picture has changed since it was last processed, to skip frames that have not."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.recognition.roi import Roi

Cells = NDArray[np.uint8]
"""Mean colours of the cells of a picture, as a small picture; a hand may be as bright as its background."""

_ACROSS_FRAME: Final = 48
"""Number of cells along the longer side of a frame: a readable hand is larger than a cell."""
_ACROSS_HAND: Final = 12
_SAMPLES: Final = 6
"""Rows and columns that are sampled per cell; more hardly reduce the noise of its mean."""


@dataclass(frozen=True)
class Pace:
    """How often to process frames.

    Attributes:
        change: Difference of a cell, in levels of 255, that counts as a change.
        settle_s: Time after a change in which every frame is processed.
        period_s: Time between processed frames while nothing changes.
        least_s: Minimum time between processed frames.
    """

    change: float
    settle_s: float
    period_s: float
    least_s: float = 0.0


class Stillness:
    """Decides whether to process a frame: while the picture changes, and periodically.

    The picture is compared with the last processed one, not with the last frame, so slow changes are detected too.

    Attributes:
        woken: Whether the last frame in question has changed after frames that were not worth processing.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Treat the picture as just changed."""
        self._seen: Cells | None = None
        self._since_change_s = 0.0
        self._since_look_s = inf
        self._rests = False
        self.woken = False

    def wait(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, >= 0."""
        self._since_change_s += dt_s
        self._since_look_s += dt_s

    def is_too_early(self, pace: Pace) -> bool:
        """Return whether not to process a frame yet, changed or not."""
        return self._since_look_s < pace.least_s

    def wants_look(self, cells: Cells, pace: Pace) -> bool:
        """Return whether to process the frame of ``cells``, of the same shape as in :meth:`look`."""
        changed = self._seen is None or cv2.norm(cells, self._seen, cv2.NORM_INF) >= pace.change
        self.woken = changed and self._rests
        if changed:
            self._rests = False
            self._since_change_s = 0.0
            return True
        wanted = self._since_look_s >= pace.period_s or self._since_change_s < pace.settle_s
        self._rests = self._rests or not wanted
        return wanted

    def look(self, cells: Cells) -> None:
        """Record that the frame with these ``cells`` is processed."""
        self._seen = cells
        self._since_look_s = 0.0


def cells_of_frame(image: NDArray[np.uint8]) -> Cells:
    """Return up to (36, 48, 3) cells of ``image``, (height, width, 3) uint8, BGR; fewer for a small image."""
    height, width = image.shape[:2]
    scale = min(1.0, _ACROSS_FRAME / max(height, width))
    return _means(image, max(1, round(height * scale)), max(1, round(width * scale)))


def cells_of_hands(image: NDArray[np.uint8], regions: Sequence[Roi]) -> Cells:
    """Return the (12 n, 12, 3) cells of the n ``regions`` of hands, as far as they are within ``image``."""
    return np.concatenate([_means(_box(image, region), _ACROSS_HAND, _ACROSS_HAND) for region in regions])


def _box(image: NDArray[np.uint8], region: Roi) -> NDArray[np.uint8]:
    """Return the part of ``image`` in the upright square around the centre of ``region``, at least one pixel."""
    height, width = image.shape[:2]
    left, top = region.center_x - region.side / 2, region.center_y - region.side / 2
    begin_x, begin_y = int(np.clip(left, 0, width - 1)), int(np.clip(top, 0, height - 1))
    end_x, end_y = max(begin_x + 1, int(left + region.side)), max(begin_y + 1, int(top + region.side))
    return image[begin_y:end_y, begin_x:end_x]


def _means(image: NDArray[np.uint8], rows: int, columns: int) -> Cells:
    """Return the means of (rows, columns, 3) cells of ``image``, from a sample of their pixels."""
    some = cv2.resize(image, (columns * _SAMPLES, rows * _SAMPLES), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.resize(some, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
