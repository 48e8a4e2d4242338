"""README and the documentation, in the parts that tests run: blocks, words in code, words in italics, links."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]

_BLOCK = re.compile(r"^(?P<indent> *)```(?P<language>\S*)\n(?P<text>.*?)^(?P=indent)```$", re.DOTALL | re.MULTILINE)
_GENERATED = re.compile(r"<!-- (faults \w+|signs) -->.*?<!-- end of \1 -->", re.DOTALL)
_CODE = re.compile(r"(?<!`)`([^`]+)`(?!`)")
_ITALICS = re.compile(r"(?<![*\w])\*(?![*\s])([^*]+)\*(?!\*)")


@dataclass(frozen=True)
class Part:
    """A block, a word in code or in italics, or the target of a link: where it is, and its text."""

    page: Path
    line: int
    text: str

    def __str__(self) -> str:
        """Return it as the name of a test."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


@cache
def text_of(page: Path) -> str:
    """Return the text of a page."""
    return page.read_text(encoding="utf-8")


def blocks(*languages: str) -> list[Part]:
    """Return the blocks in these languages of all pages, without their indentation; the name of none is empty."""
    return [
        Part(page, _line(text_of(page), found.start()), re.sub(f"^{found['indent']}", "", found["text"], flags=re.M))
        for page in PAGES
        for found in _BLOCK.finditer(text_of(page))
        if found["language"] in languages
    ]


def prose(page: Path) -> str:
    """Return the text of a page with empty lines instead of blocks and generated tables."""
    without = _BLOCK.sub(_blank, text_of(page))
    return _GENERATED.sub(_blank, without)


def code(*pages: Path) -> list[Part]:
    """Return the words in code of ``pages``, by default all, each on one line."""
    return [*_found(_CODE, pages or PAGES)]


def italics(*pages: Path) -> list[Part]:
    """Return the words in italics of ``pages``, each on one line."""
    return [*_found(_ITALICS, pages)]


def commands() -> list[Part]:
    """Return each command of handsteer: in blocks, where a line may continue in the next, and in running text."""
    found = [part for part in code() if part.text.startswith("handsteer ")]
    for block in blocks("sh", "", "ini"):
        joined = block.text.replace("\\\n", " ")
        lines = re.findall(r"^(?:\$ |ExecStart=)?(?:\S*/bin/)?(handsteer (?!\|)[^\n#>]*)", joined, re.MULTILINE)
        found += [Part(block.page, block.line, " ".join(command.split())) for command in lines]
    return found


def _found(pattern: re.Pattern[str], pages: tuple[Path, ...] | list[Path]) -> Iterator[Part]:
    for page in pages:
        text = prose(page)
        for found in pattern.finditer(text):
            yield Part(page, _line(text, found.start()), " ".join(found[1].split()))


def _blank(part: re.Match[str]) -> str:
    return "\n" * part[0].count("\n")


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def table(page: Path, head: str) -> list[list[str]]:
    """Return the rows below the head ``| head |`` of a table, each as its cells without backticks."""
    found = re.search(rf"^ *\| ?{re.escape(head)} ?\|\n *\|[-| ]+\|\n((?: *\|.*\n)+)", text_of(page), re.MULTILINE)
    assert found, head
    return [[cell.strip() for cell in row.strip().strip("|").split(" | ")] for row in found[1].splitlines()]


def words(text: str) -> list[str]:
    """Return the words in code in ``text``."""
    return _CODE.findall(text)
