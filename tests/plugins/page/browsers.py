"""One Chromium for all tests of a process, with nothing kept from one to the next."""

import atexit
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

from playwright.sync_api import Browser, Playwright
from scripts import chromium

TILTS_UNASKED = "delete window.DeviceOrientationEvent?.requestPermission"
"""Script that lets pages read how a phone is held as on Android: Chromium's shell asks, with no window to answer in."""

_stack = ExitStack()
atexit.register(_stack.close)


@contextmanager
def a_browser(webcam: Path | None = None) -> Iterator[Browser]:
    """Give a Chromium whose pages are closed afterwards, and forgotten.

    Args:
        webcam: The video that it takes for its webcam; such a browser is started for it alone.
    """
    if webcam is not None:
        browser = chromium.launch(_playwright(), webcam, sparing=True)
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
    """End the browser that all share, and Playwright, if there is one; the next test that needs it starts another.

    Playwright keeps an event loop running, next to which other tests cannot run theirs.
    """
    if _shared.cache_info().currsize:
        _shared().close()
        _shared.cache_clear()
    if _playwright.cache_info().currsize:
        _stack.close()
        _playwright.cache_clear()


@cache
def _playwright() -> Playwright:
    return _stack.enter_context(chromium.playwright())


@cache
def _shared() -> Browser:
    return chromium.launch(_playwright(), sparing=True)
