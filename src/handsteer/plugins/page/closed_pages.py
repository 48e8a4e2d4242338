"""Frees closed pages, and decides when to search for garbage.

With a dozen large pages, a full search for garbage locks the interpreter for a second, which delays Stop. Pages
consist of reference cycles, which only that search finds. So a closed page is taken apart by hand, which frees it at
once, and the search waits until the robot stands.
"""

import asyncio
import gc
import os
import sys
from pathlib import Path
from typing import Final

from nicegui import ui
from nicegui.element import Element
from nicegui.observables import ObservableCollection

from handsteer.plugins.page.page import Page

_IN_USE_S: Final = 2.0
"""After a page was deleted, some ten seconds after its browser has left; what it still awaited has ended by then."""

_NEVER: Final = 1_000_000_000
_YOUNG: Final = (700, 10)
"""Thresholds of Python's two young generations, as by default; these searches take some milliseconds."""

_GROWTH_MB: Final = 50.0
_LARGEST_GROWTH_MB: Final = 400.0
_BLOCK_MB: Final = 75e-6
_REST_S: Final = 1.0
_BETWEEN_S: Final = 10.0
_MOST_PAGES: Final = 3
"""With more pages a search, for which a Stop would wait, takes longer: 16 ms each of Settings on an idle machine."""

_ELEMENT_KEEPS: Final = frozenset({"id", "tag", "slots", "_client", "_deleted", "_parent_slot"})
_PAGE_KEEPS: Final = frozenset({"_context"})


def free_when_closed(page: Page) -> None:
    """Take ``page`` apart some seconds after it was deleted; runs on the pages' thread."""
    client = page.client

    def free() -> None:
        elements = list(client.elements.values())
        asyncio.get_running_loop().call_later(_IN_USE_S, _take_apart, page, elements)

    client.on_delete(free)


def _take_apart(page: Page, elements: list[Element]) -> None:
    for element in elements:
        for part in list(vars(element).values()):
            if isinstance(part, ObservableCollection):
                part._change_handlers.clear()  # bound methods of the collection itself
        for slot in element.slots.values():
            slot.children.clear()
        if isinstance(element, ui.timer):
            element.callback = None  # its task may still sleep, and then reads the rest
        else:
            _forget_all_but(_ELEMENT_KEEPS, element)
    client = page.client
    for handlers in (client.connect_handlers, client.disconnect_handlers, client.delete_handlers):
        handlers.clear()
    client.outbox.message_history.clear()
    _forget_all_but(_PAGE_KEEPS, page)


def _forget_all_but(names: frozenset[str], owner: object) -> None:
    for name in vars(owner).keys() - names:
        del vars(owner)[name]


class Garbage:
    """Searches for all garbage only while the robot stands and few pages are kept, unless memory has grown very much.

    Searches among the young objects go on as usual.
    """

    def __init__(self) -> None:
        self._stood_since_s: float | None = None
        self._memory_mb = 0.0
        self._searched_s = 0.0

    def start(self, now_s: float) -> None:
        """Take over from Python's own schedule; objects loaded so far are never searched."""
        gc.collect()
        gc.freeze()
        gc.set_threshold(*_YOUNG, _NEVER)
        gc.enable()
        self._memory_mb, self._searched_s = memory_mb(), now_s

    def look(self, now_s: float, *, stands: bool, pages: int) -> bool:
        """Search if it is due, a few times a second; return whether it was."""
        if not stands:
            self._stood_since_s = None
        elif self._stood_since_s is None:
            self._stood_since_s = now_s
        grown_mb = memory_mb() - self._memory_mb
        rests = self._stood_since_s is not None and now_s - self._stood_since_s >= _REST_S
        is_due = rests and pages <= _MOST_PAGES and grown_mb > _GROWTH_MB and now_s - self._searched_s >= _BETWEEN_S
        if not (is_due or grown_mb > _LARGEST_GROWTH_MB):
            return False
        gc.collect()
        self._memory_mb, self._searched_s = memory_mb(), now_s
        return True


def memory_mb() -> float:
    """Return the resident memory of this process in MB; only that of Python's objects where there is no ``/proc``."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return _BLOCK_MB * sys.getallocatedblocks()
    return 1e-6 * pages * os.sysconf("SC_PAGE_SIZE")
