"""The clock of a graph: real, stepped manually, or a simulator's.

All timing uses :meth:`Clock.now`, which is monotonic. :meth:`Clock.stamp` converts its time to the
``builtin_interfaces/Time`` of message headers, and :meth:`Clock.time_of` converts it back.
"""

import functools
import logging
import math
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from handsteer.timeouts import RESYNC_S, STALE_S

if TYPE_CHECKING:
    from handsteer.messages import Time

_NS_PER_S = 1_000_000_000
# Seconds in a ROS time are an int32.
_FIRST_NS, _LAST_NS = -(2**31) * _NS_PER_S, 2**31 * _NS_PER_S - 1
_LOOK_AGAIN_S = 0.005
# Simulators publish their time 10 to 1000 times a second.
_STANDS_AFTER_S = 0.15
# So that the next sign, within the time that all faults have, stops the robot.
_PAUSED_S = 0.4
# Minimum change that counts as a set clock; less may be a delay.
_LEAST_SET_S = 1.0
# More than every timeout of what moves the robot.
_RESTART_S = 1.0

log = logging.getLogger(__name__)


def _clock_that_runs_in_sleep() -> Callable[[], float]:
    kind = getattr(time, "CLOCK_MONOTONIC" if sys.platform == "darwin" else "CLOCK_BOOTTIME", None)
    try:
        if kind is not None and time.clock_gettime(kind) > 0.0:
            return functools.partial(time.clock_gettime, kind)
    except OSError:  # an old or an emulated kernel
        pass
    return time.monotonic


monotonic = _clock_that_runs_in_sleep()
"""Return monotonic seconds that include those in which the machine sleeps.

``time.monotonic()`` stops for these on Linux and macOS, so that what was received before a sleep would count as new.
"""


class Clock(Protocol):
    """A monotonic clock."""

    @property
    def offset_s(self) -> float:
        """What is added to a time now to get its stamp, in seconds."""
        ...

    def now(self) -> float:
        """Return the time in seconds since an arbitrary, fixed moment; it never goes back."""
        ...

    def stamp(self, time_s: float) -> "Time":
        """Return the header stamp of ``time_s``, a time that :meth:`now` returned."""
        ...

    def time_of(self, stamp: "Time") -> float:
        """Return the time of a header stamp, in seconds of :meth:`now`."""
        ...

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait until ``wake``, which the caller holds, is notified, or ``timeout_s`` of this clock have passed.

        It may return early, so the caller must check its condition again. None waits for the notification alone.
        """
        ...


class RealClock:
    """The machine's monotonic clock; stamps are Unix time.

    The offset between the two is measured once, so that stamps do not jump when the wall clock is set.
    """

    def __init__(self) -> None:
        self._epoch_offset_s = time.time() - monotonic()

    def now(self) -> float:
        """Return :func:`monotonic`, in seconds."""
        return monotonic()

    def stamp(self, time_s: float) -> "Time":
        """Return Unix time for the monotonic ``time_s``."""
        return to_stamp(time_s + self.offset_s)

    def time_of(self, stamp: "Time") -> float:
        """Return the monotonic time for the Unix time ``stamp``."""
        return to_seconds(stamp) - self.offset_s

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait in real seconds."""
        wake.wait(timeout_s)

    @property
    def offset_s(self) -> float:
        """Unix time minus monotonic time, in seconds."""
        return self._epoch_offset_s


class WallClock(RealClock):
    """The machine's monotonic clock; stamps are current Unix time, for graphs that share stamps among processes.

    When the wall clock is set, the stamps of all processes must jump alike, or frames of one are stale in another.
    """

    @property
    def offset_s(self) -> float:
        """Unix time minus monotonic time at this moment, in seconds."""
        return time.time() - monotonic()


class SteppedClock:
    """A clock that moves only on request; stamps start at 0, as simulated time does in ROS.

    Attributes:
        offset_s: What is added to a time to get its stamp, in seconds.
    """

    offset_s = 0.0

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
        """Wait briefly: only others can advance this clock, so the caller has to check again."""
        wake.wait(_LOOK_AGAIN_S)

    def advance_to(self, time_s: float) -> None:
        """Move to ``time_s`` seconds; a time in the past is ignored."""
        self._now_s = max(self._now_s, time_s)

    def advance(self, seconds: float) -> None:
        """Move forward by ``seconds``."""
        self.advance_to(self._now_s + seconds)


class SimulatedClock:
    """Follows a simulator's time from the topic ``/clock``; may be used from any thread.

    When the simulator's time stops, the stamps stop too, but this clock continues in real seconds: watchdogs must still
    expire, and frames stamped with the stopped time must become stale. When the simulator's time continues, this clock
    continues from where it is; it never goes back. A time up to a second before the last one is ignored: it was
    overtaken on the way, or the simulator's time runs backwards, which is as if it had stopped. When the time restarts
    at an earlier one, the world is another: this clock continues a second later, so that everything from before has
    expired.

    Args:
        real: Returns real, monotonic seconds.
    """

    def __init__(self, real: Callable[[], float] = monotonic) -> None:
        self._real = real
        self._lock = threading.Lock()
        self._told_s = 0.0
        self._told_at_s = real() - _STANDS_AFTER_S
        self._offset_s = 0.0
        self._newest_s = 0.0
        # Stamps up to this time are from before the last interruption, and have the offset from before it.
        self._old_until_s, self._old_offset_s = -math.inf, 0.0

    @property
    def silence_s(self) -> float:
        """Time since the simulator's time was last received, in real seconds."""
        return self._real() - self._told_at_s

    @property
    def is_paused(self) -> bool:
        """Whether the simulator's time has not advanced for 0.4 s of real time."""
        return self.silence_s > _PAUSED_S

    def tell(self, time_s: float) -> None:
        """Set the simulator's current time to ``time_s`` seconds."""
        with self._lock:
            if 0 <= self._told_s - time_s <= _LEAST_SET_S:
                return  # the simulator is paused
            now = self._now()
            if time_s + self._offset_s < now:
                is_restart = self._told_s - time_s > _LEAST_SET_S
                self._old_until_s, self._old_offset_s = min(self._told_s, time_s), self._offset_s
                self._offset_s = now - time_s + (_RESTART_S if is_restart else 0.0)
            self._told_s, self._told_at_s = time_s, self._real()

    @property
    def offset_s(self) -> float:
        """The simulator's time minus this clock's, in seconds."""
        with self._lock:
            return -self._offset_s

    def now(self) -> float:
        """Return the time in seconds since the simulator's start, including interruptions."""
        with self._lock:
            return self._now()

    def stamp(self, time_s: float) -> "Time":
        """Return the simulator's time for ``time_s``, at most the latest one received."""
        with self._lock:
            # Rounding can make (latest + offset) - offset differ from the latest time, and its stamp by a nanosecond.
            is_past = time_s < self._told_s + self._offset_s
            return to_stamp(max(0.0, time_s - self._offset_s if is_past else self._told_s))

    def time_of(self, stamp: "Time") -> float:
        """Return the time in seconds of the simulator's time ``stamp``."""
        seconds = to_seconds(stamp)
        with self._lock:
            return seconds + (self._old_offset_s if seconds <= self._old_until_s else self._offset_s)

    def wait(self, wake: threading.Condition, timeout_s: float | None) -> None:
        """Wait briefly: the real duration of a simulated second is not known in advance."""
        wake.wait(_LOOK_AGAIN_S if timeout_s is None or timeout_s > 0 else 0)

    def _now(self) -> float:
        silent_s = self._real() - self._told_at_s
        stood_s = silent_s if silent_s > _STANDS_AFTER_S else 0.0
        # The maximum, because sums of the same seconds in another order differ in their last digit.
        self._newest_s = max(self._newest_s, self._told_s + self._offset_s + stood_s)
        return self._newest_s


class ClockWatch:
    """Detects that our clock, or the one that stamps messages, was set while messages were received.

    By their stamps, messages that arrive in order cannot age faster than time passes, and if the clocks are
    synchronized, none is from the future. A deviation of a second or more shows that a clock was set. Messages are then
    observed for :data:`~handsteer.timeouts.RESYNC_S`, again after a pause of more than twice that. If all of them
    agree, their ages are corrected by the deviation.

    Args:
        in_step: Whether the two clocks are expected to be synchronized.

    Attributes:
        set_by_s: By how much the clock was set, in seconds, back if positive.
    """

    def __init__(self, *, in_step: bool) -> None:
        self._in_step = in_step
        self.set_by_s = 0.0
        self._correction_s = 0.0
        self._trusted: tuple[float, float] | None = None
        self._watched: tuple[float, float] | None = None
        self._seen_s = -math.inf

    def corrected(self, age_s: float, now_s: float) -> float | None:
        """Return the corrected age of a message; None while a change of the clock is being measured.

        Args:
            age_s: Time of arrival minus that of the stamp, in seconds, on any two clocks.
            now_s: Time of arrival, in seconds of a monotonic clock.
        """
        gap_s, self._seen_s = now_s - self._seen_s, now_s
        if self._watched is not None:
            first_age_s, since_s = self._watched
            if abs(age_s - first_age_s) > STALE_S:  # a single late message, not the clock
                self._watched = None
            elif gap_s > 2 * RESYNC_S:  # too few to tell: observe the next
                self._watched = (age_s, now_s)
            elif now_s - since_s >= RESYNC_S:
                self._correction_s += self.set_by_s
                log.warning("%s: the stamps of its messages are corrected by that", clock_change(self.set_by_s))
                self._watched = self._trusted = None
        # What broke off a measurement is compared with the last trusted message, not with one that may be wrong itself.
        if self._watched is None and self._trusted is not None and self._was_set(*self._trusted, age_s, now_s):
            self._watched, self.set_by_s = (age_s, now_s), age_s - self._trusted[0]
        if self._watched is not None:
            return None
        corrected_s = age_s - self._correction_s
        if not self._in_step or corrected_s >= -STALE_S:  # one of the future would make the next ones look late
            self._trusted = (age_s, now_s)
        return corrected_s

    def _was_set(self, last_age_s: float, last_s: float, age_s: float, now_s: float) -> bool:
        set_back_s = age_s - last_age_s - (now_s - last_s)
        is_ahead, was_ahead = (age - self._correction_s < -_LEAST_SET_S for age in (age_s, last_age_s))
        return set_back_s > _LEAST_SET_S or (self._in_step and is_ahead and not was_ahead)


def clock_change(set_by_s: float) -> str:
    """Return in words that a clock was set back by ``set_by_s`` seconds, or ahead if negative."""
    return f"a clock was set {'back' if set_by_s > 0 else 'ahead'} by {abs(set_by_s):.1f} s"


def to_stamp(seconds: float) -> "Time":
    """Return ``seconds`` (>= 0) as a ROS time, rounded to a nanosecond; the nearest one if none holds so many."""
    # Reading a video needs a clock but no messages, which take longer to load than all of OpenCV.
    from handsteer.messages import Time  # noqa: PLC0415

    nanoseconds = max(_FIRST_NS, min(round(seconds * _NS_PER_S), _LAST_NS))
    return Time(sec=nanoseconds // _NS_PER_S, nanosec=nanoseconds % _NS_PER_S)


def to_seconds(stamp: "Time") -> float:
    """Return a ROS time in seconds."""
    return stamp.sec + stamp.nanosec / _NS_PER_S


def is_time(sec: int, nanosec: int) -> bool:
    """Return whether these numbers, as a message has them, are a time of ROS that is not before its start, 0."""
    return 0 <= sec <= _LAST_NS // _NS_PER_S and 0 <= nanosec < _NS_PER_S
