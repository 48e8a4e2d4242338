"""The velocity one page commands, and for how long: the pad while held, the sliders while the page is open."""

import math

from handsteer.transports.stale_messages import StaleMessageFilter
from handsteer.types import ZERO, Velocity

SLIDERS_TIMEOUT_S = 0.5
"""Sliders return to zero when the page has not reported for this long."""

_LATE_S = 0.2
_LATEST_MS = 1e15  # far in the future; an integer may be too large for any float
_LATE_IN_A_ROW = 5
_PAGE = b"page"


class PadInput:
    """Computes the velocity that a page commands now, from the most recently used source.

    The pad commands a velocity with each message. The sliders hold theirs while the page keeps reporting that it is
    open and in front. Messages delayed by a stalled network are ignored.

    Attributes:
        sliders: The velocity set by the sliders.
    """

    def __init__(self) -> None:
        self.sliders = ZERO
        self._heard_s = -math.inf
        self._lateness = StaleMessageFilter(_LATE_S)
        self._late = 0

    @property
    def is_late(self) -> bool:
        """Whether the page's messages arrive late repeatedly."""
        return self._late >= _LATE_IN_A_ROW

    def hold_pad(self, wanted: Velocity, sent: object, now_s: float) -> Velocity | None:
        """Handle a pad message, which sets the sliders to zero; return the velocity to steer at, None if it is late.

        Args:
            wanted: The pad's velocity.
            sent: Time of the message in ms of the page's clock, as the browser sent it.
            now_s: Seconds of our monotonic clock.
        """
        self.sliders = ZERO
        return wanted if self._is_timely(sent, now_s) else None

    def slide(self, wanted: Velocity, now_s: float) -> None:
        """Set the sliders; the robot follows once the page reports that it is in front."""
        if self.sliders.is_zero:
            self._heard_s = now_s
        self.sliders = wanted

    def keep_on(self, sent: object, now_s: float) -> Velocity | None:
        """Handle a report that the page is in front; return the velocity to steer at, None for none.

        Args:
            sent: Time of the message in ms of the page's clock, as the browser sent it.
            now_s: Seconds of our monotonic clock.
        """
        self.end_if_silent(now_s)
        if not self._is_timely(sent, now_s):
            return None
        self._heard_s = now_s
        return None if self.sliders.is_zero else self.sliders

    def end_if_silent(self, now_s: float) -> None:
        """Set the sliders to zero if the page has not reported for :data:`SLIDERS_TIMEOUT_S`."""
        if now_s - self._heard_s > SLIDERS_TIMEOUT_S:
            self.sliders = ZERO

    def let_go(self) -> None:
        """Set the sliders to zero."""
        self.sliders = ZERO

    def _is_timely(self, sent: object, now_s: float) -> bool:
        if isinstance(sent, bool) or not isinstance(sent, int | float) or not abs(sent) < _LATEST_MS:
            return False
        is_late = self._lateness.is_late(_PAGE, sent / 1000, now_s)
        self._late = self._late + 1 if is_late else 0
        return not is_late
