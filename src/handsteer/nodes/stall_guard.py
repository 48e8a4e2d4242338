"""What a node that was itself held up does with messages that waited meanwhile: nothing, for they may be old."""

from handsteer.timeouts import BURST_S, HELD_UP_S

CALM_S = 0.09 + 1e-7
"""How long a node's watchdog may sleep after a message, which does the same work: what it looks for comes no sooner.

Whole beats of 0.02 s later the timeout of 0.35 s has passed; a hair more, as sums of times are not exact.
"""


class StallGuard:
    """Notices that a node was held up: its process was stopped, or the machine was too busy.

    Commands without a time of their own would be obeyed late otherwise, however old they are.

    Args:
        limit_s: A longer gap between two calls of :meth:`note` is an interruption; may be set later, too.
        now_s: The time now, in seconds of the graph's clock.
    """

    def __init__(self, limit_s: float, now_s: float) -> None:
        self.limit_s = limit_s
        self._noted_s = now_s
        self._distrust_until_s = now_s
        self._asked_s = now_s
        self._in_burst = False

    def note(self, now_s: float) -> bool:
        """Note that the node runs; return whether it has just come out of an interruption."""
        interrupted = now_s - self._noted_s > self.limit_s
        self._noted_s = now_s
        if interrupted:
            self._distrust_until_s = now_s + HELD_UP_S
            self._in_burst = True
        return interrupted

    def distrusts(self, now_s: float) -> bool:
        """Return whether a message that comes now may have waited during an interruption; ask once for each."""
        gap_s, self._asked_s = now_s - self._asked_s, now_s
        if now_s >= self._distrust_until_s and gap_s >= BURST_S:
            self._in_burst = False
        return self._in_burst
