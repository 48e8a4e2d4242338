"""Filters signs over time: mean likelihoods of the last frames, and the debouncer that confirms signs."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from handsteer.config import SignsConfig
from handsteer.recognition.hand_selector import HandPosition
from handsteer.types import NONE, STOP

_FRAMES: Final = 12
_STILL: Final = 0.25
"""Largest movement of a still hand during the confirmation, in hand sizes; chosen, not measured."""

# The stamps of periodic frames jitter: without slack, rounding would decide about a whole frame.
_SLACK_S = 0.001


@dataclass(frozen=True)
class _Seen:
    dt_s: float
    place: HandPosition
    likelihoods: Mapping[str, float]


class Evidence:
    """The last 12 frames of one hand: its stillness, and the likelihoods of signs."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque(maxlen=_FRAMES)

    def add(self, place: HandPosition | None, likelihoods: Mapping[str, float], dt_s: float) -> None:
        """Add the next frame.

        Args:
            place: Position of its palm; None if it is not in view, which clears all earlier frames.
            likelihoods: The likelihood of each sign, 0 to 1.
            dt_s: Seconds since the last frame, >= 0.
        """
        if place is None:
            self._seen.clear()
        else:
            self._seen.append(_Seen(dt_s, place, likelihoods))

    def is_still(self, seconds: float) -> bool:
        """Return whether the hand moved by less than a quarter of its size in the last ``seconds``.

        A hand that has been in view for less time is judged by the available frames.
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
        """Clear all frames."""
        self._seen.clear()

    def _last(self, seconds: float) -> list[_Seen]:
        """Return the newest frame, and the earlier ones that are at most ``seconds`` older."""
        last: list[_Seen] = []
        age_s = 0.0
        for each in reversed(self._seen):
            if age_s > seconds + 1e-9:
                break
            last.append(each)
            age_s += each.dt_s
        return last


class Debouncer:
    """Confirms signs, and bridges short losses.

    - ``Stop`` is confirmed at its first frame.
    - Any other sign is confirmed once a still hand has shown it in every frame for ``confirm_time``.
    - A confirmed sign that is not seen stays active for up to ``dropout_hold``; then it becomes ``NONE``.
    """

    def __init__(self, config: SignsConfig) -> None:
        self._config = config
        self._candidate = NONE
        self._candidate_s = 0.0
        self._unseen_s = 0.0
        self.sign = NONE

    @property
    def candidate(self) -> str:
        """The sign that is seen but not confirmed yet; ``NONE`` if there is none."""
        return self._candidate

    @property
    def candidate_s(self) -> float:
        """Seconds since the candidate was first seen."""
        return self._candidate_s

    @property
    def progress(self) -> float:
        """Progress of confirming the candidate, 0 to 1."""
        if self._candidate == NONE:
            return 0.0
        return min(1.0, self._candidate_s / self._config.confirm_time) if self._config.confirm_time else 1.0

    def step(self, seen: str, dt_s: float, *, still: bool = True) -> str:
        """Process one frame and return the confirmed sign.

        Args:
            seen: A sign, or ``NONE``.
            dt_s: Seconds since the last frame, >= 0.
            still: Whether the hand is held still; otherwise the frame's time does not count towards a new sign.
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
        """Change the times; the confirmed sign stays."""
        self._config = config

    def reset(self) -> None:
        """Reset to ``NONE``."""
        self._accept(NONE)

    def _accept(self, sign: str) -> None:
        self.sign = sign
        self._candidate = NONE
        self._candidate_s = 0.0
        self._unseen_s = 0.0
