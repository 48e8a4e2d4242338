"""Tables in pages of the documentation, between a pair of markers that programs replace."""

import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def replaced(page: str, name: str, text: str) -> str:
    """Return ``page`` with ``text`` between its markers ``<!-- name -->`` and ``<!-- end of name -->``.

    Raises:
        ValueError: The page has no such markers.
    """
    marked = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
    if not marked.search(page):
        raise ValueError(f"the page has no markers <!-- {name} --> and <!-- end of {name} -->")
    return marked.sub(lambda found: f"{found[1]}\n{text}\n\n{found[2]}", page)
