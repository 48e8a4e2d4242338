"""Estimates the age of frames whose stamps may come from the unsynchronized clock of another machine."""

from handsteer.clock import ClockWatch

_LEAK = 0.001
"""Decay of a clock offset, in seconds per second: far more than clocks drift, far less than delays last."""


class FrameAge:
    """Distinguishes old frames from new ones by their stamps.

    A stamp in the future shows that the camera's clock is ahead of ours by at least the difference, which is then added
    to the age of every frame. So the age is never overestimated, and underestimated by at most the shortest delay of
    any frame. A clock that is behind cannot be distinguished from a delay, and its frames count as old, unless it was
    set while frames were received, which :class:`~handsteer.clock.ClockWatch` detects.

    Args:
        limit_s: Maximum age of a frame in seconds; frames that are further ahead are refused too.

    Attributes:
        limit_s: As above; may be changed.
        age_s: Lower bound of the last frame's age.
        ahead_s: Lower bound of the offset by which the camera's clock is ahead of ours.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._noted_s: float | None = None
        self._watch = ClockWatch(in_step=True)
        self.age_s = 0.0
        self.ahead_s = 0.0

    def why_refused(self, now_s: float, captured_s: float) -> str | None:
        """Return why a frame received now must not be used, in words; None if it is fresh.

        Args:
            now_s: Current time, in seconds of the graph's clock.
            captured_s: The frame's stamp, in seconds of the same clock.
        """
        elapsed_s = 0.0 if self._noted_s is None else now_s - self._noted_s
        self._noted_s = now_s
        self.ahead_s = max(0.0, self.ahead_s - _LEAK * elapsed_s)
        corrected_s = self._watch.corrected(now_s - captured_s, now_s)
        if corrected_s is None:
            return f"{in_words(self._watch.set_by_s)}: frames are timed anew in a moment"
        by_stamp_s = corrected_s
        if by_stamp_s < -self.limit_s:
            return f"frames are stamped {-by_stamp_s:.1f} s ahead of our clock: are the clocks of the machines in step?"
        self.ahead_s = max(self.ahead_s, -by_stamp_s)
        self.age_s = by_stamp_s + self.ahead_s
        if self.age_s <= self.limit_s:
            return None
        ahead = f" by a clock that is {self.ahead_s:.1f} s ahead of ours" if self.ahead_s >= 0.05 else ""
        return f"frames come {self.age_s:.1f} s after their stamp{ahead}: are the clocks of the machines in step?"


def in_words(set_by_s: float) -> str:
    """Return in words that a clock was set back by ``set_by_s`` seconds, or ahead if negative."""
    return f"a clock was set {'back' if set_by_s > 0 else 'ahead'} by {abs(set_by_s):.1f} s"
