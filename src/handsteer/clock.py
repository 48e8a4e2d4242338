"""The time that a graph runs on: real, stepped by hand, or a simulator's.

Everything timed uses :meth:`Clock.now`, which is monotonic. :meth:`Clock.stamp` turns such a time into the
``builtin_interfaces/Time`` that message headers carry, :meth:`Clock.time_of` turns it back.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from handsteer.timeouts import RESYNC_S, STALE_S

if TYPE_CHECKING:
    from handsteer.messages import Time

_NS_PER_S = 1_000_000_000
_LOOK_AGAIN_S = 0.005
# Simulators tell their time 10 to 1000 times a second.
_STANDS_AFTER_S = 0.15
# What a clock was set by, at least; less may be a delay.
_LEAST_SET_S = 1.0


class Clock(Protocol):
    """A monotonic clock."""

    def now(self) -> float:
        """Return the time in seconds since an arbitrary, fixed moment; it never goes back."""
        ...

    def stamp(self, time_s: float) -> "Time":
        """Return the header stamp for ``time_s``, a time that :meth:`now` returned."""
        ...

    def time_of(self, stamp: "Time") -> float:
        """Return the time in seconds, as :meth:`now` tells it, that a header stamp stands for."""
        ...

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait until ``wake``, which the caller holds, is notified, or ``timeout_s`` of this clock have passed.

        It may return early: the caller looks again at what it waits for. None waits for the notification alone.
        """
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

    def stamp(self, time_s: float) -> "Time":
        """Return Unix time for the monotonic ``time_s``."""
        return to_stamp(time_s + self._offset_s())

    def time_of(self, stamp: "Time") -> float:
        """Return the monotonic time for the Unix time ``stamp``."""
        return to_seconds(stamp) - self._offset_s()

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait in real seconds."""
        wake.wait(timeout_s)

    def _offset_s(self) -> float:
        return self._epoch_offset_s


class WallClock(RealClock):
    """The machine's monotonic clock; stamps are Unix time as it is now, for graphs that share stamps among processes.

    When the wall clock is set, the stamps of all processes must jump alike, or a frame of one is stale to the other.
    """

    def _offset_s(self) -> float:
        return time.time() - time.monotonic()


class SteppedClock:
    """A clock that moves only when told to; stamps start at 0, as simulated time does in ROS."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now(self) -> float:
        """Return the time in seconds that the clock was last set to."""
        return self._now_s

    def stamp(self, time_s: float) -> "Time":
        """Return ``time_s`` as a stamp."""
        return to_stamp(time_s)

    def time_of(self, stamp: "Time") -> float:
        """Return ``stamp`` in seconds."""
        return to_seconds(stamp)

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait for a moment: only others can move this clock, so the caller has to look again."""
        wake.wait(_LOOK_AGAIN_S)

    def advance_to(self, time_s: float) -> None:
        """Move to ``time_s`` seconds; a time in the past leaves the clock where it is."""
        self._now_s = max(self._now_s, time_s)

    def advance(self, seconds: float) -> None:
        """Move forward by ``seconds``."""
        self.advance_to(self._now_s + seconds)


class SimulatedClock:
    """Follows a simulator's time, as the topic ``/clock`` tells it; may be used from any thread.

    When the simulator's time stands still, so do the stamps, but this clock goes on in real seconds: a watchdog must
    bark even then, and a frame that was stamped by a clock that stands must grow old. When the simulator's time goes
    on, or starts again from an earlier one, this clock goes on from where it is; it never goes back.

    Args:
        real: Tells real, monotonic seconds.
    """

    def __init__(self, real: Callable[[], float] = time.monotonic) -> None:
        self._real = real
        self._lock = threading.Lock()
        self._told_s = 0.0
        self._told_at_s = real() - _STANDS_AFTER_S
        self._offset_s = 0.0
        self._newest_s = 0.0
        # Stamps up to this one are older than the last interruption, and have the offset of before.
        self._old_until_s, self._old_offset_s = -math.inf, 0.0

    @property
    def silence_s(self) -> float:
        """How long ago the simulator's time was told last, in real seconds."""
        return self._real() - self._told_at_s

    def tell(self, time_s: float) -> None:
        """Note that the simulator's time is ``time_s`` seconds now."""
        with self._lock:
            if time_s == self._told_s:
                return  # a simulator that is paused
            now = self._now()
            if time_s + self._offset_s < now:
                self._old_until_s, self._old_offset_s = min(self._told_s, time_s), self._offset_s
                self._offset_s = now - time_s
            self._told_s, self._told_at_s = time_s, self._real()

    def now(self) -> float:
        """Return the time in seconds since the simulator's start, interruptions included."""
        with self._lock:
            return self._now()

    def stamp(self, time_s: float) -> "Time":
        """Return the simulator's time for ``time_s``; never one that the simulator has not reached yet."""
        with self._lock:
            return to_stamp(max(0.0, min(time_s - self._offset_s, self._told_s)))

    def time_of(self, stamp: "Time") -> float:
        """Return the time in seconds that the simulator's time ``stamp`` stands for."""
        seconds = to_seconds(stamp)
        with self._lock:
            return seconds + (self._old_offset_s if seconds <= self._old_until_s else self._offset_s)

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait for a moment: how long a second takes here is not known before it is over."""
        wake.wait(_LOOK_AGAIN_S if timeout_s is None or timeout_s > 0 else 0)

    def _now(self) -> float:
        stood_s = max(0.0, self._real() - self._told_at_s - _STANDS_AFTER_S)
        # The greatest of all, because sums of the same seconds in another order differ in their last digit.
        self._newest_s = max(self._newest_s, self._told_s + self._offset_s + stood_s)
        return self._newest_s


class ClockWatch:
    """Notices that the clock which stamps messages, or ours, was set while they came.

    By their stamps, messages that come in order cannot get older faster than time passes; where the clocks are in step,
    none is from the future. Where they do, or one is, by a second or more, a clock was set. Messages are then watched
    for :data:`~handsteer.timeouts.RESYNC_S`; if all of them agree, their ages are corrected by as much.

    Args:
        in_step: Whether the two clocks are meant to tell the same time.

    Attributes:
        set_by_s: By how much the clock was set, in seconds, back if positive.
    """

    def __init__(self, *, in_step: bool) -> None:
        self._in_step = in_step
        self.set_by_s = 0.0
        self._correction_s = 0.0
        self._last: tuple[float, float] | None = None
        self._watched: tuple[float, float] | None = None

    def corrected(self, age_s: float, now_s: float) -> float | None:
        """Return the age of a message without what a clock was set by; None while that is being found out.

        Args:
            age_s: Time of arrival less that of the stamp, in seconds, of whatever two clocks.
            now_s: Time of arrival, in seconds of a monotonic clock.
        """
        last, self._last = self._last, (age_s, now_s)
        if last is not None and self._watched is None and self._was_set(*last, age_s, now_s):
            self._watched, self.set_by_s = (age_s, now_s), age_s - last[0]
        if self._watched is not None:
            first_age_s, since_s = self._watched
            if abs(age_s - first_age_s) > STALE_S:  # one message that was late, no clock
                self._watched = None
            elif now_s - since_s >= RESYNC_S:
                self._correction_s += self.set_by_s
                self._watched = None
        return None if self._watched is not None else age_s - self._correction_s

    def _was_set(self, last_age_s: float, last_s: float, age_s: float, now_s: float) -> bool:
        set_back_s = age_s - last_age_s - (now_s - last_s)
        is_ahead, was_ahead = (age - self._correction_s < -_LEAST_SET_S for age in (age_s, last_age_s))
        return set_back_s > _LEAST_SET_S or (self._in_step and is_ahead and not was_ahead)


def to_stamp(seconds: float) -> "Time":
    """Return ``seconds`` (>= 0) as a ROS time, rounded to a nanosecond."""
    # Whoever reads a video needs a clock and no messages, which take longer to load than all of OpenCV.
    from handsteer.messages import Time  # noqa: PLC0415

    nanoseconds = round(seconds * _NS_PER_S)
    return Time(sec=nanoseconds // _NS_PER_S, nanosec=nanoseconds % _NS_PER_S)


def to_seconds(stamp: "Time") -> float:
    """Return a ROS time in seconds."""
    return stamp.sec + stamp.nanosec / _NS_PER_S
