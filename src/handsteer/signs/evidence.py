"""What the last frames of the followed hand say together."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from handsteer.signs.operator import Place

_FRAMES: Final = 12
_STILL: Final = 0.25
"""How far a hand that is held still may stray during the confirmation, in its own sizes; chosen, not measured."""


@dataclass(frozen=True)
class _Seen:
    dt_s: float
    place: Place
    likelihoods: Mapping[str, float]


class Evidence:
    """The last 12 frames of one hand: whether it is held still, and how likely each sign has been."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque(maxlen=_FRAMES)

    def add(self, place: Place | None, likelihoods: Mapping[str, float], dt_s: float) -> None:
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
