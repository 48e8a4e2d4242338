"""The velocity one page commands, and for how long: the pad while held, the sliders while the page is open."""

import math

from handsteer.transports.timing import StaleMessageFilter
from handsteer.types import ZERO, Velocity

SLIDERS_TIMEOUT_S = 0.5
"""Sliders return to zero when the page has not reported for this long."""

_LATE_S = 0.2
_TOUCHED_MS = 500.0
_LATEST_MS = 1e15  # far in the future; an integer may be too large for any float
_LATE_IN_A_ROW = 5
_PAGE = b"page"


class SteeringInput:
    """Computes the velocity that a page commands now, from the most recently used of pad and sliders.

    The pad commands a velocity with each message. The sliders hold theirs while the page keeps reporting that it is
    open and in front. Messages delayed by a stalled network are ignored. Times are seconds of a monotonic clock; a
    message also carries ``sent``, its time in ms of the page's clock, as the browser sent it.

    Attributes:
        sliders: The velocity set by the sliders.
    """

    def __init__(self) -> None:
        self.sliders = ZERO
        self._reported_s = -math.inf
        self._begins = False
        self._stale = StaleMessageFilter(_LATE_S)
        self._late = 0

    @property
    def is_late(self) -> bool:
        """Whether the page's messages arrive late repeatedly."""
        return self._late >= _LATE_IN_A_ROW

    def hold_pad(self, wanted: Velocity, sent: object, now_s: float) -> Velocity | None:
        """Handle a pad message, which sets the sliders to zero; return the velocity to steer at, None if it is late."""
        self.sliders = ZERO
        return wanted if self._is_timely(sent, now_s) else None

    def slide(self, wanted: Velocity, now_s: float) -> None:
        """Set the sliders; the robot follows once the page reports that it is in front."""
        if self.sliders.is_zero:
            self._reported_s, self._begins = now_s, True
        self.sliders = wanted

    def keep_sliders(self, sent: object, touched: object, now_s: float) -> tuple[Velocity, ...]:
        """Handle a report that the page is in front; return the velocities to steer at, one after the other.

        Sliders that leave zero do so only if they were moved just now, as ``touched`` says, in ms before the report:
        what a network has held back moves nothing. Then the first velocity is zero: they were released until then.
        """
        self.end_if_silent(now_s)
        is_timely = self._is_timely(sent, now_s)
        begins, self._begins = self._begins, False
        if begins and not (is_timely and 0.0 <= read_number(touched, -1.0, _LATEST_MS, -1.0) <= _TOUCHED_MS):
            self.sliders = ZERO
        if not is_timely:
            return ()
        self._reported_s = now_s
        if self.sliders.is_zero:
            return ()
        return (ZERO, self.sliders) if begins else (self.sliders,)

    def end_if_silent(self, now_s: float) -> None:
        """Set the sliders to zero if the page has not reported for :data:`SLIDERS_TIMEOUT_S`."""
        if now_s - self._reported_s > SLIDERS_TIMEOUT_S:
            self.sliders = ZERO

    def _is_timely(self, sent: object, now_s: float) -> bool:
        if isinstance(sent, bool) or not isinstance(sent, int | float) or not abs(sent) < _LATEST_MS:
            return False
        is_late = self._stale.is_late(_PAGE, sent / 1000, now_s)
        self._late = self._late + 1 if is_late else 0
        return not is_late


def read_number(sent: object, low: float, high: float, otherwise: float) -> float:
    """Return the number a browser sent, or ``otherwise`` if it is invalid, clamped to ``low`` to ``high``."""
    value = otherwise
    if isinstance(sent, int | float) and not isinstance(sent, bool) and -math.inf < sent < math.inf:
        value = sent  # clamped without conversion: an integer may be too large for any float
    return float(max(low, min(value, high)))


def read_deflection(sent: object) -> tuple[float, float]:
    """Return the pad's x (right) and y (forward), -1 to 1, as sent by a browser; 0 for invalid values."""
    values = sent if isinstance(sent, dict) else {}
    x, y = (
        value if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1 else 0.0
        for value in (values.get("x"), values.get("y"))
    )
    return float(x), float(y)
