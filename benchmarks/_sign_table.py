"""The table of ``benchmarks/signs.py``: counts by row, its file, and what of it a change made worse or better."""

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Literal, NamedTuple

TABLE = Path(__file__).with_name("signs_table.json")

LOST = 0.01
"""A row is worse if more than this share of its pictures is no longer right."""
MOVED = 0.001
"""Or if more than this share of its pictures newly moves the robot by mistake."""
LEAST, LEAST_OF_SAMPLE = 1, 2
"""So many pictures of a row may always be lost, or move the robot: one picture of few is more than a point.

Rows of the sample may lose one more, because recognition differs between processors in the last digits.
"""

_ALL = "all"
_NO_KIND = "-"
_BETWEEN = " / "

Verdict = Literal["worse", "better", "same", "other pictures", "not in the table", "not measured"]


class Row(NamedTuple):
    """A row of the table.

    Attributes:
        part: ``report``, ``tune`` or ``choose`` (``fit.part_of``), ``rendered``, or ``all`` in a sum over parts.
        people: The set of people; ``all`` in a sum.
        shown: The sign that is shown in the view, ``no sign``, or what is shown instead of a sign.
        kind: The side of the hand, or the kind of a hand without a sign; ``-`` if unknown.
        view: ``raw``, or how the picture was changed.
    """

    part: str
    people: str
    shown: str
    kind: str
    view: str

    @classmethod
    def parse(cls, name: str) -> "Row":
        """Return the row of that name."""
        return cls(*name.split(_BETWEEN))

    @property
    def name(self) -> str:
        """Its name in the file and in messages."""
        return _BETWEEN.join(self)


def row_of(part: str, people: str, shown: str, kind: str, view: str) -> Row:
    """Return a row; an empty ``kind`` is unknown."""
    return Row(part, people, shown, kind or _NO_KIND, view)


class Counts(NamedTuple):
    """How many pictures of a row were right, of all, and how many gave a sign that moves the robot but is not shown."""

    right: int = 0
    of: int = 0
    moved: int = 0

    def plus(self, other: "Counts") -> "Counts":
        """Return the sum."""
        return Counts(self.right + other.right, self.of + other.of, self.moved + other.moved)


Rows = Mapping[Row, Counts]


@dataclass(frozen=True)
class Table:
    """What is committed: all rows, the rows of the sample, and a digest of the photos' names and labels."""

    photos: str
    rows: Rows
    sample: Rows

    def write(self, path: Path = TABLE) -> None:
        """Write the table to ``path``, a row per line."""
        parts = {"photos": json.dumps(self.photos)}
        for name, rows in (("rows", self.rows), ("sample", self.sample)):
            lines = (f"    {json.dumps(row.name)}: {json.dumps(rows[row])}" for row in sorted(rows))
            parts[name] = "{\n" + ",\n".join(lines) + "\n  }"
        text = ",\n".join(f"  {json.dumps(name)}: {value}" for name, value in parts.items())
        path.write_text("{\n" + text + "\n}\n", encoding="utf-8")


def read_table(path: Path = TABLE) -> Table:
    """Return the table in ``path``; an empty one if there is no such file."""
    if not path.is_file():
        return Table("", {}, {})
    content = json.loads(path.read_text(encoding="utf-8"))
    rows, sample = (
        {Row.parse(name): Counts(*counts) for name, counts in content[part].items()} for part in ("rows", "sample")
    )
    return Table(content["photos"], rows, sample)


@dataclass(frozen=True)
class Change:
    """A row before and now; None where it is absent."""

    row: Row
    before: Counts | None
    now: Counts | None
    verdict: Verdict


def compare(before: Rows, now: Rows, *, least: int = LEAST) -> list[Change]:
    """Return each row of both, and the sums over parts and people, with a verdict.

    A row is *worse* if it lost more than :data:`LOST` of its pictures and more than ``least`` of them, or if more than
    :data:`MOVED` of them and more than ``least`` newly move the robot by mistake. Many rows that lose one picture each
    are found by their sum. A row is *better* if it gained anything and lost nothing.
    """
    before, now = {**before, **sums(before)}, {**now, **sums(now)}
    rows = sorted({*before, *now}, key=lambda row: (row.part == _ALL, row))
    pairs = [(row, before.get(row), now.get(row)) for row in rows]
    return [Change(row, old, new, _verdict(old, new, least)) for row, old, new in pairs]


def sums(rows: Rows) -> dict[Row, Counts]:
    """Return the sums of ``rows`` that show the same in the same view, where they are several."""
    members = defaultdict(list)
    for row, counts in rows.items():
        members[Row(_ALL, _ALL, row.shown, _NO_KIND, row.view)].append(counts)
    return {row: reduce(Counts.plus, counts) for row, counts in members.items() if len(counts) > 1}


def failures(changes: list[Change]) -> Iterator[str]:
    """Yield a line for each row that must not be accepted: worse, not measured, or of other pictures."""
    yield from (_line(change) for change in changes if change.verdict in ("worse", "not measured", "other pictures"))


def news(changes: list[Change]) -> Iterator[str]:
    """Yield a line for each row for which the table should be updated: better, or not in it yet."""
    yield from (_line(change) for change in changes if change.verdict in ("better", "not in the table"))


def _line(change: Change) -> str:
    before, now = change.before or Counts(), change.now or Counts()
    counts = f"right {_cell(before)} -> {_cell(now)}; moved by mistake {before.moved} -> {now.moved}"
    return f"{change.verdict}: {change.row.name}: {counts}"


def _cell(counts: Counts) -> str:
    share = f" ({100 * counts.right / counts.of:.1f} %)" if counts.of else ""
    return f"{counts.right} of {counts.of}{share}"


def _verdict(before: Counts | None, now: Counts | None, least: int) -> Verdict:
    if before is None or now is None:
        return "not in the table" if before is None else "not measured"
    if before.of != now.of:
        return "other pictures"
    lost, moved = before.right - now.right, now.moved - before.moved
    if lost > max(least, LOST * now.of) or moved > max(least, MOVED * now.of):
        return "worse"
    return "better" if lost <= 0 and moved <= 0 and (lost, moved) != (0, 0) else "same"
