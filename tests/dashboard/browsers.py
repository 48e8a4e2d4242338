"""One Chromium for all tests of a process, with nothing kept from one to the next.

Only one process at a time shows pages: without a graphics card, two that draw the 3D view take all of a small machine.
"""

import atexit
import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

from playwright.sync_api import Browser, Playwright, sync_playwright
from scripts import chromium

_LOCK = Path(tempfile.gettempdir()) / "handsteer-tests-browser.lock"
_depth = 0


@contextmanager
def alone() -> Iterator[None]:
    """Wait until no other process of the tests shows pages, and keep them from it meanwhile."""
    global _depth  # noqa: PLW0603
    with ExitStack() as stack:
        if _depth == 0:
            fcntl.flock(stack.enter_context(_LOCK.open("w")), fcntl.LOCK_EX)
        _depth += 1
        try:
            yield
        finally:
            _depth -= 1


@contextmanager
def a_browser(webcam: Path | None = None) -> Iterator[Browser]:
    """Give a Chromium whose pages are closed afterwards, and forgotten.

    Args:
        webcam: The video that it takes for its webcam; such a browser is started for it alone.
    """
    with alone():
        if webcam is not None:
            browser = chromium.launch(_playwright(), webcam)
            try:
                yield browser
            finally:
                browser.close()
            return
        browser = _shared()
        if not browser.is_connected():  # a test has crashed it
            _shared.cache_clear()
            browser = _shared()
        try:
            yield browser
        finally:
            for context in browser.contexts:
                context.close()


def close_shared() -> None:
    """End the browser that all share, if there is one; the next test that needs it starts another."""
    if _shared.cache_info().currsize:
        _shared().close()
        _shared.cache_clear()


@cache
def _playwright() -> Playwright:
    playwright = sync_playwright().start()
    atexit.register(playwright.stop)
    return playwright


@cache
def _shared() -> Browser:
    return chromium.launch(_playwright())
