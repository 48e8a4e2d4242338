"""What must be on the screen in a real browser: Stop and the state always, and all that one drives by at once."""

import pytest
from playwright.sync_api import Page, ViewportSize

from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

DESKTOP: ViewportSize = {"width": 1440, "height": 900}
LAPTOPS: list[ViewportSize] = [{"width": 1366, "height": 768}, {"width": 1280, "height": 800}]
TABLET: ViewportSize = {"width": 768, "height": 1024}
PHONE: ViewportSize = {"width": 390, "height": 844}
SEEN = "for (const name of ['demo', 'coach']) localStorage.setItem(`handsteer-${name}`, 'seen')"

# What is at the middle of Stop, and whether the state is in view.
IN_VIEW = """() => {
    const stop = document.querySelector(".banner .stop"), box = stop.getBoundingClientRect();
    const state = document.querySelector(".banner .headline").getBoundingClientRect();
    return stop.contains(document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2))
        && box.top >= 0 && box.bottom <= innerHeight && box.height >= 44
        && state.top >= 0 && state.bottom <= innerHeight && state.right <= innerWidth;
}"""
SCROLL_TO = (
    "part => scrollTo({ top: part * (document.documentElement.scrollHeight - innerHeight), behavior: 'instant' })"
)
# Whether each row of a card has room for all that is in it, and the key of the plots none of their title's.
ROWS_HAVE_ROOM = """() => {
    const text = document.createRange();
    text.selectNodeContents(document.querySelector(".velocity h2"));
    const key = document.querySelector(".velocity .key").getBoundingClientRect(), title = text.getBoundingClientRect();
    return (title.right < key.left || title.bottom <= key.top)
        && [...document.querySelectorAll(".panel > *, .foot")].every((row) => row.scrollWidth <= row.clientWidth + 1);
}"""
BAR_PX = "document.querySelector('.banner').getBoundingClientRect().bottom"
SHIFTS = """() => {
    window.shifted = 0;
    new PerformanceObserver((list) => {
        for (const entry of list.getEntries()) if (!entry.hadRecentInput) window.shifted += entry.value;
    }).observe({ type: "layout-shift" });
}"""


def fits(page: Page) -> bool:
    """Return whether nothing is wider than the screen."""
    return bool(page.evaluate("document.documentElement.scrollWidth <= innerWidth"))


def rows_have_room(page: Page) -> bool:
    """Return whether nothing in the rows of the cards is cut off or covered, on common screens."""
    for size in (DESKTOP, *LAPTOPS):
        page.set_viewport_size(size)
        if not page.evaluate(ROWS_HAVE_ROOM):
            return False
    return True


def stop_is_in_view_wherever(page: Page) -> bool:
    for part in (0, 0.5, 1):
        page.evaluate(SCROLL_TO, part)
        page.wait_for_timeout(100)  # a frame
        if not page.evaluate(IN_VIEW):
            return False
    return True


@pytest.mark.parametrize("path", ["/", "/world", "/teach", "/settings", "/study"])
def test_stop_and_state_are_in_view_at_every_scroll_position_and_no_page_is_too_wide(path: str) -> None:
    with visiting("Forward:600", path, camera={"fps": 5}) as visit:
        page = visit.page
        visit.wait_until(lambda: visit.text(".banner .headline") == "Driving")
        for size in (DESKTOP, TABLET, PHONE):
            page.set_viewport_size(size)
            assert fits(page), size
            assert stop_is_in_view_wherever(page), size
        if path in ("/", "/settings"):  # scrolled to the end of a long page
            assert page.evaluate(BAR_PX) <= 64


JOB = (".camera .stage", ".world .stage", ".banner", ".pad", ".camera .foot", ".world .foot", ".sign-tile >> nth=-1")
TECHNICAL = (".velocity", ".timing", ".topic", ".limit", ".sign-tile .figures")


@pytest.mark.parametrize("locale", ["en-US", "de-DE"])
def test_all_that_one_drives_by_fits_a_screen_without_scrolling(locale: str) -> None:
    with visiting("Forward:600", locale=locale, camera={"fps": 5}) as visit:
        page = visit.page
        visit.wait_until(lambda: visit.text(".banner .headline") in ("Driving", "Fahrt"))
        for size in (DESKTOP, LAPTOPS[0]):
            page.set_viewport_size(size)
            page.evaluate("scrollTo(0, 0)")
            for selector in JOB:
                box = page.locator(selector).first.bounding_box()
                assert box is not None, selector
                assert box["y"] >= 0, selector
                assert box["y"] + box["height"] <= size["height"], (size, selector)
            assert not any(page.locator(selector).first.is_visible() for selector in TECHNICAL)
            assert clear_of_the_picture(page)
        page.set_viewport_size(DESKTOP)
        # No empty band under the 3D view.
        camera, world = (page.locator(f".{name}.viewer").bounding_box() for name in ("camera", "world"))
        foot = page.locator(".world .foot").bounding_box()
        assert camera is not None
        assert world is not None
        assert foot is not None
        assert camera["height"] == pytest.approx(world["height"], abs=1)
        assert foot["y"] + foot["height"] == pytest.approx(world["y"] + world["height"], abs=2)
        assert rows_have_room(page)
        page.locator(".details button").click()
        assert all(page.locator(selector).first.is_visible() for selector in TECHNICAL[:-1])
        assert rows_have_room(page)
        page.reload()
        page.locator(".velocity").wait_for()
        assert page.locator(".details button").get_attribute("aria-expanded") == "true"


def clear_of_the_picture(page: Page) -> bool:
    """Return whether the words about the demo hand leave the picture free."""
    picture, words = (page.locator(part).bounding_box() for part in (".camera .stage > img", ".offer.demo"))
    assert picture is not None
    assert words is not None
    return picture["height"] >= 150 and picture["y"] + picture["height"] <= words["y"]


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_nothing_jumps_while_a_page_is_loaded_and_signs_come_second_on_a_phone(size: ViewportSize) -> None:
    with visiting("Forward:600", camera={"fps": 5}) as visit:
        page = visit.page
        page.add_init_script(f"({SHIFTS})()")
        page.set_viewport_size(size)
        page.reload()
        visit.wait_until(lambda: visit.text(".banner .headline") == "Driving")
        visit.wait_until(lambda: visit.text(".camera .sign") == "Forward")
        assert page.evaluate("window.shifted") < 0.05
        camera, signs, world = (
            page.locator(part).bounding_box() for part in (".camera.viewer", ".legend", ".world.viewer")
        )
        assert camera is not None
        assert signs is not None
        assert world is not None
        if size == PHONE:
            assert camera["y"] < signs["y"] < world["y"]
            assert clear_of_the_picture(page)


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_nothing_jumps_while_the_robot_drives(size: ViewportSize) -> None:
    script = "Forward:1.5 Turn Left:1.5 Go:1 NONE:0.5 Backward:1.5 Stop:1"
    with visiting(script, camera={"fps": 10}) as visit:
        page = visit.page
        page.add_init_script(SEEN)
        page.set_viewport_size(size)
        page.reload()
        visit.wait_until(lambda: visit.text(".banner .headline") == "Driving")
        page.evaluate(SHIFTS)
        for _ in range(2):
            all_is_shown_of(visit)
        assert page.evaluate("window.shifted") < 0.05
        assert visit.troubles == []


def all_is_shown_of(visit: Visit) -> None:
    for sign in ("Forward", "Turn Left", "Backward", "Stop"):
        visit.wait_until(lambda sign=sign: visit.text(".camera .sign") == sign)  # type: ignore[misc]
