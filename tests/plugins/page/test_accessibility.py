"""Whether people can use the pages who see little, use no mouse, or have a small screen: axe, in a real browser."""

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, ViewportSize

from tests.plugins.page.visits import NEEDS_A_BROWSER, each_when_there_is_time, visiting

pytestmark = NEEDS_A_BROWSER

# Contrast AA among them. Text over pictures is beyond what a program can judge.
RULES = {"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"]}
# Quasar's own bar, which comes while something loads and has no name.
LEFT_OUT = {"exclude": [["#q-loading-bar"]]}
SMALLEST_PHONE: ViewportSize = {"width": 360, "height": 740}


def faults(page: Page) -> list[str]:
    found = Axe().run(page, context=LEFT_OUT, options=RULES).response["violations"]
    return [f"{fault['help']}: {node['html']}" for fault in found for node in fault["nodes"]]


@pytest.mark.parametrize("path", ["/", "/world", *each_when_there_is_time("/teach", "/settings")])
def test_a_page_is_there_for_all_in_light_and_dark_and_on_a_phone(path: str) -> None:
    with visiting("Forward:600", path, camera={"fps": 5}, robot={"world": "slalom"}) as visit:
        page = visit.page
        if path == "/world":
            page.get_by_role("button", name="Add a box").click()
            page.get_by_label("length [m]").wait_for()
        assert faults(page) == []
        page.locator(".theme").click()
        visit.wait_until(lambda: "body--dark" in (page.locator("body").get_attribute("class") or ""))
        assert faults(page) == []
        page.set_viewport_size(SMALLEST_PHONE)
        assert page.evaluate("document.documentElement.scrollWidth") <= SMALLEST_PHONE["width"]
