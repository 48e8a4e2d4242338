"""Whether a picture is new: a camera that hangs goes on delivering, with new stamps, what it saw last."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

_SAMPLED_ROWS = 30
_BLACK = 6.0
# A frozen camera may share its topic with others that are not.
_REMEMBERED = 8

Box = tuple[int, int, int, int]


class Freshness:
    """Compares each picture with those before.

    No two pictures of a real camera are the same: its sensor has noise. A picture that is the same as one of the last
    few, in each of 30 rows, is not new. Compressed video repeats parts that hardly change, so a part is no proof,
    unless it is where the hand is, every pixel of it, and for longer than a moment.

    Args:
        limit_s: How long the hand may look exactly the same, in seconds; may be set later, too.

    Attributes:
        frozen_s: How long the same picture has come, in seconds; 0 after a new one.
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
        """Return why ``image`` is no new picture, in words; None when it is one.

        Args:
            image: (height, width, 3) uint8.
            dt_s: Seconds since the picture before, >= 0.
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
        """Note a picture that is not looked at: it is not new either when it comes again.

        Those that were looked at are remembered beside them, however many are passed over.
        """
        _remember(_sampled(image)[0].tobytes(), self._passed_over)

    def why_hand_refused(self, box: Box, dt_s: float) -> str | None:
        """Return why the hand in ``box`` of the last picture is not seen now, in words; None when it is.

        Args:
            box: Left, top, right and bottom in pixels; the last two are not within.
            dt_s: Seconds since the picture before, >= 0.
        """
        self._hand_frozen_s = self._hand_frozen_s + dt_s if self._is_same(box) else 0.0
        if self._hand_frozen_s <= self.limit_s:
            return None
        return f"the picture is torn: the hand's part of it is the same for {self._hand_frozen_s:.1f} s"

    def _is_same(self, box: Box) -> bool:
        image, before = self._image, self._before
        # A camera that draws into the same memory again has overwritten the picture before.
        if image is None or before is None or image.shape != before.shape or np.may_share_memory(image, before):
            return False
        left, top, right, bottom = box
        there = np.s_[max(0, top) : max(0, bottom), max(0, left) : max(0, right)]
        now, then = image[there], before[there]
        # Most pictures differ in the first rows that are looked at.
        return bool(now.size) and np.array_equal(now[::16], then[::16]) and np.array_equal(now, then)


def _sampled(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], int]:
    """Return the rows that are compared, and how many rows of ``image`` there are for each."""
    step = max(1, image.shape[0] // _SAMPLED_ROWS)
    return image[step // 2 :: step], step


def _remember(sample: bytes, samples: deque[bytes]) -> bool:
    """Make ``sample`` the newest of ``samples``; return whether it was among them."""
    is_known = sample in samples
    if is_known:
        samples.remove(sample)
    samples.append(sample)
    return is_known
