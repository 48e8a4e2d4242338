"""Rejects messages that waited while a node was stalled, because they may be old."""

from handsteer.timeouts import BURST_S, HELD_UP_S

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
            self._distrust_until_s = now_s + HELD_UP_S
            self._in_burst = True
        return interrupted

    def distrusts(self, now_s: float) -> bool:
        """Return whether a message received now may have waited during a stall; call once for each message."""
        gap_s, self._asked_s = now_s - self._asked_s, now_s
        if now_s >= self._distrust_until_s and gap_s >= BURST_S:
            self._in_burst = False
        return self._in_burst
