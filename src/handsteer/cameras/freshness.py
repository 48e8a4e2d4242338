"""Detects frozen cameras, which go on delivering an old picture with new stamps."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

_SAMPLED_ROWS = 30
_BLACK = 6.0
# A frozen camera may share its topic with working ones.
_REMEMBERED = 8

Box = tuple[int, int, int, int]


class Freshness:
    """Compares each picture with the ones before.

    No two pictures of a real camera are equal, because its sensor has noise. A picture that equals one of the last few
    in each of 30 rows is not new. Compressed video repeats parts that hardly change, so an equal part is evidence only
    if it is the whole region of the hand, for longer than a moment.

    Args:
        limit_s: How long the hand's region may stay exactly equal, in seconds; may be changed later.

    Attributes:
        frozen_s: How long the same picture has been received, in seconds; 0 after a new one.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self.frozen_s = 0.0
        self._image: NDArray[np.uint8] | None = None
        self._before: NDArray[np.uint8] | None = None
        self._samples: deque[bytes] = deque(maxlen=_REMEMBERED)
        self._passed_over: deque[bytes] = deque(maxlen=_REMEMBERED)
        self._hand_frozen_s = 0.0

    def why_refused(self, image: NDArray[np.uint8], dt_s: float) -> str | None:
        """Return why ``image`` is not a new picture, in words; None if it is new.

        Args:
            image: (height, width, 3) uint8.
            dt_s: Seconds since the previous picture, >= 0.
        """
        rows, step = _sampled(image)
        sample = rows.tobytes()
        if _remember(sample, self._samples) or sample in self._passed_over:
            self.frozen_s += dt_s
            return f"the camera is frozen: the same picture for {self.frozen_s:.1f} s"
        self.frozen_s = 0.0
        self._before, self._image = self._image, image
        if rows[:, ::step].mean() < _BLACK:
            return "the picture is black: is the lens covered?"
        return None

    def pass_over(self, image: NDArray[np.uint8]) -> None:
        """Record a picture that is skipped: it is not new either when it comes again.

        Skipped pictures are stored separately, so any number of them does not displace the others.
        """
        _remember(_sampled(image)[0].tobytes(), self._passed_over)

    def why_hand_refused(self, box: Box, dt_s: float) -> str | None:
        """Return why the hand in ``box`` of the last picture counts as stale, in words; None if it is current.

        Args:
            box: Left, top, right and bottom in pixels; the last two are exclusive.
            dt_s: Seconds since the previous picture, >= 0.
        """
        self._hand_frozen_s = self._hand_frozen_s + dt_s if self._is_same(box) else 0.0
        if self._hand_frozen_s <= self.limit_s:
            return None
        return f"the picture is torn: the hand's part of it is the same for {self._hand_frozen_s:.1f} s"

    def _is_same(self, box: Box) -> bool:
        image, before = self._image, self._before
        # A camera that reuses its memory has overwritten the previous picture.
        if image is None or before is None or image.shape != before.shape or np.may_share_memory(image, before):
            return False
        left, top, right, bottom = box
        there = np.s_[max(0, top) : max(0, bottom), max(0, left) : max(0, right)]
        now, then = image[there], before[there]
        # Most pictures differ in the first rows compared.
        return bool(now.size) and np.array_equal(now[::16], then[::16]) and np.array_equal(now, then)


def _sampled(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], int]:
    """Return the rows to compare, and how many rows of ``image`` each stands for."""
    step = max(1, image.shape[0] // _SAMPLED_ROWS)
    return image[step // 2 :: step], step


def _remember(sample: bytes, samples: deque[bytes]) -> bool:
    """Add ``sample`` to ``samples`` as the newest; return whether it was among them."""
    is_known = sample in samples
    if is_known:
        samples.remove(sample)
    samples.append(sample)
    return is_known
