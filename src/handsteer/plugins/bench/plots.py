"""The plots of the bench, drawn with Matplotlib."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Rectangle

from handsteer.errors import BenchError
from handsteer.plugins.bench.cells import FACTORS, CellResult
from handsteer.plugins.bench.courses import Course, open_course
from handsteer.plugins.bench.laps import run_lap
from handsteer.robots.world import Thing
from handsteer.types import Pose2D

# Distinguishable with most kinds of colour blindness.
_LINES: Final = ("#18608e", "#c83830", "#288c3c", "#e6961e", "#963c96", "#787878", "#00a0a0", "#8c6446")
_GREY: Final = "#d2d2d2"
_UNITS: Final = {"latency": "added latency, ms", "fps": "frames a second", "reaction": "reaction time, ms"}


def write_plots(
    results: Sequence[CellResult], sweeps: Sequence[tuple[str, Sequence[float]]], folder: Path
) -> list[Path]:
    """Write plots of ``results`` into ``folder``, and return their files.

    A plot of the times for each course, and one of its ways with a lap through each interface; for each sweep and
    course, one of the times by what is varied.

    Raises:
        BenchError: A file cannot be written.
    """
    written = []
    for name in dict.fromkeys(result.cell.course for result in results):
        here = [result for result in results if result.cell.course == name]
        course = open_course(name)
        stem = Path(name).stem
        plots = {f"{stem}-{factor}": draw_sweep(here, factor, stem) for factor, _ in sweeps}
        if not sweeps:
            plots = {f"{stem}-times": draw_times(here, course), f"{stem}-laps": draw_laps(here, course)}
        for file, figure in plots.items():
            path = folder / f"{file}.png"
            try:
                figure.savefig(path, dpi=100, metadata={"Software": None})
            except OSError as error:
                raise BenchError(f"--plots: cannot write {path}: {error.strerror}") from None
            written.append(path)
    return written


def draw_times(results: Sequence[CellResult], course: Course) -> Figure:
    """Return a plot of the time of each lap through each interface, as dots, and the median with its interval."""
    figure = Figure((7, 0.5 * len(results) + 1.6), layout="constrained")
    size = f"{course.length_m:.1f} m, index of difficulty {course.difficulty:.1f}"
    title = f"{Path(course.name).stem}: times of all laps ({size})"
    axes = figure.add_subplot(title=title, xlabel="time, s; a line for the median and its 95 % interval")
    axes.set_yticks(range(len(results)), [result.cell.interface for result in results])
    axes.invert_yaxis()
    for row, result in enumerate(results):
        times = result.values("time_s")
        axes.plot(times, [row] * len(times), "o", color=_LINES[0], alpha=0.25, markeredgewidth=0)
        found = result.median("time_s")
        assert found is not None
        axes.hlines(row + 0.25, found.low, found.high, color=_LINES[1], linewidth=2)
        axes.plot([found.value], [row + 0.25], "|", color=_LINES[1], markersize=9, markeredgewidth=2)
    axes.set_xlim(left=0)
    axes.grid(axis="x", color=_GREY)
    return figure


def draw_laps(results: Sequence[CellResult], course: Course) -> Figure:
    """Return a map of ``course`` with the ideal path in grey, and the lap of the first seed through each interface."""
    figure = Figure((8, 6), layout="constrained")
    title = f"{Path(course.name).stem}: one lap through each interface, and the ideal path in grey"
    axes = figure.add_subplot(aspect="equal", title=title, xlabel="x, m", ylabel="y, m")
    for thing in course.world.obstacles:
        axes.add_patch(_outline(thing))
    axes.plot(*course.path.points.T, color=_GREY, linewidth=6)
    for gate in course.gates:
        axes.plot(*zip(gate.left, gate.right, strict=True), "--", color="black", linewidth=0.7)
    for number, result in enumerate(results):
        trace: list[Pose2D] = []
        run_lap(course, result.cell.interface, result.laps[0].seed, result.cell.conditions, trace=trace)
        colour = _LINES[number % len(_LINES)]
        axes.plot([pose.x for pose in trace], [pose.y for pose in trace], color=colour, label=result.cell.interface)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def draw_sweep(results: Sequence[CellResult], factor: str, course: str) -> Figure:
    """Return a plot of the median time, with its 95 % interval, by ``factor``: a line for each interface."""
    figure = Figure((7, 5), layout="constrained")
    title = f"{course}: times by {_UNITS.get(factor, factor)}"
    axes = figure.add_subplot(title=title, xlabel=_UNITS.get(factor, factor), ylabel="time, s")
    name, unit = FACTORS[factor]
    for number, interface in enumerate(dict.fromkeys(result.cell.interface for result in results)):
        own = [result for result in results if result.cell.interface == interface]
        points = []
        for result in own:
            found = result.median("time_s")
            assert found is not None
            points.append((getattr(result.cell.conditions, name) / unit, found.value, found.low, found.high))
        x, middle, low, high = zip(*sorted(set(points)), strict=True)
        _line(axes, x, (middle, low, high), _LINES[number % len(_LINES)], interface)
    axes.set_ylim(bottom=0)
    axes.grid(color=_GREY)
    axes.legend()
    return figure


def _line(axes: Axes, x: Sequence[float], estimates: tuple[Sequence[float], ...], colour: str, label: str) -> None:
    middle, low, high = estimates
    axes.plot(x, middle, "o-", color=colour, label=label)
    axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)


def _outline(thing: Thing) -> Patch:
    x, y = thing.position
    if thing.shape != "box":
        return Circle((x, y), thing.extent[0] / 2, color=thing.colour)
    long, wide, _ = thing.extent
    corner = (x - long / 2, y - wide / 2)
    return Rectangle(corner, long, wide, angle=57.29578 * thing.yaw, rotation_point="center", color=thing.colour)
