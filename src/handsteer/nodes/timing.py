"""What nodes know of time: whether they were stalled, the age of frames, recordings, and statistics of durations."""

import logging
from collections import deque

import numpy as np

from handsteer.clock import ClockWatch, clock_change
from handsteer.config import Recorded
from handsteer.messages import Time
from handsteer.timeouts import BURST_S, DISTRUST_S, RECORDED_S, RESYNC_S, STALE_S

log = logging.getLogger(__name__)

CALM_S = 0.09 + 1e-7
"""How long a node may delay its watchdog after a message, which does the same checks, without missing a timeout.

The timeout of 0.35 s then follows after whole periods of 0.02 s of the watchdog; slightly more for rounding of summed
times.
"""


class StallGuard:
    """Detects that a node was stalled: its process was stopped, or the machine was overloaded.

    Without it, commands without a stamp would be obeyed late, however old they are.

    Args:
        limit_s: A longer gap between two calls of :meth:`note` is a stall; may be changed later.
        now_s: Current time, in seconds of the graph's clock.
    """

    def __init__(self, limit_s: float, now_s: float) -> None:
        self.limit_s = limit_s
        self._noted_s = now_s
        self._distrust_until_s = now_s
        self._asked_s = now_s
        self._in_burst = False

    def note(self, now_s: float) -> bool:
        """Record that the node runs; return whether it has just ended a stall."""
        interrupted = now_s - self._noted_s > self.limit_s
        self._noted_s = now_s
        if interrupted:
            self._distrust_until_s = now_s + DISTRUST_S
            self._in_burst = True
        return interrupted

    def distrusts(self, now_s: float) -> bool:
        """Return whether a message received now may have waited during a stall; call once for each message."""
        gap_s, self._asked_s = now_s - self._asked_s, now_s
        if now_s >= self._distrust_until_s and gap_s >= BURST_S:
            self._in_burst = False
        return self._in_burst


TOO_SLOW = "This computer is too slow or busy"

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
        one_clock: Whether camera and this node certainly share a clock, so that an old stamp shows a delay.

    Attributes:
        limit_s: As above; may be changed.
        age_s: Lower bound of the last frame's age.
        ahead_s: Lower bound of the offset by which the camera's clock is ahead of ours.
    """

    def __init__(self, limit_s: float, *, one_clock: bool = False) -> None:
        self.limit_s = limit_s
        self._one_clock = one_clock
        self._noted_s: float | None = None
        self._watch = ClockWatch(in_step=True)
        self.age_s = 0.0
        self.ahead_s = 0.0

    def why_refused(self, now_s: float, captured_s: float, *, is_far: bool = False) -> str | None:
        """Return why a frame received now must not be used, in words; None if it is fresh.

        Args:
            now_s: Current time, in seconds of the graph's clock.
            captured_s: The frame's stamp, in seconds of the same clock.
            is_far: Whether it comes from a browser on another machine.
        """
        elapsed_s = 0.0 if self._noted_s is None else now_s - self._noted_s
        self._noted_s = now_s
        self.ahead_s = max(0.0, self.ahead_s - _LEAK * elapsed_s)
        corrected_s = self._watch.corrected(now_s - captured_s, now_s)
        if corrected_s is None:
            return f"{clock_change(self._watch.set_by_s)}: frames are timed again in a moment"
        by_stamp_s = corrected_s
        if by_stamp_s < -self.limit_s:
            ahead = f"{-by_stamp_s:.1f} s ahead of our clock"
            return f"frames are stamped {ahead}: are the clocks of the machines synchronised?"
        self.ahead_s = max(self.ahead_s, -by_stamp_s)
        self.age_s = by_stamp_s + self.ahead_s
        if self.age_s <= self.limit_s:
            return None
        if is_far:
            return far_and_late(self.age_s)
        if self._one_clock:
            return f"{TOO_SLOW}: pictures arrive {self.age_s:.1f} s late"
        ahead = f" by a clock that is {self.ahead_s:.1f} s ahead of ours" if self.ahead_s >= 0.05 else ""
        return f"frames come {self.age_s:.1f} s after their stamp{ahead}: are the clocks of the machines synchronised?"


def far_and_late(age_s: float) -> str:
    """Return in words that pictures of a browser's camera on another machine arrive ``age_s`` seconds late."""
    return f"Pictures of that device's camera arrive {age_s:.1f} s late: the network or that device may be slow"


class Recording:
    """Decides whether frames come from a recording; these count as captured on arrival.

    The stamp alone is not enough: frames over a slow camera link are old too, and old gestures must not move a robot.
    So ``auto`` accepts only what a player of recordings publishes. Frames with old stamps that advance at the rate of
    time are reported as a possible recording.

    Args:
        recorded: auto accepts what a player publishes; always accepts also stamps older than any link delay; never
            accepts nothing.

    Attributes:
        is_followed: Whether the last frame was accepted as a recording's.
    """

    def __init__(self, recorded: Recorded) -> None:
        self._recorded = recorded
        self.is_followed = False
        self._captured_s: float | None = None
        self._in_step_since: tuple[float, float] | None = None
        self._is_logged = False

    def means(self, age_s: float, *, by_player: bool) -> bool:
        """Return whether a frame whose stamp is so old, in seconds, is meant as a recording's; on any thread."""
        if self._recorded == "auto":
            return by_player
        return self._recorded == "always" and (by_player or age_s > RECORDED_S)

    def follows(self, now_s: float, captured_s: float, *, by_player: bool) -> bool:
        """Record a frame; return whether it is accepted as a recording's, whenever it arrives.

        Args:
            now_s: Current time, in seconds of the graph's clock.
            captured_s: The frame's stamp, in seconds of the same clock.
            by_player: Whether a player of recordings is known to publish it.
        """
        age_s = now_s - captured_s
        stands, self._captured_s = captured_s == self._captured_s, captured_s
        self._note_step(now_s, age_s)
        # A stamp that does not advance comes from a camera or clock that has failed.
        self.is_followed = self.means(age_s, by_player=by_player) and not stands
        if self.is_followed:
            self._log_once(
                logging.INFO, f"frames are stamped {duration_in_words(age_s)} ago: they are followed, as a recording's"
            )
        return self.is_followed

    def hint(self, now_s: float) -> str | None:
        """Return what to do if the last frames, which were refused, are a recording's; None if they cannot be."""
        if self._in_step_since is None or self._recorded == "always":
            return None
        since_s, age_s = self._in_step_since
        if age_s <= RECORDED_S or now_s - since_s < RESYNC_S:
            return None
        hint = (
            f"frames are stamped {duration_in_words(age_s)} ago, and come at their own rate: if they are recorded, set "
            "the parameter recorded to always, or play them with --clock and use_sim_time; otherwise the clocks of the "
            "machines are not synchronised"
        )
        self._log_once(logging.WARNING, hint)
        return hint

    def _note_step(self, now_s: float, age_s: float) -> None:
        if self._in_step_since is None or abs(age_s - self._in_step_since[1]) > STALE_S:
            self._in_step_since = (now_s, age_s)

    def _log_once(self, level: int, message: str) -> None:
        if not self._is_logged:
            log.log(level, message)
        self._is_logged = True


class PlayedTime:
    """Time as the stamps of played frames have it, however long these have waited, so that it never differs.

    Args:
        limit_s: Frames that are further apart, in seconds, are not of one stream.

    Attributes:
        limit_s: As above; may be changed.
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._last_ns: int | None = None
        self._unseen_s = 0.0
        self._counts: dict[str, int] = {}

    def count(self, sign: str) -> None:
        """Record what a frame showed."""
        self._counts[sign] = self._counts.get(sign, 0) + 1

    def report(self) -> None:
        """Log what was played since the last report, if anything was."""
        if self._counts:
            signs = ", ".join(f"{sign} {count}" for sign, count in self._counts.items())
            log.info("%d images of a recording: %s", sum(self._counts.values()), signs)
        self._counts = {}

    def since_last(self, stamp: Time) -> float | None:
        """Return the seconds since the frame before; None for the first one, also of a recording that starts again."""
        stamp_ns = stamp.sec * 10**9 + stamp.nanosec
        last_ns, self._last_ns = self._last_ns, stamp_ns
        if last_ns is None or stamp_ns < last_ns:
            self._unseen_s = 0.0
            return None
        return (stamp_ns - last_ns) / 1e9

    def note(self, since_last_s: float, *, counts: bool) -> bool:
        """Record whether a frame has a sign; return whether none had one for too long."""
        self._unseen_s = 0.0 if counts else self._unseen_s + since_last_s
        return self._unseen_s > self.limit_s

    def end(self) -> None:
        """Forget the recording: a live frame has come."""
        self._last_ns = None


def duration_in_words(seconds: float) -> str:
    """Return a duration in words, such as ``3 days``."""
    for unit, length_s in (("years", 31_557_600.0), ("days", 86_400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length_s:
            return f"{seconds / length_s:.0f} {unit}"
    return f"{seconds:.0f} s"


class LatencyLog:
    """Keeps the newest 10,000 durations and computes their percentiles."""

    def __init__(self) -> None:
        self._seconds: deque[float] = deque(maxlen=10_000)

    def __len__(self) -> int:
        return len(self._seconds)

    def add(self, seconds: float) -> None:
        """Record one duration in seconds."""
        self._seconds.append(seconds)

    def percentile_ms(self, percent: float) -> float:
        """Return a percentile (0 to 100) in milliseconds; 0 if nothing was recorded."""
        return float(np.percentile(list(self._seconds), percent)) * 1000 if self._seconds else 0.0
