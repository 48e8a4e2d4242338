"""How old a frame is, when the clock that stamped it may be another machine's and not in step with ours."""

from handsteer.clock import ClockWatch

_LEAK = 0.001
"""How much of an offset is forgotten, in seconds a second: far more than clocks drift, far less than a delay lasts."""


class FrameAge:
    """Tells old frames from new ones by their stamps.

    No frame comes from the future. One that seems to tells that the clock of its camera is ahead of ours, by at least
    as much; every frame is then taken to be older by that. So a frame is never taken to be older than it is, and
    younger by no more than the shortest delay that any frame has had. A clock that is behind cannot be told from a
    delay, and its frames count as old; unless it was set while frames came, which
    :class:`~handsteer.clock.ClockWatch` notices.

    Args:
        limit_s: Greatest age of a frame in seconds; a frame that is ahead of us by more is refused, too.

    Attributes:
        limit_s: As above; may be changed.
        age_s: Age of the last frame, at least.
        ahead_s: By how much the camera's clock is ahead of ours, at least.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._noted_s: float | None = None
        self._watch = ClockWatch(in_step=True)
        self.age_s = 0.0
        self.ahead_s = 0.0

    def why_refused(self, now_s: float, captured_s: float) -> str | None:
        """Return why a frame that has come now is not to be used, in words; None when it is fresh.

        Args:
            now_s: The time now, in seconds of the graph's clock.
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
    """Return what became of a clock that was set back by so many seconds, or ahead if negative."""
    return f"a clock was set {'back' if set_by_s > 0 else 'ahead'} by {abs(set_by_s):.1f} s"
