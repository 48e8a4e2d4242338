"""The documentation is in plain technical English: words that were removed from it do not return."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GENERATED = {"configuration.md"}
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(page for page in (ROOT / "docs").glob("*.md") if page.name not in GENERATED),
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
    "for want of": "without",
    "goes before": "overrides, precedes",
    "go before": "override, precede",
    "held up": "stalled, delayed",
    "hold up": "stall, delay",
    "holds up": "stalls, delays",
    "lets go": "releases",
    "let go": "release",
    "looking on": "observing",
    "looks on": "observes",
    "mends": "fixes",
    "newcomers": "new nodes, new viewers",
    "nobody's word": "the condition itself",
    "onlooker": "observer",
    "says so": "reports it",
    "say so": "report it",
    "so wished": "configured, requested",
    "takes its leave": "leaves",
    "takes leave": "leaves",
    "the same wish": "the same command",
    "told apart": "distinguished",
    "told as": "recognised as",
    "are told on": "are published on",
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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
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
