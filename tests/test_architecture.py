"""What docs/architecture.md says of the code's files is so."""

import ast
import re
from pathlib import Path

import pytest
from scripts.ways import way_of_a_frame, way_of_steering

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "handsteer"
SETTINGS = (ROOT / "pyproject.toml").read_text()
TEXT = (ROOT / "docs" / "architecture.md").read_text()
LINE = re.compile(r"^\| `([\w/.]+)` \| (\d+) \|", re.MULTILINE)


@pytest.mark.parametrize(
    ("begin", "end", "most"), [("ones of a frame:", "way of a steering", 11), ("way of a steering", "## Th", 7)]
)
def test_the_ways_of_a_frame_and_of_a_command_are_as_short_as_shown(begin: str, end: str, most: int) -> None:
    rows = LINE.findall(TEXT[TEXT.index(begin) : TEXT.index(end, TEXT.index(begin) + 1)])
    assert 5 < len(rows) <= most
    for name, lines in rows:
        count = len((SOURCE / name).read_text().splitlines())
        assert count == pytest.approx(int(lines), rel=0.1), f"{name} has {count} lines"


def test_the_layers_shown_are_those_that_the_linter_keeps() -> None:
    shown = re.search(r"```\n(plugins .*?)```", TEXT, re.DOTALL)
    kept = re.search(r"^layers = \[\n(.*?)^\]", SETTINGS, re.DOTALL | re.MULTILINE)
    assert shown
    assert kept
    layers = [set(re.split(r"\s{3,}", line)[0].split()) for line in shown[1].splitlines()]
    assert layers == [set(re.findall(r"\w+", line)) for line in kept[1].splitlines()]


def test_the_imports_of_plug_ins_shown_are_those_that_the_linter_accepts() -> None:
    accepted = set(re.findall(r"handsteer\.plugins\.(\w+)[\w.*]* -> handsteer\.plugins\.(\w+)", SETTINGS))
    table = TEXT[TEXT.index("| plug-in |") :].partition("\n\n")[0]
    shown = {
        (name, other)
        for names, others in re.findall(r"^\| (`[^|]*`) \|[^|\n]*\|(.*)\|$", table, re.MULTILINE)
        for name in re.findall(r"`(\w+)`", names)
        for other in re.findall(r"`(\w+)`", others)
    }
    assert shown == accepted


def test_every_plug_in_is_shown_and_says_what_it_imports() -> None:
    folders = [folder for folder in (SOURCE / "plugins").iterdir() if (folder / "__init__.py").is_file()]
    assert len(folders) > 5
    for folder in folders:
        text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text())) or ""
        assert re.search(r"\b[Ii]mports\b", text), f"{folder.name} does not say what it imports"
        assert re.search(rf"^\| .*`{folder.name}`.* \|", TEXT, re.MULTILINE), f"{folder.name} is not shown"


@pytest.mark.slow
def test_the_files_on_both_ways_are_as_many_as_said() -> None:
    said = re.search(r"a frame passes (\d+) files of the kernel, and a steering command (\d+)", TEXT)
    assert said
    assert way_of_a_frame().typical == pytest.approx(int(said[1]), abs=1)
    assert way_of_steering().typical == pytest.approx(int(said[2]), abs=1)
