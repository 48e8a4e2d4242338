"""A learner's first minutes in a real browser with a fake camera: in two languages, on a large and a small screen."""

from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, ViewportSize

from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.test_layout_in_browser import LAPTOPS, SHIFTS, TECHNICAL, fits
from tests.plugins.page.visits import DESKTOP, IN_LANGUAGES_AND_SIZES, NEEDS_A_BROWSER, visiting

pytestmark = NEEDS_A_BROWSER

USE = {"en-US": "Use my camera", "de-DE": "Meine Kamera nutzen"}
MOST_CLICKS = 2
COUNT_CLICKS = "window.clicks = 0; addEventListener('click', () => window.clicks++, true)"
LARGEST_SHIFT = 0.05
# A machine that draws the world in software, and has little time, is slow to send its camera's frames.
PATIENT: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
SIGNS = 6


@pytest.mark.parametrize(("locale", "size"), IN_LANGUAGES_AND_SIZES)
def test_a_learner_drives_by_ones_own_hand_within_two_clicks(locale: str, size: ViewportSize, person: Path) -> None:
    with visiting("NONE:600", webcam=person, locale=locale, **PATIENT) as visit:
        page, graph = visit.page, visit.graph
        page.set_viewport_size(size)
        page.add_init_script(f"({SHIFTS})(); {COUNT_CLICKS}")
        page.reload()
        page.locator(".offer.demo").wait_for()
        visit.wait_until(lambda: bool(page.evaluate("document.querySelector('.camera .stage > img').naturalWidth")))
        assert page.evaluate("window.shifted") <= LARGEST_SHIFT
        assert faults(page) == []

        page.get_by_role("button", name=USE[locale]).first.click()
        visit.wait_until(lambda: graph.robot.state.linear_mps > 0.02)
        assert graph.cameras.source == "browser"
        assert page.evaluate("window.clicks") <= MOST_CLICKS
        visit.wait_until(lambda: visit.text(".banner .headline") in ("Driving", "Fahrt"))
        assert fits(page)
        assert visit.troubles == []


def all_tiles_in(page: Page, size: ViewportSize) -> bool:
    boxes = [page.locator(".sign-tile").nth(number).bounding_box() for number in range(SIGNS)]
    return all(box is not None and box["y"] + box["height"] <= size["height"] for box in boxes)


@pytest.mark.parametrize("locale", USE)
def test_the_first_screen_has_all_signs_and_nothing_technical(locale: str) -> None:
    with visiting("Forward:600", locale=locale, camera={"fps": 5}) as visit:
        page = visit.page
        page.locator(".sign-tile").nth(SIGNS - 1).wait_for()
        for size in (DESKTOP, LAPTOPS[0]):
            page.set_viewport_size(size)
            page.evaluate("scrollTo(0, 0)")
            visit.wait_until(partial(all_tiles_in, page, size))
            assert not any(page.locator(selector).first.is_visible() for selector in TECHNICAL), size
