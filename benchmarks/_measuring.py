"""What several benchmarks measure of processes, on Linux, and the pace at which they send."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

_PROCESSOR_CLOCK = 2


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process so far, over all threads, in seconds."""
    return time.clock_gettime(~pid << 3 | _PROCESSOR_CLOCK)


def resident_mb(process: int | str = "self") -> float:
    """Return the resident memory of a process in MB, including shared libraries."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def at_rate(rate_hz: float, count: int) -> Iterator[int]:
    """Count to ``count``, ``rate_hz`` times a second."""
    due_s = time.monotonic()
    for number in range(count):
        yield number
        due_s += 1 / rate_hz
        time.sleep(max(0.0, due_s - time.monotonic()))
