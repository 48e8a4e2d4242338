"""How far a share or a rate that was counted may be from the true one: 95 % intervals."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

_Z: Final = 1.959964
"""97.5 % of a normal distribution are below so many standard deviations."""
_TAIL: Final = 0.025


@dataclass(frozen=True)
class Share:
    """So many of so many."""

    count: int
    of: int

    @property
    def rate(self) -> float | None:
        """0 to 1; None of nothing."""
        return self.count / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the rate, 0 to 1; None of nothing.

        It is the score interval: with the rate p of n and z = 1.96, it is (p + z²/2n ± z √(p(1-p)/n + z²/4n²)) /
        (1 + z²/n); it holds for few, and for a rate of 0 or 1, too. E. B. Wilson, "Probable inference, the law of
        succession, and statistical inference", Journal of the American Statistical Association 22 (1927).
        """
        if not self.of:
            return None
        rate, n = self.count / self.of, self.of
        middle = rate + _Z**2 / (2 * n)
        reach = _Z * math.sqrt(rate * (1 - rate) / n + _Z**2 / (4 * n**2))
        low, high = (side / (1 + _Z**2 / n) for side in (middle - reach, middle + reach))
        # Rounding must not leave the rate outside.
        return max(0.0, min(low, rate)), min(1.0, max(high, rate))

    def as_dict(self) -> dict[str, Any]:
        """Return the share as plain values, for JSON."""
        low, high = self.interval or (None, None)
        return {"count": self.count, "of": self.of, "rate": self.rate, "low": low, "high": high}


@dataclass(frozen=True)
class Rate:
    """So many events in so long a time, in seconds."""

    count: int
    duration_s: float

    @property
    def per_minute(self) -> float:
        """Events a minute; 0 in no time."""
        return 60 * self.count / self.duration_s if self.duration_s else 0.0

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the events a minute; None in no time.

        It is the exact interval of a Poisson count k: its lower end is the mean of which k or more come in 2.5 % of
        all cases, its upper end that of which k or fewer do. It takes the events to be independent of each other; in
        one recording they seldom are, so that it is too narrow then. F. Garwood, "Fiducial limits for the Poisson
        distribution", Biometrika 28 (1936).
        """
        if not self.duration_s:
            return None
        low = _where(lambda mean: 1 - _at_most(self.count - 1, mean) >= _TAIL) if self.count else 0.0
        high = _where(lambda mean: _at_most(self.count, mean) <= _TAIL)
        return low * 60 / self.duration_s, high * 60 / self.duration_s

    def as_dict(self, name: str) -> dict[str, float | None]:
        """Return the events a minute and their interval as plain values, for JSON; their names begin with ``name``."""
        low, high = self.interval or (None, None)
        return {f"{name}_per_minute": self.per_minute, f"{name}_per_minute_low": low, f"{name}_per_minute_high": high}


def _at_most(count: int, mean: float) -> float:
    """Return how likely ``count`` or fewer events are where ``mean`` are expected."""
    return math.fsum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in range(count + 1))


def _where(is_above: Callable[[float], bool]) -> float:
    """Return the mean > 0 from which ``is_above`` holds."""
    low, high = 1e-9, 1.0
    while not is_above(high):
        low, high = high, 2 * high
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return high
