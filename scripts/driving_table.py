"""Writes the tables and plots of docs/driving.md: ``make bench-drive``; ``--only assist`` those of the assist."""

import argparse
import os
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from scripts.doc_tables import replaced, table
from tqdm import tqdm

from handsteer.plugins.bench.cells import Cell, CellResult, Estimate, run_cells, with_factor
from handsteer.plugins.bench.courses import COURSES, open_course
from handsteer.plugins.bench.laps import INTERFACES, Conditions, worse
from handsteer.plugins.bench.plots import write_plots

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "driving.md"
PICTURES = DOCS / "pictures" / "driving"

SEEDS = range(20)
SEEDS_PICTURES = range(6)
PLOTS = {"times": "Times of all laps", "laps": "A lap through each interface"}
BY_HAND = ("joystick", "point", "signs")
SWEEPS: dict[str, tuple[tuple[str, ...], tuple[float, ...]]] = {
    "latency": (("pad", "joystick", "point"), (0, 250, 500, 750)),
    "fps": (("joystick", "point"), (10, 15, 30, 60)),
    "errors": (("joystick", "point"), (0, 1, 2, 4)),
    "reaction": (("pad", "joystick"), (150, 250, 400)),
}
FINE = ("joystick", "point", "pad")
ASSISTS = ("off", "brake", "steer")
DRIVEN = tuple(each for each in INTERFACES if each != "signs_per_second")
ASSISTED = {
    "maze": DRIVEN,
    "narrow-doors": ("signs", *FINE),
    "corridor": ("signs", *FINE),
    "slalom": DRIVEN,
    "parking": DRIVEN,
}
LATE_S = 0.25


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", choices=("assist", "driving"))
    given = parser.parse_args()
    started_s = time.monotonic()
    laps = 0
    if given.only != "assist":
        laps += _driving(given.jobs)
    if given.only != "driving":
        laps += _assist(given.jobs)
    print(f"{laps} laps in {(time.monotonic() - started_s) / 60:.1f} minutes", file=sys.stderr)


def _driving(jobs: int) -> int:
    """Write the tables and plots of all courses without assist; return the number of laps."""
    usual = [Cell(course, of) for course in COURSES for of in DRIVEN]
    usual.append(Cell("slalom", "signs_per_second"))
    varied = {
        factor: [Cell("slalom", of, with_factor(Conditions(), factor, value)) for of in interfaces for value in values]
        for factor, (interfaces, values) in SWEEPS.items()
    }
    pictures = [Cell("slalom", of, Conditions(through="pictures")) for of in BY_HAND]
    cells = list(dict.fromkeys([*usual, *(cell for row in varied.values() for cell in row)]))
    laps = len(cells) * len(SEEDS) + len(pictures) * len(SEEDS_PICTURES)
    with tqdm(total=laps, unit="lap", disable=None) as bar:
        results = {each.cell: each for each in run_cells(cells, SEEDS, jobs=jobs, progress=bar.update)}
        seen = run_cells(pictures, SEEDS_PICTURES, jobs=jobs, progress=bar.update)
    text = "\n\n".join(
        [
            _courses(),
            *(_course(course, [results[cell] for cell in usual if cell.course == course]) for course in COURSES),
            _goals(results),
            *(_sweep(factor, [results[cell] for cell in row]) for factor, row in varied.items()),
            _pictures(seen, results),
        ]
    )
    _write("driving", text)
    PICTURES.mkdir(parents=True, exist_ok=True)
    for course in COURSES:
        write_plots([results[cell] for cell in usual if cell.course == course], (), PICTURES)
    for factor, row in varied.items():
        write_plots([results[cell] for cell in row], [(factor, ())], PICTURES)
    return laps


def _write(name: str, text: str) -> None:
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), name, text), encoding="utf-8")


def _assist(jobs: int) -> int:
    """Write the tables of what an assist changes; return the number of laps."""

    def rows_of(course: str, conditions: Conditions, assists: Sequence[str]) -> list[list[Cell]]:
        return [[Cell(course, of, replace(conditions, assist=each)) for each in assists] for of in ASSISTED[course]]

    usual, late, bad = Conditions(), Conditions(latency_s=LATE_S), worse(Conditions())
    ends = (ASSISTS[0], ASSISTS[-1])
    parts: dict[str, tuple[Sequence[str], list[list[Cell]]]]
    parts = {f"`{course}`": (ASSISTS, rows_of(course, usual, ASSISTS)) for course in ASSISTED}
    parts[f"`maze`, {LATE_S * 1000:.0f} ms of latency"] = ends, rows_of("maze", late, ends)
    parts["`maze`, a worse operator"] = ends, rows_of("maze", bad, ends)
    cells = list(dict.fromkeys(cell for _, rows in parts.values() for row in rows for cell in row))
    with tqdm(total=len(cells) * len(SEEDS), unit="lap", disable=None) as bar:
        results = {each.cell: each for each in run_cells(cells, SEEDS, jobs=jobs, progress=bar.update)}
    text = []
    for title, (assists, rows) in parts.items():
        head = [name for each in assists for name in (f"{each}, s", "bumps a lap")]
        shown = []
        for row in rows:
            figures = []
            for cell in row:
                result = results[cell]
                over = f"; {result.timed_out} timed out" if result.timed_out else ""
                figures += [_text(result.median("time_s"), 1) + over, _text(result.mean("bumps"), 2)]
            shown.append([f"`{row[0].interface}`", *figures])
        text.append(f"### {title}\n\n" + table(["interface", *head], shown))
    _write("assist", "\n\n".join(text))
    return len(cells) * len(SEEDS)


def _courses() -> str:
    rows = []
    for name in COURSES:
        course = open_course(name)
        stop = "stops" if course.world.stop else "drives through the finish"
        rows.append([f"`{name}`", f"{course.length_m:.1f} m", str(len(course.gates)), f"{course.difficulty:.1f}", stop])
    return table(["course", "ideal path", "gates", "index of difficulty", "at the end"], rows)


def _course(name: str, results: Sequence[CellResult]) -> str:
    over = open_course(name).world.stop is not None
    head = ["interface", "time, s", "timed out", "gates missed a lap", "bumps a lap", "path", "off the path, cm"]
    head += ["overshoot, cm"] if over else []
    rows = []
    for each in results:
        row = [f"`{each.cell.interface}`", _text(each.median("time_s"), 1), str(each.timed_out or "")]
        row += [_text(each.mean("missed"), 2), _text(each.mean("bumps"), 2), _text(each.median("path_ratio"), 2)]
        row += [_text(each.median("cross_track_m"), 1, 100)]
        row += [_text(each.median("overshoot_m"), 1, 100)] if over else []
        rows.append([*row, _text(each.median("commands_per_min"), 0), _text(each.median("standing"), 0, 100)])
    pictures = [f"![{text} on {name}](pictures/driving/{name}-{what}.png)" for what, text in PLOTS.items()]
    return "\n\n".join([f"### {name}", *pictures]) + "\n\n" + table([*head, "acts a minute", "stands, %"], rows)


def _goals(results: dict[Cell, CellResult]) -> str:
    def times(interface: str, latency_ms: float = 0.0, course: str = "slalom") -> list[float]:
        return results[Cell(course, interface, with_factor(Conditions(), "latency", latency_ms))].values("time_s")

    def bumps(interface: str) -> str:
        return _text(results[Cell("slalom", interface)].mean("bumps"), 2)

    rows = [
        ["slalom: time of the joystick / pad", _ratio(times("joystick"), times("pad")), "1.25"],
        ["slalom: bumps a lap of the joystick; of the pad", f"{bumps('joystick')}; {bumps('pad')}", "no more"],
        ["slalom: time of point / pad", _ratio(times("point"), times("pad")), "1.4"],
        ["slalom: bumps a lap of point; of the pad", f"{bumps('point')}; {bumps('pad')}", "0.2 more"],
        [
            "figure-eight: time of point / pad",
            _ratio(times("point", course="figure-eight"), times("pad", course="figure-eight")),
            "1.5",
        ],
    ]
    for interface in ("joystick", "pad"):
        lost = _ratio(times(interface, 250.0), times(interface))
        rows.append([f"slalom: time of the {interface} with 250 ms of latency / without", lost, ""])
    over = [results[Cell("stop-line", of)].median("overshoot_m") for of in ("joystick", "point", "pad")]
    rows.append(
        [
            "stop-line: overshoot of the joystick; of point; of the pad, cm",
            "; ".join(_text(each, 1, 100) for each in over),
            "1.25 times; 1.5 times",
        ]
    )
    return "### The goals\n\n" + table(["measure", "median and 95 % interval", "at most"], rows)


def _sweep(factor: str, results: Sequence[CellResult]) -> str:
    interfaces, values = SWEEPS[factor]
    titles = {
        "latency": "Added latency, ms",
        "fps": "Frames a second",
        "errors": "Errors of landmarks and operator, times the usual",
        "reaction": "Reaction time, ms",
    }
    rows = [
        [
            f"`{interface}`",
            *(_text(each.median("time_s"), 1) for each in results if each.cell.interface == interface),
            *(f"{each.mean('bumps').value:.2f}" for each in results if each.cell.interface == interface),
        ]
        for interface in interfaces
    ]
    head = ["time on the slalom, s", *(f"{value:g}" for value in values), *(f"bumps at {value:g}" for value in values)]
    plot = f"![{titles[factor]}](pictures/driving/slalom-{factor}.png)"
    return f"### {titles[factor]}\n\n{plot}\n\n" + table(head, rows)


def _pictures(seen: Iterable[CellResult], results: dict[Cell, CellResult]) -> str:
    rows = []
    for each in seen:
        count = len(each.laps)
        same = results[Cell("slalom", each.cell.interface)].values("time_s")[:count]
        ratio = _ratio(each.values("time_s"), same)
        rows.append(
            [
                f"`{each.cell.interface}`",
                str(count),
                _text(each.median("time_s"), 1),
                _text(Estimate.of(same), 1),
                ratio,
            ]
        )
    head = ["slalom", "laps", "through pictures, s", "through landmarks, same seeds, s", "ratio"]
    return "### Through pictures and through landmarks\n\n" + table(head, rows)


def _ratio(values: Sequence[float], others: Sequence[float]) -> str:
    return _text(Estimate.of_ratio(values, others), 2)


def _text(found: Estimate | None, digits: int, factor: float = 1.0) -> str:
    if found is None:
        return ""
    value, low, high = (f"{factor * each:.{digits}f}" for each in (found.value, found.low, found.high))
    return value if low == high else f"{value} ({low} to {high})"


if __name__ == "__main__":
    main()
