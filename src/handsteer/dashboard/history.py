"""The velocities of the last 30 s, for the plot."""

import threading
from collections import deque
from dataclasses import dataclass

from handsteer.types import Velocity

SPAN_S = 30.0
PERIOD_S = 0.05
"""Time between samples."""


@dataclass(frozen=True)
class Sample:
    """Both velocities at one moment.

    Attributes:
        at_s: Seconds of the graph's clock.
        commanded: The commanded velocity; None without a command.
        measured: The velocity from odometry; None without odometry.
    """

    at_s: float
    commanded: Velocity | None
    measured: Velocity | None


class VelocityHistory:
    """Keeps the samples of the last :data:`SPAN_S` seconds; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._samples: deque[Sample] = deque(maxlen=round(SPAN_S / PERIOD_S) + 1)
        self._count = 0

    def add(self, sample: Sample) -> None:
        """Append ``sample``, unless the last one is younger than half of :data:`PERIOD_S`."""
        with self._lock:
            if not self._samples or sample.at_s - self._samples[-1].at_s >= PERIOD_S / 2:
                self._samples.append(sample)
                self._count += 1

    def since(self, count: int, now_s: float) -> tuple[int, list[Sample]]:
        """Return the total number of samples so far, and the recent ones after the first ``count``."""
        with self._lock:
            fresh = min(self._count - count, len(self._samples))
            samples = list(self._samples)[len(self._samples) - fresh :] if fresh > 0 else []
            return self._count, [sample for sample in samples if now_s - sample.at_s <= SPAN_S]
