"""Times of messages: their capture times, repeated and late ones, and a ``/clock`` that stops."""

import logging
import math
from collections import OrderedDict
from typing import Any

from handsteer.clock import Clock, ClockWatch, SimulatedClock, is_time, to_seconds
from handsteer.messages import NO_STAMP, Time

# A sender's clock that is set back by a second is trusted again after a minute and a half; delays are shorter.
_LEAK = 0.01
_SENDERS = 32
# Of simulators that are slower than real time.
_LEAST_PACE = 0.2
# A busy simulator is silent for less.
_CLOCK_SILENCE_S = 2.0

log = logging.getLogger(__name__)


def capture_time(message: Any, clock: Clock) -> float | None:
    """Return the stamp of ``message``, in seconds of ``clock``; None if it has no header or no stamp.

    It is in the future if another machine's clock is ahead of ours.
    """
    header = getattr(message, "header", None)
    if header is None or header.stamp == NO_STAMP:
        return None
    return clock.time_of(header.stamp)


class Repeats:
    """Recognises messages that say nothing of now, by their stamps: a program that hangs may repeat its last one.

    Stamps have to advance at a fifth of the pace at which time passes here, of whatever clock they are.
    """

    def __init__(self) -> None:
        self._stamp_s, self._came_s = -math.inf, -math.inf

    def has(self, stamp: Time, now_s: float) -> bool:
        """Return whether a message that arrives at ``now_s`` has no newer stamp; one without a stamp always counts."""
        if stamp == NO_STAMP:
            return False
        stamp_s = to_seconds(stamp)
        advanced_s = stamp_s - self._stamp_s
        if advanced_s == 0.0:
            return True
        passed_s, self._came_s = now_s - self._came_s, now_s
        self._stamp_s = stamp_s
        return 0.0 < advanced_s < _LEAST_PACE * passed_s


class StaleMessageFilter:
    """Detects late messages from clocks that may not be synchronized.

    The smallest difference of arrival and sending times so far is the offset of the clocks plus the shortest delay; a
    message that exceeds it by more than the limit is late. If a clock was set, the new offset is used after a second
    (:class:`~handsteer.clock.ClockWatch`). It remembers the last 32 senders.

    Args:
        limit_s: Maximum additional delay of a message, in seconds.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._least: OrderedDict[bytes, tuple[float, float, ClockWatch]] = OrderedDict()

    def is_late(self, sender: bytes, sent_s: float, arrived_s: float) -> bool:
        """Return whether a message was delayed for too long; a sender's first one never was.

        Args:
            sender: Identifies the sender.
            sent_s: Time of sending, in seconds of any clock of the sender.
            arrived_s: Time of arrival, in seconds of a local monotonic clock.
        """
        delay_s = self.delay_s(sender, sent_s, arrived_s)
        return delay_s is None or delay_s > self._limit_s

    def delay_s(self, sender: bytes, sent_s: float, arrived_s: float) -> float | None:
        """Return by how much a message took longer than the sender's quickest; None if that is not known now.

        The arguments are those of :meth:`is_late`; call one of the two for each message.
        """
        by_stamp_s = arrived_s - sent_s
        least_s, noted_s, watch = self._least.pop(sender, (by_stamp_s, arrived_s, ClockWatch(in_step=False)))
        apart_s = watch.corrected(by_stamp_s, arrived_s)
        if apart_s is not None:
            least_s = min(apart_s, least_s + _LEAK * (arrived_s - noted_s))
        self._least[sender] = (least_s, arrived_s, watch)
        if len(self._least) > _SENDERS:
            self._least.popitem(last=False)
        return None if apart_s is None else apart_s - least_s


class ClockTimes:
    """Recognises what is not a valid time on ``/clock``; the first such message is logged."""

    def __init__(self) -> None:
        self._is_logged = False

    def has(self, sec: int, nanosec: int) -> bool:
        """Return whether this is a time; other messages have to be ignored."""
        is_valid = is_time(sec, nanosec)
        if not (is_valid or self._is_logged):
            self._is_logged = True
            log.warning(
                "/clock: a message with %d s and %d ns is not a valid time: such messages are ignored", sec, nanosec
            )
        return is_valid


class ClockMonitor:
    """Logs when ``/clock``, which a graph's clock follows, stops; does nothing for other clocks."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._was_silent = False

    def check(self) -> None:
        """Look whether ``/clock`` has stopped."""
        is_silent = isinstance(self._clock, SimulatedClock) and self._clock.silence_s > _CLOCK_SILENCE_S
        if is_silent and not self._was_silent:
            log.warning("use_sim_time is set, but /clock stands still: frames count as old, and the robot is stopped")
        self._was_silent = is_silent
