"""Makes the README's picture of the page: the virtual hand drives the robot, headless Chromium looks at it."""

import sys
from pathlib import Path

from chromium import launch
from playwright.sync_api import Page, sync_playwright

from handsteer.config import load
from handsteer.dashboard.server import Dashboard
from handsteer.errors import HandsteerError
from handsteer.graph import Graph

PATH = Path(__file__).resolve().parents[1] / "docs" / "images" / "page.png"
WIDTH, HEIGHT = 1280, 800
LARGEST_BYTES = 400_000
DRIVEN_M = 1.0
PATIENCE_MS = 120_000

CONFIG = {
    "camera": {"source": "virtual"},
    "virtual_hand": {"script": "Forward:6 Turn Left:1 Forward:3"},
    "dashboard": {"port": 0},
}


def main() -> None:
    config = load(base=CONFIG)
    with Graph(config) as graph, sync_playwright() as playwright:
        dashboard = Dashboard.of(graph)
        url = dashboard.start()
        try:
            browser = launch(playwright)
            page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
            page.goto(url)
            page.wait_for_selector(".world canvas")
            graph.start()
            take(page, PATH)
            browser.close()
        finally:
            dashboard.stop()
    size = PATH.stat().st_size
    if size > LARGEST_BYTES:
        sys.exit(f"{PATH} has {size} bytes, it should have at most {LARGEST_BYTES}")
    print(f"{PATH}: {size} bytes")


def take(page: Page, path: Path) -> None:
    """Save a picture of ``page`` once the robot has driven a while and drives on, with a hand in view."""
    path.parent.mkdir(parents=True, exist_ok=True)
    page.wait_for_function(
        """metres => {
            const text = selector => document.querySelector(selector).textContent;
            return parseFloat(text(".world .foot .fact:nth-child(2) b")) >= metres
                && text(".banner .headline") === "Driving"
                && text(".camera .sign") === "Forward"
                && parseInt(text(".camera .percent")) > 90;
        }""",
        arg=DRIVEN_M,
        timeout=PATIENCE_MS,
    )
    page.screenshot(path=path)


if __name__ == "__main__":
    try:
        main()
    except (HandsteerError, FileNotFoundError) as error:
        sys.exit(str(error))
