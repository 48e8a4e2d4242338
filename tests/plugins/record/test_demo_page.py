"""The demo of the web site: one file that shows a recorded drive, without a server."""

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page
from scripts import demo_page

from handsteer.types import SIGNS
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS

pytestmark = NEEDS_A_BROWSER


def driven_m(page: Page) -> float:
    return float((page.locator("#world").get_attribute("data-pose") or "0").split()[0])


def wait_until(page: Page, condition: Callable[[], bool]) -> None:
    """Wait; the page's own policy forbids Playwright's way to wait for an expression."""
    end_s = time.monotonic() + PATIENCE_MS / 1000
    while time.monotonic() < end_s:
        if condition():
            return
        page.wait_for_timeout(50)
    pytest.fail(f"waited in vain; the page says: {page.locator('body').inner_text()}")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("demo")
    demo_page.drive(folder / "drive.mcap", "Stop:1 Forward:2 Go:2 Stop:1", 6.0)
    path = folder / "demo.html"
    path.write_text(demo_page.page_of(folder / "drive.mcap"), encoding="utf-8")
    return path


def test_it_has_the_whole_drive(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert len(text) < demo_page.LARGEST_BYTES * 6.0 / demo_page.DRIVE_S
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    assert [sign for sign, *_ in data["spans"]] == ["Stop", "Forward", "Go", "Stop"]
    assert {len(frame["hand"]) for frame in data["frames"]} <= {0, 21}
    assert sum(bool(frame["hand"]) for frame in data["frames"]) > 0.9 * len(data["frames"])
    assert {"driving", "standing"} <= {report["does"] for report in data["reports"]}
    assert data["stands"][0][1] == "the Stop sign is shown"
    assert all(len(report["bars"]) == len(SIGNS) for report in data["reports"])


def test_the_robot_moves_in_a_browser_without_a_server(page: Path) -> None:
    with a_browser() as browser:
        shown = browser.new_page(viewport={"width": 390, "height": 844})
        shown.set_default_timeout(PATIENCE_MS)
        troubles: list[str] = []
        shown.on("console", lambda message: troubles.append(message.text))
        shown.on("pageerror", lambda error: troubles.append(str(error)))
        shown.on("request", lambda request: troubles.append(request.url) if request.url.startswith("http") else None)
        shown.goto(page.as_uri())
        wait_until(shown, lambda: driven_m(shown) > 0.3)
        assert shown.locator("#does").inner_text().lower() == "driving"
        shown.get_by_role("button", name="Pause").click()
        shown.get_by_label("Time", exact=True).fill("0.5")
        wait_until(shown, lambda: shown.locator("#now").inner_text().startswith("0.5"))
        assert abs(driven_m(shown)) < 0.01
        assert shown.locator("#bars li.counts").inner_text() == "Stop"
        painted = (
            "(id) => { const c = document.getElementById(id); const d = c.getContext('2d').getImageData("
            "0, 0, c.width, c.height).data; return new Set(new Uint32Array(d.buffer)).size; }"
        )
        for canvas in ("picture", "world", "chart"):
            assert shown.evaluate(painted, canvas) > 20, f"nothing is drawn in {canvas}"
        assert shown.evaluate("document.documentElement.scrollWidth") <= 390
        assert troubles == []
