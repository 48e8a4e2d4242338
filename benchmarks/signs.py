"""Recognition of signs on photos of people who show them, compared with the committed table.

``make bench-signs`` measures every row again and prints it as it was and as it is; it exits with 1 and names each row
that became worse (``_sign_table.py`` has the rule), or that cannot be compared. ``make bench-signs ARGS=--update``
writes ``signs_table.json``, and the tables of docs/signs.md from it. ``--sample`` measures a fixed sample only, as the
tests do. The photos are not part of the repository; docs/signs.md describes them.
"""

import argparse
import json
import multiprocessing
import os
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path

import cv2
from _sign_photos import FOLDERS, Eyes, Look, Seen, digest, photo_looks, read_photos
from _sign_renders import rendered_looks
from _sign_table import LEAST, LEAST_OF_SAMPLE, TABLE, Change, Counts, Row, Table, compare, failures, news, read_table
from tqdm import tqdm

from handsteer.plugins.teach.evaluation.intervals import Share

DATA = Path(__file__).parents[2] / "shared" / "data"
_CHUNK = 16


def main(arguments: Sequence[str] | None = None, eyes: Eyes | None = None) -> None:
    """Run the command.

    Args:
        arguments: Those of the command line if None.
        eyes: The recognition to measure, with ``--jobs 1`` only; the default one if None.

    Raises:
        SystemExit: A row is worse than the table, or cannot be compared; with a line for each.
    """
    options = _options(arguments)
    missing = [folder for folder in FOLDERS if not (options.data / folder).is_dir()]
    if missing:
        raise SystemExit(f"{options.data} lacks {', '.join(missing)}; set another folder with --data")
    photos, wanted = read_photos(options.data), options.only.casefold()
    looks: list[Look] = [
        look for look in (*photo_looks(photos), *rendered_looks()) if wanted in look.row.name.casefold()
    ]
    if options.sample:
        looks = sample_of(looks)
    if not looks:
        raise SystemExit(f"no row's name contains {options.only!r}; benchmarks/{TABLE.name} has the names")
    seen = measure(looks, jobs=options.jobs, eyes=eyes)
    if options.mistakes:
        print("\n".join(each.line for each in seen if not each.right))
    table = read_table()
    known = table.sample if options.sample else table.rows
    before = {row: counts for row, counts in known.items() if wanted in row.name.casefold()}
    now = count(looks, seen)
    changes = compare(before, now, least=LEAST_OF_SAMPLE if options.sample else LEAST)
    print("\n".join(lines_of(changes)))
    if options.json:
        options.json.write_text(json.dumps([_plain(change) for change in changes], indent=1), encoding="utf-8")
    if options.update:
        sampled = [each for look, each in zip(looks, seen, strict=True) if look.in_sample]
        Table(digest(photos), now, count(sample_of(looks), sampled)).write()
        return
    found = list(failures(changes))
    if table.photos != digest(photos):
        found.append(f"the photos in {options.data} are not those of the table")
    _end(changes, found)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Measure the signs on photos of people.")
    parser.add_argument("--data", type=Path, default=DATA, help=f"folder that contains {', '.join(FOLDERS)}")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="number of processes")
    parser.add_argument("--only", default="", metavar="TEXT", help="only rows whose names contain this")
    parser.add_argument("--sample", action="store_true", help="only the fixed sample, in about a minute")
    parser.add_argument("--update", action="store_true", help="write the table instead of comparing with it")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write all rows, before and now, to a file")
    parser.add_argument("--mistakes", action="store_true", help="also list each wrongly recognised picture")
    options = parser.parse_args(arguments)
    if options.update and (options.only or options.sample):
        parser.error("--update needs all rows: leave out --only and --sample")
    return options


def measure(looks: Sequence[Look], *, jobs: int = 1, eyes: Eyes | None = None) -> list[Seen]:
    """Return what is recognised in each of ``looks``.

    Args:
        looks: The pictures.
        jobs: Number of processes; the results do not depend on it.
        eyes: The recognition, for one process only; the default one if None.
    """
    if jobs == 1:
        eyes = eyes or _eyes()
        return [look.take(eyes) for look in tqdm(looks, unit="picture", disable=None)]
    # Not forked: the landmark models' threads would be missing in the children.
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        results = pool.map(_take, looks, chunksize=_CHUNK)
        return list(tqdm(results, total=len(looks), unit="picture", disable=None))


@cache
def _eyes() -> Eyes:
    cv2.setNumThreads(1)
    return Eyes.open()


def _take(look: Look) -> Seen:
    return look.take(_eyes())


def sample_of(looks: Sequence[Look]) -> list[Look]:
    """Return those of the sample."""
    return [look for look in looks if look.in_sample]


def count(looks: Sequence[Look], seen: Sequence[Seen]) -> dict[Row, Counts]:
    """Return the counts of each row."""
    rows: dict[Row, Counts] = defaultdict(Counts)
    for look, each in zip(looks, seen, strict=True):
        rows[look.row] = rows[look.row].plus(Counts(int(each.right), 1, int(each.moved)))
    return dict(rows)


def lines_of(changes: Sequence[Change]) -> Iterator[str]:
    """Yield the table: each row before and now."""
    width = max((len(change.row.name) for change in changes), default=0)
    yield f"{'':{width}}  {'right, %: before':>16} | {'now':22}  moved by mistake: before | now"
    for change in changes:
        before, now = change.before or Counts(), change.now or Counts()
        cells = f"{_percent(before):>16} | {_with_interval(now):22}  {before.moved:24} | {now.moved:3}"
        verdict = "" if change.verdict == "same" else f"  {change.verdict}"
        yield f"{change.row.name:{width}}  {cells}{verdict}"


def _percent(counts: Counts) -> str:
    return f"{100 * counts.right / counts.of:.1f}" if counts.of else "-"


def _with_interval(counts: Counts) -> str:
    interval = Share(counts.right, counts.of).interval
    if interval is None:
        return "-"
    return f"{_percent(counts)} ({100 * interval[0]:.1f}-{100 * interval[1]:.1f}) of {counts.of}"


def _plain(change: Change) -> dict[str, object]:
    sides = {name: counts and counts._asdict() for name, counts in (("before", change.before), ("now", change.now))}
    return {**change.row._asdict(), **sides, "verdict": change.verdict}


def _end(changes: list[Change], found: Sequence[str]) -> None:
    """Print the rows that are better or new; exit with 1 and a line for each that must not be accepted."""
    better = list(news(changes))
    if better:
        print("\n".join([*better, "update the table: make bench-signs ARGS=--update"]))
    if found:
        raise SystemExit("\n".join(found))
    print("no row is worse than the committed table")


if __name__ == "__main__":
    main()
