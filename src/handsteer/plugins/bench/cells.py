"""Many laps: cells of a table, each a course driven through an interface under conditions, and their statistics."""

import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from types import FrameType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from handsteer.config import Config
from handsteer.errors import BenchError
from handsteer.plugins.bench.courses import open_course
from handsteer.plugins.bench.laps import INTERFACES, Conditions, Lap, run_lap

_RESAMPLES: Final = 2000

FACTORS: Mapping[str, tuple[str, float]] = {
    "latency": ("latency_s", 1e-3),
    "fps": ("fps", 1.0),
    "errors": ("errors", 1.0),
    "reaction": ("reaction_s", 1e-3),
    "gaps": ("gaps_s", 1e-3),
}
"""What sweeps vary: the field of :class:`~handsteer.plugins.bench.laps.Conditions`, and its unit; times are in ms."""


@dataclass(frozen=True)
class Estimate:
    """A median or mean over laps, with its 95 % interval by the bootstrap."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float], statistic: Callable[..., Any] = np.median) -> "Estimate":
        """Return the ``statistic`` of ``values``, which are at least one; the same values give the same interval."""
        array = np.asarray(values, float)
        return cls._of(len(array), lambda drawn: statistic(array[drawn], axis=-1))

    @classmethod
    def of_ratio(cls, values: Sequence[float], others: Sequence[float]) -> "Estimate":
        """Return the ratio of the medians of two series by the same seeds, which are drawn together."""
        above, below = np.asarray(values, float), np.asarray(others, float)
        return cls._of(len(above), lambda drawn: np.median(above[drawn], axis=-1) / np.median(below[drawn], axis=-1))

    @classmethod
    def _of(cls, count: int, statistic: Callable[[NDArray[np.int64]], Any]) -> "Estimate":
        """Return what ``statistic`` makes of (..., ``count``) indices, of all and of drawn ones."""
        draws = np.random.default_rng(0).integers(count, size=(_RESAMPLES, count))
        low, high = np.quantile(statistic(draws), [0.025, 0.975])
        return cls(float(statistic(np.arange(count))), float(low), float(high))


@dataclass(frozen=True)
class Cell:
    """A course driven through an interface under conditions."""

    course: str
    interface: str
    conditions: Conditions = field(default_factory=Conditions)


@dataclass(frozen=True)
class CellResult:
    """The laps of a cell, in the order of their seeds."""

    cell: Cell
    laps: tuple[Lap, ...]

    @property
    def timed_out(self) -> int:
        """How many laps did not end in time; they count with the timeout."""
        return sum(not lap.finished for lap in self.laps)

    def median(self, name: str) -> Estimate | None:
        """Return the median of a field of :class:`~handsteer.plugins.bench.laps.Lap`; None if the course lacks it."""
        values = self.values(name)
        return Estimate.of(values) if values else None

    def mean(self, name: str) -> Estimate:
        """Return the mean of a field, for counts that are mostly 0."""
        return Estimate.of(self.values(name), np.mean)

    def values(self, name: str) -> list[float]:
        """Return the values of a field, without None."""
        return [float(value) for lap in self.laps if (value := getattr(lap, name)) is not None]

    def as_dict(self) -> dict[str, Any]:
        """Return the cell, its statistics and its laps as plain values, for JSON."""
        medians = ("time_s", "score_s", "path_ratio", "cross_track_m", "overshoot_m", "commands_per_min", "standing")
        return {
            **asdict(self.cell),
            "timed_out": self.timed_out,
            "median": {name: asdict(found) for name in medians if (found := self.median(name))},
            "mean": {name: asdict(self.mean(name)) for name in ("bumps", "missed")},
            "laps": [lap.as_dict() for lap in self.laps],
        }


def parse_sweep(text: str) -> tuple[str, list[float]]:
    """Return the factor and the values of ``text``, such as ``latency=0,250,500``.

    Raises:
        BenchError: The factor is unknown, or a value is not a number.
    """
    factor, _, values = text.partition("=")
    if factor not in FACTORS:
        raise BenchError(
            f"--sweep {text!r}: write a factor with values, as latency=0,250; factors: {', '.join(FACTORS)}"
        )
    try:
        numbers = [float(value) for value in values.split(",")]
    except ValueError:
        raise BenchError(f"--sweep {text!r}: {values!r} should be numbers separated by commas") from None
    for number in numbers:
        with_factor(Conditions(), factor, number)
    return factor, numbers


def with_factor(conditions: Conditions, factor: str, value: float) -> Conditions:
    """Return ``conditions`` with one factor changed.

    Raises:
        BenchError: The value is out of range.
    """
    name, unit = FACTORS[factor]
    changed: dict[str, Any] = {name: value * unit}
    return replace(conditions, **changed)


def run_cells(
    cells: Iterable[Cell],
    seeds: Sequence[int],
    *,
    jobs: int = 1,
    config: Config | None = None,
    progress: Callable[[int], object] = lambda count: None,
) -> list[CellResult]:
    """Drive the laps of all cells; the results do not depend on ``jobs``.

    Args:
        cells: The cells; one that occurs twice is driven once.
        seeds: One lap each.
        jobs: Number of processes.
        config: Parameters that differ from the defaults.
        progress: Called with 1 for each lap driven.

    Raises:
        BenchError: An interface is unknown, or a world is not a course.
        WorldError: There is no such world.
    """
    cells = list(dict.fromkeys(cells))
    for cell in cells:
        open_course(cell.course)
        if cell.interface not in INTERFACES:
            raise BenchError(f"there is no interface {cell.interface!r}; use {', '.join(INTERFACES)}")
    work = [(cell, seed, config) for cell in cells for seed in seeds]
    laps: list[Lap] = []
    with _driver(jobs) as driven:
        for lap in driven(work):
            laps.append(lap)
            progress(1)
    count = len(seeds)
    return [CellResult(cell, tuple(laps[at * count : (at + 1) * count])) for at, cell in enumerate(cells)]


_Work = tuple[Cell, int, Config | None]
_CAN_BLOCK: Final = hasattr(signal, "pthread_sigmask")  # not on Windows
_INTERRUPTED: Final = threading.Event()
"""Of a process of the pool."""


def _lap(work: _Work) -> Lap:
    cell, seed, config = work
    return run_lap(cell.course, cell.interface, seed, cell.conditions, config=config)


@contextmanager
def _driver(jobs: int) -> Iterator[Callable[[Iterable[_Work]], Iterator[Lap]]]:
    if jobs == 1:
        yield partial(map, _lap)
        return
    # Not forked: the landmark models' threads would be missing in the children.
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), initializer=_take_interrupts) as pool:
        try:
            yield partial(_start, pool)
        finally:
            pool.shutdown(cancel_futures=True)


def _start(pool: ProcessPoolExecutor, work: Iterable[_Work]) -> Iterator[Lap]:
    """Start all of ``work``; the processes inherit that Ctrl-C, which a terminal sends to them too, has to wait."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]) if _CAN_BLOCK else set()
    try:
        return pool.map(_lap_of_process, work)
    finally:
        if _CAN_BLOCK:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _take_interrupts() -> None:
    signal.signal(signal.SIGINT, _note_interrupt)
    if _CAN_BLOCK:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])


def _note_interrupt(_signal: int, _frame: FrameType | None) -> None:
    _INTERRUPTED.set()


def _end_lap(_signal: int, _frame: FrameType | None) -> None:
    _INTERRUPTED.set()
    raise KeyboardInterrupt


def _lap_of_process(work: _Work) -> Lap:
    """Drive a lap in a process of the pool, unless it has been interrupted, which ends the lap it drives too."""
    signal.signal(signal.SIGINT, _end_lap)
    try:
        if _INTERRUPTED.is_set():
            raise KeyboardInterrupt
        return _lap(work)
    finally:
        signal.signal(signal.SIGINT, _note_interrupt)
