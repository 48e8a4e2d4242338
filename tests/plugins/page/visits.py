"""A browser that looks at the page of a running graph."""

import logging
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import ConsoleMessage, Page, Request, ViewportSize
from scripts import chromium

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.plugins.study.session import Task
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import page_process

log = logging.getLogger(__name__)

PATIENCE_MS = 90_000
_STANDS_S = 1.0
# Small: without a graphics card, each pixel costs.
WINDOW: ViewportSize = {"width": 1000, "height": 600}
DESKTOP: ViewportSize = {"width": 1440, "height": 900}
PHONE: ViewportSize = {"width": 390, "height": 844}

NEEDS_A_BROWSER = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(chromium.find() is None, reason=f"no browser found: none of {', '.join(chromium.NAMES)}"),
]


def each_when_there_is_time(*values: str) -> list[Any]:
    """Return these as parameters of a test that others stand for: for make test-all, where it has time for them."""
    return [pytest.param(value, marks=pytest.mark.exhaustive) for value in values]


IN_LANGUAGES_AND_SIZES = [
    pytest.param("en-US", DESKTOP, id="en-US-desktop"),
    pytest.param("de-DE", PHONE, id="de-DE-phone"),
    pytest.param("en-US", PHONE, id="en-US-phone", marks=pytest.mark.exhaustive),
    pytest.param("de-DE", DESKTOP, id="de-DE-desktop", marks=pytest.mark.exhaustive),
]
"""For a test of a whole visit: in both languages, and on both sizes of a screen."""


@dataclass
class Visit:
    """A browser that shows the page of a running graph, and what went wrong in it."""

    page: Page
    graph: Graph
    troubles: list[str] = field(default_factory=list)

    def text(self, selector: str) -> str:
        return self.page.locator(selector).first.inner_text()

    def number(self, selector: str) -> float:
        return float(self.text(selector).split()[-1])

    def another_page(self) -> Page:
        """Open an empty page of another viewer in the same browser."""
        browser = self.page.context.browser
        assert browser is not None
        return browser.new_page()

    def wait_until(self, condition: Callable[[], bool]) -> None:
        end_s = time.monotonic() + PATIENCE_MS / 1000  # not a number of looks, each of which may take seconds
        while time.monotonic() < end_s:
            if condition():
                return
            self.page.wait_for_timeout(50)
        pytest.fail(f"waited in vain; the page says: {self.text('body')}; {self.troubles}")

    def steer_until(self, linear_mps: float, angular_radps: float, condition: Callable[[], bool]) -> None:
        """Steer as a person does: who sees the robot stand lets go and steers again.

        A machine that was held up ends what was steered, and rightly so.
        """
        steering, stood_s = self.graph.steering, -math.inf
        assert steering is not None

        def drives() -> bool:
            nonlocal stood_s
            state, now_s = self.graph.robot.state, time.monotonic()
            if abs(state.linear_mps) + abs(state.angular_radps) > 0.01:
                stood_s = now_s
            elif now_s - stood_s > _STANDS_S:
                steering.steer(0.0, 0.0)
                steering.steer(linear_mps, angular_radps)
                stood_s = now_s
            return condition()

        steering.release()
        self.wait_until(drives)

    def note_message(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.troubles.append(message.text)

    def note_request(self, request: Request) -> None:
        if not request.url.startswith(("http://127.0.0.1:", "data:", "blob:")):
            self.troubles.append(f"asks for {request.url}")


@contextmanager
def visiting(
    script: str,
    path: str = "/",
    webcam: Path | None = None,
    *,
    steering: bool = False,
    study: Task | None = None,
    locale: str = "en-US",
    details: bool = False,
    **sections: dict[str, Any],
) -> Iterator[Visit]:
    """Show a page of a whole graph that sees the virtual hand; the hand begins once the browser shows the page.

    Args:
        script: What the virtual hand shows.
        path: Which page.
        webcam: The video that the browser takes for its own camera.
        steering: Whether the graph has a node ``steering`` beside that of the page.
        study: What the page leads a participant through.
        locale: The browser's language.
        details: Whether the browser shows the page's details.
        sections: Further configuration by section.
    """
    base = {
        "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
        "virtual_hand": {"script": script},
        "dashboard": {"port": 0},
    }
    with Graph(load(None, base, sections), steering=steering) as graph, a_browser(webcam) as browser:
        served = page_process()
        url = served.serve(graph, study=study).removesuffix("/study")
        visit = Visit(browser.new_page(viewport=WINDOW, locale=locale), graph)
        try:
            visit.page.set_default_timeout(PATIENCE_MS)
            visit.page.on("console", visit.note_message)
            visit.page.on("pageerror", lambda error: visit.troubles.append(str(error)))
            visit.page.on("request", visit.note_request)
            # Shown with a test that fails: a page that lost its connection loads itself again, and forgets its inputs.
            visit.page.on("framenavigated", lambda frame: log.warning("loaded %s", frame.url))
            if details:
                visit.page.add_init_script("localStorage.setItem('handsteer-details', true)")
            visit.page.goto(url + path)
            visit.page.locator(".banner").wait_for()
            graph.start()
            yield visit
        finally:
            visit.page.context.close()  # before what it shows is gone
            served.stop()
