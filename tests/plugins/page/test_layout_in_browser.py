"""What must be on the screen in a real browser: Stop and the state always, and all that one drives by at once."""

import pytest
from playwright.sync_api import Page, ViewportSize

from tests.plugins.page.test_accessibility import faults
from tests.plugins.page.visits import DESKTOP, NEEDS_A_BROWSER, PHONE, Visit, each_when_there_is_time, visiting

pytestmark = NEEDS_A_BROWSER

LAPTOPS: list[ViewportSize] = [{"width": 1366, "height": 768}, {"width": 1280, "height": 800}]
TABLET: ViewportSize = {"width": 768, "height": 1024}
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


# In German, which is longer, test_languages_in_browser looks at all of them.
@pytest.mark.parametrize("path", ["/", *each_when_there_is_time("/world", "/teach", "/settings", "/study")])
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


@pytest.mark.parametrize("locale", ["de-DE", *each_when_there_is_time("en-US")])
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


# Words of the banner that are on more than one line.
BROKEN = """() => {
    const broken = [], banner = document.querySelector(".banner .words");
    const texts = document.createTreeWalker(banner, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) for (const found of texts.currentNode.data.matchAll(/\\S+/g)) {
        const range = document.createRange();
        range.setStart(texts.currentNode, found.index);
        range.setEnd(texts.currentNode, found.index + found[0].length);
        if (new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size > 1) broken.push(found[0]);
    }
    return broken;
}"""
CUT = "element => element.scrollHeight > element.clientHeight + 1 || element.scrollWidth > element.clientWidth + 1"


@pytest.mark.parametrize("locale", ["de-DE", *each_when_there_is_time("en-US")])
def test_the_banner_breaks_no_word_and_is_as_high_when_the_robot_is_stopped(locale: str) -> None:
    with visiting("Forward:600", locale=locale, camera={"fps": 5}) as visit:
        page = visit.page
        visit.wait_until(lambda: visit.text(".banner .headline") in ("Driving", "Fahrt"))
        for size in (PHONE, DESKTOP):
            page.set_viewport_size(size)
            page.locator(".banner .stop").scroll_into_view_if_needed()
            height = page.evaluate("document.querySelector('.banner').offsetHeight")
            page.locator(".banner .stop").click()
            reset = page.locator(".banner .buttons button").nth(1)
            reset.wait_for()
            visit.wait_until(lambda: visit.text(".banner .reason") in STOPPED_BY_YOU)
            assert page.evaluate(BROKEN) == []
            assert not page.locator(".banner .words").evaluate(CUT)
            assert page.evaluate("document.querySelector('.banner').offsetHeight") == height
            reset.click()
            reset.wait_for(state="hidden")


STOPPED_BY_YOU = ("By you, until you reset it", "Von dir, bis du zurücksetzt")


@pytest.mark.parametrize("locale", ["de-DE", *each_when_there_is_time("en-US")])
def test_nothing_moves_or_is_cut_when_another_asks_to_drive(locale: str) -> None:
    with visiting("NONE:600", locale=locale, camera={"fps": 5}) as visit:
        page, other = visit.page, visit.another_page()
        other.goto(page.url)
        ask = other.get_by_role("button", name="Ask to drive")
        for size in (PHONE, DESKTOP):
            for each in (page, other):
                each.set_viewport_size(size)
            ask.wait_for()
            before = page.evaluate(SETTLED)
            ask.click()
            page.locator(".request .question").wait_for()
            assert page.evaluate(PLACES) == before
            assert page.evaluate(IN_VIEW)
            assert fits(page)
            assert fits(other)
            if size == DESKTOP:
                chips = [page.locator(".top .source"), other.locator(".lease .role"), other.locator(".top .source")]
                assert not any(chip.evaluate(CUT) for chip in chips)
            page.locator(".request button").last.click()  # keeps driving
            page.locator(".request .question").wait_for(state="hidden")


PLACES = """[...document.querySelectorAll(".top, .banner, .viewer, .legend, .panels")]
    .map((each) => Math.round(each.getBoundingClientRect().top))"""

# Places that have not changed for 20 frames, after the window got another size.
SETTLED = f"""async () => {{
    let places = "";
    for (let same = 0; same < 20; same++) {{
        await new Promise(requestAnimationFrame);
        const now = JSON.stringify({PLACES});
        if (now !== places) same = 0;
        places = now;
    }}
    return JSON.parse(places);
}}"""


def test_on_a_phone_the_whole_picture_is_in_view_while_one_teaches() -> None:
    with visiting("Stop:600", "/teach", camera={"fps": 5}) as visit:
        page = visit.page
        page.set_viewport_size(PHONE)
        visit.wait_until(lambda: bool(page.evaluate("document.querySelector('.camera .stage > img').naturalWidth")))
        picture, stage, words = (
            page.locator(part).first.bounding_box()
            for part in (".camera .stage > img", ".camera .stage", ".camera .offer")
        )
        assert picture is not None
        assert stage is not None
        assert words is not None
        assert picture["width"] / picture["height"] == pytest.approx(4 / 3, abs=0.02)
        assert picture["y"] + picture["height"] <= stage["y"] + stage["height"] + 1
        assert picture["x"] + picture["width"] <= words["x"]
        assert words["y"] + words["height"] <= stage["y"] + stage["height"] + 1
        assert fits(page)


REFUSE = """() => {
    navigator.mediaDevices.getUserMedia = async () => { throw new DOMException("no", "NotAllowedError"); };
}"""
# Of the colour behind what is said in place of the picture, 0 to 255.
STAGE_BRIGHTNESS = """() => {
    const colour = getComputedStyle(document.querySelector(".camera .stage")).backgroundColor;
    return Math.max(...colour.match(/\\d+/g).slice(0, 3).map(Number));
}"""


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_where_the_camera_was_refused_the_page_says_so_in_place_of_a_black_picture(size: ViewportSize) -> None:
    with visiting("NONE:600", locale="de-DE", camera={"source": "browser"}) as visit:
        page = visit.page
        page.set_viewport_size(size)
        page.evaluate(REFUSE)
        page.locator(".offer [data-camera=browser]").click()
        said = page.locator(".offer .trouble", has_text="Der Browser hat die Kamera abgelehnt")
        said.wait_for()
        assert page.evaluate(STAGE_BRIGHTNESS) > 200
        stage, words = page.locator(".camera .stage").bounding_box(), said.bounding_box()
        assert stage is not None
        assert words is not None
        middle = words["y"] + words["height"] / 2
        assert stage["y"] + stage["height"] / 4 < middle < stage["y"] + 3 * stage["height"] / 4
        assert fits(page)
        assert faults(page) == []
