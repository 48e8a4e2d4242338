"""The time that a graph runs on: real, or stepped by hand.

Everything timed uses :meth:`Clock.now`, which is monotonic. :meth:`Clock.stamp` turns such a time into the
``builtin_interfaces/Time`` that message headers carry.
"""

import time
from typing import Protocol

from handsteer.messages import Time

_NS_PER_S = 1_000_000_000


class Clock(Protocol):
    """A monotonic clock."""

    def now(self) -> float:
        """Return the time in seconds since an arbitrary, fixed moment; it never goes back."""
        ...

    def stamp(self, time_s: float) -> Time:
        """Return the header stamp for ``time_s``, a time that :meth:`now` returned."""
        ...


class RealClock:
    """The machine's monotonic clock; stamps are Unix time.

    The distance between the two is taken once, so that stamps never jump when the wall clock is set.
    """

    def __init__(self) -> None:
        self._epoch_offset_s = time.time() - time.monotonic()

    def now(self) -> float:
        """Return ``time.monotonic()`` in seconds."""
        return time.monotonic()

    def stamp(self, time_s: float) -> Time:
        """Return Unix time for the monotonic ``time_s``."""
        return to_stamp(time_s + self._epoch_offset_s)


class SteppedClock:
    """A clock that moves only when told to; stamps start at 0, as simulated time does in ROS."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now(self) -> float:
        """Return the time in seconds that the clock was last set to."""
        return self._now_s

    def stamp(self, time_s: float) -> Time:
        """Return ``time_s`` as a stamp."""
        return to_stamp(time_s)

    def advance_to(self, time_s: float) -> None:
        """Move to ``time_s`` seconds; a time in the past leaves the clock where it is."""
        self._now_s = max(self._now_s, time_s)

    def advance(self, seconds: float) -> None:
        """Move forward by ``seconds``."""
        self.advance_to(self._now_s + seconds)


def to_stamp(seconds: float) -> Time:
    """Return ``seconds`` (>= 0) as a ROS time, rounded to a nanosecond."""
    nanoseconds = round(seconds * _NS_PER_S)
    return Time(sec=nanoseconds // _NS_PER_S, nanosec=nanoseconds % _NS_PER_S)


def to_seconds(stamp: Time) -> float:
    """Return a ROS time in seconds."""
    return stamp.sec + stamp.nanosec / _NS_PER_S
