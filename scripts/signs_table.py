"""Writes the tables of docs/signs.md from ``benchmarks/signs_table.json``; ``--check`` only compares them."""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from scripts.doc_tables import replaced, table

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.types import GO, SIGNS

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "benchmarks" / "signs_table.json"
PAGE = ROOT / "docs" / "signs.md"

PARTS: Final = {"report": "report", "choose": "measured and chosen on", "tune": "tuning"}
PEOPLE: Final = {
    "hagrid": "HaGRID, a person each",
    "sld": "`sld`, students",
    "arjav": "one man",
    "sara": "one person",
    "emre": "the three people of `emre`",
}
SIDES: Final = {"-": "", "palm": "palm", "back": "back", "thumb_out": "thumb out"}
TILTS: Final = ("tilted by 15°", "tilted by 30°")
VIEWS: Final = ("raw", "mirrored", *TILTS, "grey")
THUMBS: Final = ("thumb_up", "thumb_down", "like", "dislike")
HANDS: Final = ("right hand", "left hand")


class Row(NamedTuple):
    """A row of the committed table: what ``benchmarks/_sign_table.py`` describes, and its counts."""

    part: str
    people: str
    shown: str
    kind: str
    view: str
    right: int
    of: int
    moved: int


Rows = Sequence[Row]
Wanted = Callable[[Row], bool]


def main() -> None:
    counts = json.loads(TABLE.read_text(encoding="utf-8"))["rows"]
    rows = [Row(*name.split(" / "), *numbers) for name, numbers in counts.items()]
    parts = {
        "Signs of people": _signs(rows),
        "Pictures without a motion sign that move the robot": _false(rows),
        "Not a person's sign: thumbs up and down turned by 90°": _turned(rows),
        "Not a person's hand: rendered": _rendered(rows),
    }
    text = "\n\n".join(f"### {title}\n\n{part}" for title, part in parts.items())
    old = PAGE.read_text(encoding="utf-8")
    new = replaced(old, "signs", text)
    if "--check" in sys.argv:
        sys.exit(0 if old == new else f"{PAGE.name} is not up to date: run python -m scripts.signs_table")
    PAGE.write_text(new, encoding="utf-8")


def _signs(rows: Rows) -> str:
    """Return the table of the photos of people who show a sign."""
    lines = []
    for part, people in _sets():
        shown = [row for row in rows if (row.part, row.people) == (part, people) and row.shown in SIGNS]
        for sign in SIGNS:
            for kind in SIDES:
                of_sign = [row for row in shown if (row.shown, row.kind) == (sign, kind)]
                cells = [_share(_of_view(of_sign, view), "right") for view in VIEWS]
                if any(cells):
                    raw = _of_view(of_sign, "raw")
                    lines.append(
                        [PARTS[part], PEOPLE[people], sign, SIDES[kind], *cells, str(sum(r.moved for r in raw))]
                    )
    return table(["part", "people", "sign", "side", "right, %: raw", *VIEWS[1:], "gave another motion sign"], lines)


def _false(rows: Rows) -> str:
    """Return the table of hands and pictures that must not move the robot."""
    groups: dict[str, Wanted] = {
        "no sign": lambda row: row.shown == "no sign",
        "of these, thumbs up and down": lambda row: row.shown == "no sign" and row.kind in THUMBS,
        "fists": lambda row: row.shown == GO,
        "hands at rest": lambda row: row.shown == "hand at rest",
    }
    lines = []
    for part, people in _sets():
        for name, wanted in groups.items():
            group = [row for row in rows if (row.part, row.people) == (part, people) and wanted(row)]
            cells = [_share(_found(_of_view(group, view)), "moved") for view in VIEWS]
            if any(cells):
                lines.append([PARTS[part], PEOPLE[people], name, *cells])
    return table(["part", "people", "shown", "robot moves, %: raw", *VIEWS[1:]], lines)


def _found(rows: Rows) -> Rows:
    """Return ``rows``; of hands at rest, only those that were found count."""
    return [row._replace(of=row.right + row.moved) if row.shown == "hand at rest" else row for row in rows]


def _turned(rows: Rows) -> str:
    lines = []
    for part, people in _sets():
        group = [row for row in rows if (row.part, row.people, row.shown) == (part, people, "turned thumb")]
        if group:
            lines.append([PARTS[part], PEOPLE[people], _share(group, "right"), _share(group, "moved")])
    return table(["part", "people", "read as a turn to that side, %", "as another motion sign, %"], lines)


def _rendered(rows: Rows) -> str:
    drawn = [row for row in rows if row.part == "rendered"]
    lines = []
    for sign in SIGNS:
        of_sign = [row for row in drawn if row.shown == sign]
        sides = dict.fromkeys(
            row.kind.replace(f", {hand}", "") for hand in HANDS for row in of_sign if hand in row.kind
        )
        for side in sides:
            cells = []
            for hand in HANDS:
                group = [row for row in of_sign if hand in row.kind and row.kind.replace(f", {hand}", "") == side]
                cells += [_share(group, "right"), str(sum(row.moved for row in group)) if group else ""]
            lines.append([sign, side, *cells])
    head = [cell for hand in HANDS for cell in (f"{hand}: right, %", "gave another motion sign")]
    return table(["sign", "side", *head], lines)


def _sets() -> Iterator[tuple[str, str]]:
    yield from ((part, people) for part in PARTS for people in PEOPLE)


def _of_view(rows: Rows, view: str) -> Rows:
    return [row for row in rows if row.view == view]


def _share(rows: Rows, what: str) -> str:
    """Return the share of ``right`` or ``moved`` in percent with its interval and number; empty without pictures."""
    share = Share(sum(getattr(row, what) for row in rows), sum(row.of for row in rows))
    if share.rate is None or share.interval is None:
        return ""
    low, high = (_percent(side) for side in share.interval)
    return f"{_percent(share.rate)} ({low} to {high}) of {share.of:,}"


def _percent(share: float) -> str:
    return f"{100 * share:.2f}" if 0 < share < 0.01 else f"{100 * share:.1f}"


if __name__ == "__main__":
    main()
