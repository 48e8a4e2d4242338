"""Over time: when a sign that is seen comes to count."""

from handsteer.config import SignsConfig
from handsteer.types import NONE, STOP

# Frames that come in step have stamps that do not: without it, rounding decides about a whole frame.
_SLACK_S = 0.001


class SignFilter:
    """Confirms signs, and bridges short losses.

    - ``Stop`` counts at its first frame.
    - Any other sign counts once a hand that is held still has shown it, frame after frame, for ``confirm_time``.
    - A sign that counts goes on counting for up to ``dropout_hold`` in which it is not seen; then it is ``NONE``.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self._candidate = NONE
        self._candidate_s = 0.0
        self._unseen_s = 0.0
        self.sign = NONE

    @property
    def candidate(self) -> str:
        """The sign that is seen but does not count yet; ``NONE`` when there is none."""
        return self._candidate

    @property
    def candidate_s(self) -> float:
        """For how long the candidate has been seen, seconds."""
        return self._candidate_s

    @property
    def progress(self) -> float:
        """How far the candidate is on its way to count, 0 to 1."""
        if self._candidate == NONE:
            return 0.0
        return min(1.0, self._candidate_s / self._config.confirm_time) if self._config.confirm_time else 1.0

    def step(self, seen: str, dt_s: float, *, still: bool = True) -> str:
        """Take what one frame shows and return the sign that counts.

        Args:
            seen: A sign, or ``NONE``.
            dt_s: Seconds since the last frame, >= 0.
            still: Whether the hand is held still; while it is not, no time is counted for a new sign.
        """
        if seen in (self.sign, STOP):
            self._accept(seen)
            return self.sign
        self._candidate_s = self._candidate_s + dt_s if still and seen == self._candidate else 0.0
        self._candidate = seen
        self._unseen_s += dt_s
        if seen != NONE and self._candidate_s >= self._config.confirm_time - _SLACK_S:
            self._accept(seen)
        elif self._unseen_s > self._config.dropout_hold + _SLACK_S:
            self.sign = NONE
        return self.sign

    def reconfigure(self, config: SignsConfig) -> None:
        """Go on with other times; the sign that counts stays."""
        self._config = config

    def reset(self) -> None:
        """Forget everything: the next sign starts from ``NONE``."""
        self._accept(NONE)

    def _accept(self, sign: str) -> None:
        self.sign = sign
        self._candidate = NONE
        self._candidate_s = 0.0
        self._unseen_s = 0.0
