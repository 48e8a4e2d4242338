"""A table as text."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

_WIDEST = 10_000


def table(head: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """Return a table as text; columns after the first ``text_columns`` are aligned to the right."""
    grid = Table(box=None, pad_edge=False)
    for column, name in enumerate(head):
        grid.add_column(Text(name), justify="left" if column < text_columns else "right", no_wrap=True)
    for row in rows:
        grid.add_row(*map(Text, row))
    # Wide enough never to wrap: another program may read the lines.
    console = Console(width=_WIDEST, color_system=None, force_terminal=False)
    with console.capture() as text:
        console.print(grid)
    return "\n".join(line.rstrip() for line in text.get().splitlines())
