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

# Quasar forbids it around switches and boxes, but not in them.
OUTLINE = """() => {
    const element = document.activeElement;
    return getComputedStyle(element.querySelector(".q-toggle__inner, .q-checkbox__inner") ?? element).outline;
}"""


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


@pytest.mark.parametrize(
    "control", ["/settings .q-toggle", *each_when_there_is_time("/teach .q-checkbox", "/ .q-slider__track-container")]
)
def test_keyboard_focus_is_visible(control: str) -> None:
    path, selector = control.split()
    with visiting("Stop:600", path, camera={"fps": 5}, details=True) as visit:
        page = visit.page

        def has_focus() -> bool:
            page.keyboard.press("Tab")
            return bool(page.evaluate("selector => document.activeElement.matches(selector)", selector))

        visit.wait_until(has_focus)
        style = page.evaluate(OUTLINE)
        assert "solid" in style
        assert "0px" not in style


def test_a_box_that_is_checked_looks_so_in_forced_colours() -> None:
    with visiting("Stop:600", "/teach", camera={"fps": 5}) as visit:
        page = visit.page
        page.emulate_media(forced_colors="active", reduced_motion="reduce")
        box = page.get_by_role("checkbox", name="left hand")
        box.scroll_into_view_if_needed()
        page.mouse.move(0, 0)
        before = box.locator(".q-checkbox__inner").screenshot(animations="disabled")
        box.click()
        page.evaluate("document.activeElement.blur()")
        page.mouse.move(0, 0)
        page.wait_for_timeout(500)
        assert box.locator(".q-checkbox__inner").screenshot(animations="disabled") != before
