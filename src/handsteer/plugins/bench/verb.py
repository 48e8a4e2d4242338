"""``handsteer bench``: how well does one drive through each interface?"""

import json as json_format
import os
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, MaybeWhole, Parameters, Whole, loads
from handsteer.cli.running import check_writable, say, settings, table
from handsteer.errors import BenchError, needing

if TYPE_CHECKING:
    from handsteer.config import Config
    from handsteer.plugins.bench.cells import Cell, CellResult, Estimate
    from handsteer.plugins.bench.laps import Conditions

Words = Annotated[list[str] | None, Parameter(negative="")]

_HEAD = ("interface", "conditions", "time", "late", "miss", "bumps", "path", "off", "over", "acts", "rest")
_WORDS = """\
time   median in seconds, with its 95 % interval; no lap counts with more than three minutes
late   laps that took longer than that
miss   gates missed a lap, mean
bumps  into obstacles a lap, mean
path   median length of the way driven, divided by that of the ideal path
off    median distance from the ideal path, root mean square of a lap, in cm
over   median of how far it came beyond the place to stop at, in cm
acts   median of what the operator changes a minute: a sign, a key, the aim of a fist or thumb
rest   median share of the time at rest, in percent

A simulated operator drove, no person. Intervals of all figures: --json."""

_RARE: Final = ("conditions", "late", "over")
_COURSE: Final = "slalom"
_SEEDS: Final = 5
_ALL_SEEDS: Final = 20
_BAR: Final = "{percentage:3.0f} % {bar} {n_fmt} of {total_fmt} laps, {remaining} left"


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
        of landmarks and operator), reaction=150,250,400 (ms) or gaps=0,1000,2000 (ms, for which the operator does not
        look, now and then); may be repeated.
    assist
        off, brake or steer, as control.assist; may be repeated. By default control.assist.
    operator
        worse reacts in 0.4 s instead of 0.25, errs twice as often, and now and then looks away for 2 s.
    """

    through: Literal["landmarks", "pictures"] = "landmarks"
    latency: float = 0.0
    fps: float = 30.0
    sweep: Words = None
    assist: Words = None
    operator: Literal["good", "worse"] = "good"

    def sweeps(self) -> "list[tuple[str, list[float]]]":
        """Return each condition that is varied, with its values."""
        from handsteer.plugins.bench.cells import parse_sweep

        return [parse_sweep(text) for text in self.sweep or ()]

    def conditions(self, assist: str) -> "list[Conditions]":
        """Return all conditions to drive under; ``assist`` where none is named."""
        from handsteer.plugins.bench.cells import with_factor
        from handsteer.plugins.bench.laps import Conditions, worse

        usual = Conditions(latency_s=self.latency / 1000, fps=self.fps, through=self.through)
        usual = worse(usual) if self.operator == "worse" else usual
        varied = [with_factor(usual, factor, value) for factor, values in self.sweeps() for value in values] or [usual]
        return [replace(each, assist=kind) for each in varied for kind in self.assist or [assist]]


@loads("handsteer.config", "rich.table", "tqdm")
def bench(
    *,
    course: Words = None,
    interface: Words = None,
    all: bool = False,
    seeds: MaybeWhole = None,
    first_seed: Whole = 0,
    varied: Varied = Varied(),
    jobs: MaybeWhole = None,
    json: Path | None = None,
    plots: Path | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Measure laps that a simulated operator drives through interfaces. Simulated laps are not a user study.

    For example:
      handsteer bench        five laps of the slalom through each interface: a minute or two
      handsteer bench --all  twenty laps of each of five courses: up to an hour
      handsteer bench --course maze --interface signs --interface pad
      handsteer bench --sweep latency=0,250,500

    Parameters
    ----------
    course
        Course to drive: slalom, figure-eight, stop-line, parking, maze, doors, narrow-doors, corridor, roundabout,
        warehouse, or a world file with gates; may be repeated. By default the slalom; with --all the first five.
    interface
        signs, signs_per_second, joystick, point, pad, keys, sliders or gamepad; may be repeated. All by default.
    all
        Drive more courses, and more laps.
    seeds
        Number of laps on each course through each interface: 5 by default, 20 with --all.
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
    laps = seeds if seeds is not None else _ALL_SEEDS if all else _SEEDS
    _check(laps, first_seed, jobs)
    with needing("the simulated robot", "sim", "mujoco", "xacro"):
        from handsteer.plugins.bench.laps import INTERFACES
    if json is not None:
        check_writable("--json", json, BenchError, _read_json)
    drawing = _open_plots(plots)
    from handsteer.config import assist_of
    from handsteer.plugins.bench.courses import COURSES

    courses = course or (list(COURSES) if all else [_COURSE])
    config = settings(config_file, parameters)
    conditions = varied.conditions(assist_of(config.control, config.collision_monitor))
    cells = _cells(courses, interface or list(INTERFACES), conditions)
    results = _drive(cells, range(first_seed, first_seed + laps), jobs, config)
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


def _cells(courses: list[str], interfaces: list[str], conditions: "list[Conditions]") -> "list[Cell]":
    from handsteer.plugins.bench.cells import Cell

    return [Cell(course, interface, each) for course in courses for interface in interfaces for each in conditions]


def _drive(cells: "list[Cell]", seeds: range, jobs: int | None, config: "Config") -> "list[CellResult]":
    """Drive all laps, with a progress bar on a terminal."""
    from tqdm import tqdm

    from handsteer.plugins.bench.cells import run_cells

    with tqdm(total=len(dict.fromkeys(cells)) * len(seeds), bar_format=_BAR, disable=None) as bar:
        return run_cells(cells, seeds, jobs=jobs or os.cpu_count() or 1, config=config, progress=bar.update)


def bench_table(results: "list[CellResult]") -> str:
    """Return the results as a table for each course, a row for each cell, and what the words mean."""
    parts = []
    for course in dict.fromkeys(result.cell.course for result in results):
        rows = [_row(result) for result in results if result.cell.course == course]
        # Columns in which there is nothing are left out.
        shown = [at for at, name in enumerate(_HEAD) if name not in _RARE or any(row[at] not in "-." for row in rows)]
        cells = table(
            [_HEAD[at] for at in shown], [[row[at] for at in shown] for row in rows], text_columns=1 + (1 in shown)
        )
        parts.append(f"{course}, {len(results[0].laps)} laps each\n\n{cells}")
    return "\n\n".join([*parts, _WORDS])


def _row(result: "CellResult") -> list[str]:
    cell = result.cell
    return [
        *(cell.interface, _conditions(cell), _interval(result.median("time_s"))),
        *(str(result.timed_out or "."), _number(result.mean("missed"), 2), _number(result.mean("bumps"), 2)),
        _number(result.median("path_ratio"), 2),
        _number(result.median("cross_track_m"), 1, 100),
        _number(result.median("overshoot_m"), 1, 100),
        _number(result.median("commands_per_min"), 0),
        _number(result.median("standing"), 0, 100),
    ]


def _interval(found: "Estimate | None") -> str:
    if found is None:
        return "-"
    value, low, high = (_short(each, 1) for each in (found.value, found.low, found.high))
    return f"{value} ({low}-{high})"


def _number(found: "Estimate | None", digits: int, factor: float = 1.0) -> str:
    return "-" if found is None else _short(factor * found.value, digits)


def _short(value: float, digits: int) -> str:
    """Return a number of at most five characters, below 10,000."""
    return f"{value:.{digits if value < 10 else min(digits, 1) if value < 99.95 else 0}f}"


def _conditions(cell: "Cell") -> str:
    """Return what differs from the defaults, in words."""
    found, usual = cell.conditions, type(cell.conditions)()
    words = {
        "latency_s": f"+{1000 * found.latency_s:.0f} ms",
        "fps": f"{found.fps:g}/s",
        "errors": f"errors x{found.errors:g}",
        "reaction_s": f"reacts {1000 * found.reaction_s:.0f} ms",
        "gaps_s": f"looks away {1000 * found.gaps_s:.0f} ms",
        "through": found.through,
        "assist": found.assist,
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


def _read_json(path: Path) -> object:
    with path.open(encoding="utf-8") as file:
        return json_format.load(file)


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BenchError(f"--json: cannot write {path}: {error.strerror}") from None
