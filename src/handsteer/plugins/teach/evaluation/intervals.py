"""95 % confidence intervals of counted shares and rates."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

_Z: Final = 1.959964
"""The 97.5 % quantile of the standard normal distribution."""
_TAIL: Final = 0.025


@dataclass(frozen=True)
class Share:
    """A share of a total count."""

    count: int
    of: int

    @property
    def rate(self) -> float | None:
        """0 to 1; None if the total is 0."""
        return self.count / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the rate, 0 to 1; None if the total is 0.

        The score interval: with the rate p of n and z = 1.96, (p + z²/2n ± z √(p(1-p)/n + z²/4n²)) / (1 + z²/n). It is
        valid for small n, and for rates of 0 and 1. E. B. Wilson, "Probable inference, the law of succession, and
        statistical inference", Journal of the American Statistical Association 22 (1927).
        """
        if not self.of:
            return None
        rate, n = self.count / self.of, self.of
        middle = rate + _Z**2 / (2 * n)
        reach = _Z * math.sqrt(rate * (1 - rate) / n + _Z**2 / (4 * n**2))
        low, high = (side / (1 + _Z**2 / n) for side in (middle - reach, middle + reach))
        # Rounding must not exclude the rate.
        return max(0.0, min(low, rate)), min(1.0, max(high, rate))

    def as_dict(self) -> dict[str, Any]:
        """Return the share as plain values, for JSON."""
        low, high = self.interval or (None, None)
        return {"count": self.count, "of": self.of, "rate": self.rate, "low": low, "high": high}


@dataclass(frozen=True)
class Rate:
    """A number of events in a time in seconds."""

    count: int
    duration_s: float

    @property
    def per_minute(self) -> float:
        """Events per minute; 0 if the time is 0."""
        return 60 * self.count / self.duration_s if self.duration_s else 0.0

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the events per minute; None if the time is 0.

        The exact interval of a Poisson count k: at its lower end, k or more events have a probability of 2.5 %, at its
        upper end k or fewer do. It assumes independent events; within one recording they seldom are, and the interval
        is then too narrow. F. Garwood, "Fiducial limits for the Poisson distribution", Biometrika 28 (1936).
        """
        if not self.duration_s:
            return None
        low = _where(lambda mean: 1 - _at_most(self.count - 1, mean) >= _TAIL) if self.count else 0.0
        high = _where(lambda mean: _at_most(self.count, mean) <= _TAIL)
        return low * 60 / self.duration_s, high * 60 / self.duration_s

    def as_dict(self, name: str) -> dict[str, float | None]:
        """Return the events per minute and their interval as plain values, for JSON; the keys begin with ``name``."""
        low, high = self.interval or (None, None)
        return {f"{name}_per_minute": self.per_minute, f"{name}_per_minute_low": low, f"{name}_per_minute_high": high}


def _at_most(count: int, mean: float) -> float:
    """Return the probability of ``count`` or fewer events if ``mean`` are expected."""
    return math.fsum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in range(count + 1))


def _where(is_above: Callable[[float], bool]) -> float:
    """Return the mean > 0 at which ``is_above`` becomes true."""
    low, high = 1e-9, 1.0
    while not is_above(high):
        low, high = high, 2 * high
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return high
