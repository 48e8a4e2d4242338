"""``handsteer bench``: how well does one drive through each interface?"""

import json as json_format
import os
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Parameters, loads
from handsteer.cli.running import check_writable, say, settings
from handsteer.errors import BenchError, needing

if TYPE_CHECKING:
    from handsteer.bench.cells import Cell, CellResult, Estimate

Words = Annotated[list[str] | None, Parameter(negative="")]

_HEAD = (
    *("course", "interface", "conditions", "laps", "time s", "timed out", "missed", "bumps"),
    *("path", "off cm", "over cm", "acts/min", "stands"),
)


@loads("handsteer.cli.table", "handsteer.config", "tqdm")
def bench(
    *,
    course: Words = None,
    interface: Words = None,
    seeds: int = 20,
    first_seed: int = 0,
    through: Literal["landmarks", "pictures"] = "landmarks",
    latency: float = 0.0,
    fps: float = 30.0,
    sweep: Words = None,
    jobs: int | None = None,
    json: Path | None = None,
    plots: Path | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Measure laps that a simulated operator drives through interfaces. Simulated laps are no user study.

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
    through
        landmarks of the virtual hand, with the errors measured on people; or pictures of it, which take longer.
    latency
        Added delay in the loop, half of it each way, in ms.
    fps
        Frames per second of the camera of the hand.
    sweep
        Vary one condition, such as latency=0,250,500,750 (ms), fps=10,15,30,60, errors=0,1,2,4 (factor on the errors
        of landmarks and operator) or reaction=150,250,400 (ms); may be repeated.
    jobs
        Number of processes; by default one per processor. It does not change the results.
    json
        Write all laps and statistics to this file.
    plots
        Write plots (PNG) into this folder.
    config_file
        YAML file with parameters of handsteer, such as control.rule; options override it.
    """
    from tqdm import tqdm

    if not 1 <= seeds <= 10_000 or first_seed < 0:
        raise BenchError(f"--seeds: {seeds} should be 1 to 10,000, and --first-seed, {first_seed}, not negative")
    if jobs is not None and jobs < 1:
        raise BenchError(f"--jobs: {jobs} should be at least 1")
    with needing("the simulated robot", "sim", "mujoco", "xacro"):
        from handsteer.bench import cells as of_cells  # needs the simulator
        from handsteer.bench.courses import COURSES
        from handsteer.bench.laps import INTERFACES, Conditions
    if json is not None:
        check_writable("--json", json, BenchError)
    drawing = _open_plots(plots)
    base = Conditions(latency_s=latency / 1000, fps=fps, through=through)
    sweeps = [of_cells.parse_sweep(text) for text in sweep or ()]
    varied = [of_cells.with_factor(base, factor, value) for factor, values in sweeps for value in values] or [base]
    cells = [
        of_cells.Cell(name, of, conditions)
        for name in course or COURSES
        for of in interface or INTERFACES
        for conditions in varied
    ]
    numbers = range(first_seed, first_seed + seeds)
    with tqdm(total=len(dict.fromkeys(cells)) * seeds, unit="lap", disable=None) as bar:
        results = of_cells.run_cells(
            cells,
            numbers,
            jobs=jobs or os.cpu_count() or 1,
            config=settings(config_file, parameters),
            progress=bar.update,
        )
    print(bench_table(results))
    if json is not None:
        _write(json, json_format.dumps([result.as_dict() for result in results], indent=1))
    if drawing is not None and plots is not None:
        for path in drawing.write_plots(results, sweeps, plots):
            say(f"wrote {path}")
    return 0


def bench_table(results: "list[CellResult]") -> str:
    """Return the results as a table, a row for each cell."""
    from handsteer.cli.table import table

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
        from handsteer.bench import plots
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
