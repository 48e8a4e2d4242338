"""Over time: how sure the last frames are of a sign, and when a sign that is seen comes to count."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from handsteer.config import SignsConfig
from handsteer.signs.hand_selector import HandPosition
from handsteer.types import NONE, STOP

_FRAMES: Final = 12
_STILL: Final = 0.25
"""How far a hand that is held still may stray during the confirmation, in its own sizes; chosen, not measured."""


@dataclass(frozen=True)
class _Seen:
    dt_s: float
    place: HandPosition
    likelihoods: Mapping[str, float]


class Evidence:
    """The last 12 frames of one hand: whether it is held still, and how likely each sign has been."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque(maxlen=_FRAMES)

    def add(self, place: HandPosition | None, likelihoods: Mapping[str, float], dt_s: float) -> None:
        """Take the next frame.

        Args:
            place: Where its palm is; None when it is not in view, which forgets all before.
            likelihoods: How likely each sign is, 0 to 1.
            dt_s: Seconds since the last frame, >= 0.
        """
        if place is None:
            self._seen.clear()
        else:
            self._seen.append(_Seen(dt_s, place, likelihoods))

    def is_still(self, seconds: float) -> bool:
        """Return whether the hand strayed by less than a quarter of its size in the last ``seconds``.

        A hand that has been in view for less than that is judged by the frames there are.
        """
        if not self._seen:
            return False
        now = self._seen[-1].place
        return all(now.distance(each.place) <= _STILL for each in self._last(seconds))

    def likelihood(self, sign: str, seconds: float) -> float:
        """Return the mean likelihood of ``sign`` in the last ``seconds``, 0 to 1; 0 without a frame."""
        last = self._last(seconds)
        return sum(each.likelihoods.get(sign, 0.0) for each in last) / len(last) if last else 0.0

    def reset(self) -> None:
        """Forget all frames."""
        self._seen.clear()

    def _last(self, seconds: float) -> list[_Seen]:
        """Return the newest frame, and those before it that are at most ``seconds`` older."""
        last: list[_Seen] = []
        age_s = 0.0
        for each in reversed(self._seen):
            if age_s > seconds + 1e-9:
                break
            last.append(each)
            age_s += each.dt_s
        return last


# Frames that come in step have stamps that do not: without it, rounding decides about a whole frame.
_SLACK_S = 0.001


class Debouncer:
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
