"""The tables of faults in docs/faults.md: written here, and read again by the tests."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from tests.faults.stepped import Outcome

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "faults.md"
LIMIT_S = 0.5
"""Of every row: from the end of the reason to drive to the last moment at which the robot was asked to move."""

_HEAD = (
    "where",
    "what happens",
    "stop commanded after [s]",
    "moves before neutral was seen",
    "reported during the fault",
)


def render(outcomes: Iterable[Outcome]) -> str:
    """Return the rows as a table of Markdown."""
    lines = [_line(_HEAD), _line(["---"] * len(_HEAD))]
    lines += [_line(cells(outcome)) for outcome in outcomes]
    return "\n".join(lines) + "\n"


def cells(outcome: Outcome) -> tuple[str, ...]:
    """Return what stands in the row of ``outcome``; times are rounded to a twentieth of a second, upwards."""
    twentieths = -(-round((outcome.zero_s or 0.0) * 1000) // 50)
    return (
        f"`{outcome.where}`" if outcome.where.startswith("/") else outcome.where,
        outcome.fault,
        "-" if outcome.zero_s is None else f"{twentieths / 20:.2f}",
        "yes" if outcome.moves_again else "no",
        outcome.said,
    )


def written(part: str) -> list[tuple[str, ...]]:
    """Return the rows of a part of the document, as :func:`cells` gives them."""
    text = DOCUMENT.read_text(encoding="utf-8")
    lines = text[slice(*_place(text, part))].strip().splitlines()[2:]
    return [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines]


def write(part: str, outcomes: Sequence[Outcome]) -> None:
    """Put the rows into their part of the document, in place of those before."""
    text = DOCUMENT.read_text(encoding="utf-8")
    start, end = _place(text, part)
    DOCUMENT.write_text(f"{text[:start]}\n{render(outcomes)}{text[end:]}", encoding="utf-8")


def _place(text: str, part: str) -> tuple[int, int]:
    found = re.search(rf"<!-- faults {part} -->\n(.*?)<!-- end of faults {part} -->", text, re.DOTALL)
    assert found, f"{DOCUMENT} has no place for the faults {part}"
    return found.span(1)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
