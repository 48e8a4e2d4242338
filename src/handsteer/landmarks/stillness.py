"""Whether a picture is still as it was when it was looked at, so that it need not be looked at again and again."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.landmarks.roi import Roi

Cells = NDArray[np.uint8]
"""Mean colours of the parts of a picture, as a small picture; a hand may be as bright as what is behind it."""

_ACROSS_FRAME: Final = 48
"""How many cells the longer side of a frame is divided into: a hand that can be read is larger than one."""
_ACROSS_HAND: Final = 12
_SAMPLES: Final = 6
"""Rows and columns of a cell that are looked at; more make its mean hardly steadier."""


@dataclass(frozen=True)
class Pace:
    """How often to look.

    Attributes:
        change: By how many of 255 levels a cell has to differ for the picture to have changed.
        settle_s: For how long after a change to look in each frame.
        period_s: How often to look at a picture that does not change.
        least_s: How long not to look after a look, whether the picture changes or not.
    """

    change: float
    settle_s: float
    period_s: float
    least_s: float = 0.0


class Stillness:
    """Tells whether it is worth to look at a frame: while the picture changes, and now and then.

    The picture is compared with the one that was looked at, not with the last frame, so what comes slowly is a change
    too.

    Attributes:
        woken: Whether the frame that was asked about last has changed after others were not worth a look.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Take the picture for one that has changed just now."""
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
        """Return whether not to look yet, whatever there is to see."""
        return self._since_look_s < pace.least_s

    def wants_look(self, cells: Cells, pace: Pace) -> bool:
        """Return whether to look at a frame.

        Args:
            cells: Those of the frame, as many as were given to :meth:`look`.
            pace: How often to.
        """
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
        """Note that the frame with these ``cells`` is looked at."""
        self._seen = cells
        self._since_look_s = 0.0


def cells_of_frame(image: NDArray[np.uint8]) -> Cells:
    """Return some (36, 48, 3) cells of ``image``, (height, width, 3) uint8, BGR; fewer of a small one."""
    height, width = image.shape[:2]
    scale = min(1.0, _ACROSS_FRAME / max(height, width))
    return _means(image, max(1, round(height * scale)), max(1, round(width * scale)))


def cells_of_hands(image: NDArray[np.uint8], regions: Sequence[Roi]) -> Cells:
    """Return the (12 n, 12, 3) cells of the n regions in which hands are, as far as they are within ``image``."""
    return np.concatenate([_means(_box(image, region), _ACROSS_HAND, _ACROSS_HAND) for region in regions])


def _box(image: NDArray[np.uint8], region: Roi) -> NDArray[np.uint8]:
    """Return the part of ``image`` that an upright square about ``region``'s centre has, of at least one pixel."""
    height, width = image.shape[:2]
    left, top = region.center_x - region.side / 2, region.center_y - region.side / 2
    begin_x, begin_y = int(np.clip(left, 0, width - 1)), int(np.clip(top, 0, height - 1))
    end_x, end_y = max(begin_x + 1, int(left + region.side)), max(begin_y + 1, int(top + region.side))
    return image[begin_y:end_y, begin_x:end_x]


def _means(image: NDArray[np.uint8], rows: int, columns: int) -> Cells:
    """Return the (rows, columns, 3) means of so many cells of ``image``, from some of their pixels."""
    some = cv2.resize(image, (columns * _SAMPLES, rows * _SAMPLES), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.resize(some, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
