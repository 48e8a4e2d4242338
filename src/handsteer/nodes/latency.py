"""Statistics of recent durations."""

from collections import deque

import numpy as np


class LatencyLog:
    """Keeps the newest durations and computes their percentiles.

    Args:
        capacity: How many are kept.
    """

    def __init__(self, capacity: int = 10_000) -> None:
        self._seconds: deque[float] = deque(maxlen=capacity)

    def __len__(self) -> int:
        return len(self._seconds)

    def add(self, seconds: float) -> None:
        """Record one duration in seconds."""
        self._seconds.append(seconds)

    def percentile_ms(self, percent: float) -> float:
        """Return a percentile (0 to 100) in milliseconds; 0 if nothing was recorded."""
        return float(np.percentile(list(self._seconds), percent)) * 1000 if self._seconds else 0.0
