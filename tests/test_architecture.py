"""What docs/architecture.md says of the code's files is so."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "handsteer"
TEXT = (ROOT / "docs" / "architecture.md").read_text()
LINE = re.compile(r"^\| `([\w/.]+)` \| (\d+) \|", re.MULTILINE)


@pytest.mark.parametrize(
    ("begin", "end", "most"), [("way of a frame,", "way of a steering", 10), ("way of a steering", "## Th", 7)]
)
def test_the_ways_of_a_frame_and_of_a_command_are_as_short_as_shown(begin: str, end: str, most: int) -> None:
    rows = LINE.findall(TEXT[TEXT.index(begin) : TEXT.index(end, TEXT.index(begin) + 1)])
    assert 5 < len(rows) <= most
    for name, lines in rows:
        count = len((SOURCE / name).read_text().splitlines())
        assert count == pytest.approx(int(lines), rel=0.1), f"{name} has {count} lines"


def test_the_layers_shown_are_those_that_the_linter_keeps() -> None:
    shown = re.search(r"```\n(cli .*?)```", TEXT, re.DOTALL)
    kept = re.search(r"^layers = \[\n(.*?)^\]", (ROOT / "pyproject.toml").read_text(), re.DOTALL | re.MULTILINE)
    assert shown
    assert kept
    layers = [set(line.split("   ")[0].split()) for line in shown[1].splitlines()]
    assert layers == [set(re.findall(r"\w+", line)) for line in kept[1].splitlines()]


def test_every_package_is_described() -> None:
    packages = {folder.name for folder in SOURCE.iterdir() if (folder / "__init__.py").is_file()}
    assert {name for name in packages if f"- **{name}**" not in TEXT} <= {"cli", "config", "doctor", "hand"}
