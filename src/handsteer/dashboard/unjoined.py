"""Pages that were served and that no browser has joined yet: how many of them are kept."""

from typing import Final

from nicegui import Client

MOST_UNJOINED: Final = 64
"""Each takes half a megabyte or more, and NiceGUI keeps it for a minute."""


class Unjoined:
    """Deletes the oldest page that nobody has joined when there are too many; runs on the server's thread.

    A browser whose page is gone before it joins loads it anew by itself. Without this, whatever fetches pages and runs
    no script, or has no cookies, fills the memory.

    Args:
        most: How many are kept.
    """

    def __init__(self, most: int = MOST_UNJOINED) -> None:
        self._most = most
        self._pages: dict[str, Client] = {}  # in the order in which they were served

    def add(self, page: Client) -> None:
        """Take a page that is being served."""
        self._pages[page.id] = page
        page.on_connect(lambda: self._forget(page.id))
        page.on_delete(lambda: self._forget(page.id))
        if len(self._pages) > self._most:
            next(iter(self._pages.values())).delete()

    def _forget(self, page: str) -> None:
        self._pages.pop(page, None)
