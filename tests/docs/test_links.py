"""Each link leads somewhere: to a file, and to a heading of it."""

import re
from pathlib import Path

import pytest

from tests.docs.pages import DOCS, PAGES, ROOT, prose, text_of

LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^()\s]+)\)|(?:href|src)=\"([^\"]+)\"")
MADE_BY_SITE = {"demo.html"}


def anchors(markdown: str) -> set[str]:
    """Return the anchors that GitHub makes of the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", markdown, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_each_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    wrong = []
    for found in LINK.finditer(prose(page)):
        target = found[1] or found[2]
        if target.startswith(("http://", "https://")) or target in MADE_BY_SITE:
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists() or (anchor and anchor not in anchors(prose(file))):
            wrong.append(target)
    assert wrong == []


def test_each_page_is_in_the_index_and_reached_from_another() -> None:
    trees = set(re.findall(r"^([\w-]+)$", text_of(DOCS / "index.md"), re.MULTILINE))
    assert {page.stem for page in DOCS.glob("*.md")} - trees == {"index"}
