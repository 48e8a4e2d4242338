"""``handsteer bench``: how well does one drive through each interface?"""

import json as json_format
import os
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Parameters, loads
from handsteer.cli.running import check_writable, say, settings, table
from handsteer.errors import BenchError, needing

if TYPE_CHECKING:
    from handsteer.config import Config
    from handsteer.plugins.bench.cells import Cell, CellResult, Estimate
    from handsteer.plugins.bench.laps import Conditions

Words = Annotated[list[str] | None, Parameter(negative="")]

_HEAD = (
    *("course", "interface", "conditions", "laps", "time s", "timed out", "missed", "bumps"),
    *("path", "off cm", "over cm", "acts/min", "stands"),
)


@Parameter(name="*")
@dataclass(frozen=True)
class Varied:
    """Under which conditions laps are driven.

    Parameters
    ----------
    through
        landmarks of the virtual hand, with the errors measured on people; or pictures of it, which take longer.
    latency
        Added delay in the loop, half of it each way, in ms.
    fps
        Frames per second of the camera of the hand.
    sweep
        Vary one condition, such as latency=0,250,500,750 (ms), fps=10,15,30,60, errors=0,1,2,4 (factor on the errors
        of landmarks and operator) or reaction=150,250,400 (ms); may be repeated.
    """

    through: Literal["landmarks", "pictures"] = "landmarks"
    latency: float = 0.0
    fps: float = 30.0
    sweep: Words = None

    def sweeps(self) -> "list[tuple[str, list[float]]]":
        """Return each condition that is varied, with its values."""
        from handsteer.plugins.bench.cells import parse_sweep

        return [parse_sweep(text) for text in self.sweep or ()]

    def conditions(self) -> "list[Conditions]":
        """Return all conditions to drive under."""
        from handsteer.plugins.bench.cells import with_factor
        from handsteer.plugins.bench.laps import Conditions

        base = Conditions(latency_s=self.latency / 1000, fps=self.fps, through=self.through)
        return [with_factor(base, factor, value) for factor, values in self.sweeps() for value in values] or [base]


@loads("handsteer.config", "rich.table", "tqdm")
def bench(
    *,
    course: Words = None,
    interface: Words = None,
    seeds: int = 20,
    first_seed: int = 0,
    varied: Varied = Varied(),
    jobs: int | None = None,
    json: Path | None = None,
    plots: Path | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Measure laps that a simulated operator drives through interfaces. Simulated laps are not a user study.

    For example:
      handsteer bench --course slalom --seeds 5  all interfaces
      handsteer bench --course maze --interface signs --interface pad
      handsteer bench --course slalom --sweep latency=0,250,500

    The table has medians with their 95 % intervals, and means of missed gates and bumps a lap.
    Laps that take longer than three minutes count with three minutes.

    Parameters
    ----------
    course
        Course to drive: slalom, figure-eight, stop-line, parking, maze, doors, roundabout, warehouse, or a world file
        with gates; may be repeated. By default, the first five are driven.
    interface
        signs, signs_per_second, cruise, joystick, pad, keys, sliders or gamepad; may be repeated. All by default.
    seeds
        Number of laps of each cell.
    first_seed
        Seed of the first lap; the same seeds give the same laps.
    jobs
        Number of processes; by default one per processor. It does not change the results.
    json
        Write all laps and statistics to this file.
    plots
        Write plots (PNG) into this folder.
    config_file
        YAML file with parameters of handsteer, such as control.rule; options override it.
    """
    _check(seeds, first_seed, jobs)
    with needing("the simulated robot", "sim", "mujoco", "xacro"):
        from handsteer.plugins.bench.laps import INTERFACES
    if json is not None:
        check_writable("--json", json, BenchError)
    drawing = _open_plots(plots)
    cells = _cells(course, interface or list(INTERFACES), varied)
    results = _drive(cells, range(first_seed, first_seed + seeds), jobs, settings(config_file, parameters))
    print(bench_table(results))
    if json is not None:
        _write(json, json_format.dumps([result.as_dict() for result in results], indent=1))
    if drawing is not None and plots is not None:
        for path in drawing.write_plots(results, varied.sweeps(), plots):
            say(f"wrote {path}")
    return 0


def _check(seeds: int, first_seed: int, jobs: int | None) -> None:
    if not 1 <= seeds <= 10_000 or first_seed < 0:
        raise BenchError(f"--seeds: {seeds} should be 1 to 10,000, and --first-seed, {first_seed}, not negative")
    if jobs is not None and jobs < 1:
        raise BenchError(f"--jobs: {jobs} should be at least 1")


def _cells(courses: list[str] | None, interfaces: list[str], varied: Varied) -> "list[Cell]":
    from handsteer.plugins.bench.cells import Cell
    from handsteer.plugins.bench.courses import COURSES

    conditions = varied.conditions()
    return [
        Cell(course, interface, each)
        for course in courses or COURSES
        for interface in interfaces
        for each in conditions
    ]


def _drive(cells: "list[Cell]", seeds: range, jobs: int | None, config: "Config") -> "list[CellResult]":
    """Drive all laps, with a progress bar."""
    from tqdm import tqdm

    from handsteer.plugins.bench.cells import run_cells

    with tqdm(total=len(dict.fromkeys(cells)) * len(seeds), unit="lap", disable=None) as bar:
        return run_cells(cells, seeds, jobs=jobs or os.cpu_count() or 1, config=config, progress=bar.update)


def bench_table(results: "list[CellResult]") -> str:
    """Return the results as a table, a row for each cell."""
    return table(_HEAD, [_row(result) for result in results], text_columns=3)


def _row(result: "CellResult") -> list[str]:
    cell = result.cell
    return [
        *(cell.course, cell.interface, _conditions(cell), str(len(result.laps))),
        _number(result.median("time_s"), 1),
        *(str(result.timed_out or "."), _number(result.mean("missed"), 2), _number(result.mean("bumps"), 2)),
        _number(result.median("path_ratio"), 2),
        _number(result.median("cross_track_m"), 1, 100),
        _number(result.median("overshoot_m"), 1, 100),
        _number(result.median("commands_per_min"), 0),
        _number(result.median("standing"), 0, 100) + " %",
    ]


def _number(found: "Estimate | None", digits: int, factor: float = 1.0) -> str:
    if found is None:
        return "-"
    value, low, high = (f"{factor * each:.{digits}f}" for each in (found.value, found.low, found.high))
    return f"{value} ({low}-{high})"


def _conditions(cell: "Cell") -> str:
    """Return what differs from the defaults, in words."""
    found, usual = cell.conditions, type(cell.conditions)()
    words = {
        "latency_s": f"+{1000 * found.latency_s:.0f} ms",
        "fps": f"{found.fps:g}/s",
        "errors": f"errors x{found.errors:g}",
        "reaction_s": f"reaction {1000 * found.reaction_s:.0f} ms",
        "through": found.through,
    }
    return ", ".join(word for name, word in words.items() if getattr(found, name) != getattr(usual, name)) or "-"


def _open_plots(folder: Path | None) -> ModuleType | None:
    """Return the module of the plots, and make their folder, before laps are driven; None without a folder."""
    if folder is None:
        return None
    with needing("a plot", "plots", "matplotlib"):
        from handsteer.plugins.bench import plots
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BenchError(f"--plots: cannot make the folder {folder}: {error.strerror}") from None
    return plots


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BenchError(f"--json: cannot write {path}: {error.strerror}") from None
