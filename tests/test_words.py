"""Documentation and help texts are in plain technical English: words that were removed from them do not return."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").glob("*.md")),
]
SOURCES = [
    ROOT / "Makefile",
    ROOT / "pyproject.toml",
    ROOT / ".ci" / "run",
    *sorted(
        path
        for folder in ("src", "examples", "ros", "scripts")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {"", ".py", ".launch", ".md", ".sh", ".toml", ".xml", ".yaml"} and path.is_file()
    ),
]

BETTER = {
    "amiss": "wrong",
    "anew": "again",
    "aslant": "tilted",
    "bark": "expire",
    "barks": "expires",
    "beside": "next to, in addition to, compared with",
    "by itself": "automatically, alone",
    "by themselves": "automatically, alone",
    "for ever": "forever, repeatedly",
    "for want of": "without",
    "goes before": "overrides, precedes",
    "go before": "override, precede",
    "hands are told": "hands are recognised",
    "held up": "stalled, delayed",
    "hold up": "stall, delay",
    "holds up": "stalls, delays",
    "if you like": "optionally",
    "x is no y": "x is not a valid y, x is not a y",
    "in step": "synchronised",
    "in the place of": "instead of",
    "in words of": "as",
    "lets go": "releases",
    "let go": "release",
    "looking on": "observing",
    "looks on": "observes",
    "mends": "fixes",
    "newcomers": "new nodes, new viewers",
    "nobody": "no person, no node, no viewer",
    "nobody's word": "the condition itself",
    "onlooker": "observer",
    "own accord": "automatically",
    "said once": "published once",
    "says so": "reports it",
    "say so": "report it",
    "signs are told": "signs are recognised",
    "so wished": "configured, requested",
    "somebody": "another viewer, a node",
    "takes its leave": "leaves",
    "takes leave": "leaves",
    "the same again": "repeated",
    "the same wish": "the same command",
    "told apart": "distinguished",
    "told as": "recognised as",
    "told badly": "recognised poorly",
    "told to stand": "stopped",
    "are told on": "are published on",
    "unless said": "by default",
    "unless told": "by default",
    "what becomes of": "the effect on",
    "what there is": "what exists",
    "what there is to know": "what you need to know",
    "who drives": "the driver, the active input",
    "whoever": "anyone who, the node that",
    "without a word": "without a message, by default",
    "worked out": "computed",
    "works out": "computes",
}
"""Unwanted words and phrases, in lower case, and what to write instead."""

_UNWANTED = re.compile(
    r"\b(?:" + "|".join(re.escape(word).replace(r"\ ", r"\s+") for word in BETTER) + r")\b", re.IGNORECASE
)
_IS_NO = re.compile(r"(?<!there )\b(?:is|was|are)\s+no\s+(?!longer\b|more\b|other\b|such\b)\w+", re.IGNORECASE)
"""``X is no Y``, instead of which documentation of programs has ``X is not a valid Y``; ``there is no Y`` is usual."""

_NO_PROSE = re.compile(
    r"^( *)```.*?^\1```$|<!-- faults .*?<!-- end of faults \w+ -->|`[^`]*`", re.DOTALL | re.MULTILINE
)


def unwanted(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line number and the key in ``BETTER`` of each unwanted word in ``text``, a page of Markdown.

    Code blocks, inline code and generated tables are left out.
    """
    prose = _NO_PROSE.sub(lambda part: re.sub(r"[^\n]", "`", part[0]), text)
    for found in _UNWANTED.finditer(prose):
        yield prose.count("\n", 0, found.start()) + 1, " ".join(found[0].lower().split())
    for found in _IS_NO.finditer(prose):
        yield prose.count("\n", 0, found.start()) + 1, "x is no y"


@pytest.mark.parametrize("page", [*PAGES, *SOURCES], ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_has_no_unwanted_words(page: Path) -> None:
    places = [
        f'{page.relative_to(ROOT)}:{line}: "{word}"; better: {BETTER[word]}'
        for line, word in unwanted(page.read_text(encoding="utf-8"))
    ]
    assert not places, "\n".join(places)


def test_words_are_found_in_any_case_and_across_lines() -> None:
    assert list(unwanted("Anew,\nit goes\nbefore")) == [(1, "anew"), (2, "goes before")]


def test_parts_of_words_are_not_words() -> None:
    assert not list(unwanted("embark; a disembarkation; besides"))


@pytest.mark.parametrize(
    "text",
    ["`anew`", "- so:\n\n  ```sh\n  echo anew\n  ```\n", "<!-- faults x -->\nlets go\n<!-- end of faults x -->"],
)
def test_code_and_generated_tables_are_left_out(text: str) -> None:
    assert not list(unwanted(text))
    assert list(unwanted(f"{text}\nanew"))
