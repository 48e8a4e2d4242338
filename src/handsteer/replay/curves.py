"""Values over time, in bounded memory, and thinned out for a chart."""

from array import array

import numpy as np
from numpy.typing import NDArray

MOST_SHOWN = 20_000
"""Points of a curve in a chart; more would only make the page larger and slower."""

_MOST_KEPT = 400_000


class Curve:
    """Rows of numbers, of which the first is the time; beyond some 400,000 rows, only every second one is kept.

    Args:
        columns: Numbers per row, with the time.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._rows = array("d")
        self._stride = self._skipped = 1

    def __len__(self) -> int:
        return len(self._rows) // self._columns

    def add(self, *row: float) -> None:
        """Add a row."""
        if self._skipped < self._stride:
            self._skipped += 1
            return
        self._skipped = 1
        self._rows.extend(row)
        if len(self) >= _MOST_KEPT:
            kept = np.frombuffer(self._rows).reshape(-1, self._columns)[::2].tobytes()
            self._rows = array("d", kept)
            self._stride *= 2

    def table(self, most: int = MOST_SHOWN) -> NDArray[np.float64]:
        """Return at most about ``most`` rows, (n, columns), with the smallest and largest value of each part."""
        table = np.frombuffer(self._rows.tobytes()).reshape(-1, self._columns)
        if len(table) <= most:
            return table
        # Each part gives two rows per column of values.
        parts = np.array_split(np.arange(len(table)), max(1, most // (2 * (self._columns - 1))))
        chosen = set[int]()
        for part in parts:
            values = table[part[0] : part[-1] + 1, 1:]
            chosen.update((part[0] + values.argmin(axis=0)).tolist(), (part[0] + values.argmax(axis=0)).tolist())
        return table[sorted(chosen)]
