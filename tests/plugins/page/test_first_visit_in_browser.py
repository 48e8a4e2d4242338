"""A first visit in a real browser: the page says that its hand is drawn, and how to drive with one's own."""

import http.client
import math
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page

from tests.plugins.page.browsers import a_browser
from tests.plugins.page.test_server import read_jpeg
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, WINDOW, Visit, each_when_there_is_time, visiting

pytestmark = NEEDS_A_BROWSER

USE, KEEP = "Use my camera", "Keep watching"
MOST_CLICKS = 4
COUNT_CLICKS = "window.clicks = 0; addEventListener('click', () => window.clicks++, true)"
REFUSE = """() => {
    navigator.mediaDevices.getUserMedia = async () => { throw new DOMException("no", "NotAllowedError"); };
}"""


@pytest.fixture
def visit() -> Iterator[Visit]:
    with visiting("Forward:600", camera={"fps": 5}) as visit:
        yield visit


def intro(page: Page) -> bool:
    return page.get_by_text("This is a demo hand").is_visible()


def done(page: Page) -> int:
    return page.locator(".coach li.done").count()


def test_a_visitor_drives_by_signs_and_stops_in_few_clicks(person: Path) -> None:
    # A machine that draws the world in software, and has little time, is slow to send its camera's frames.
    patient: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
    with visiting("NONE:600", webcam=person, **patient) as visit:
        page, robot = visit.page, visit.graph.robot
        page.evaluate(COUNT_CLICKS)
        visit.wait_until(lambda: intro(page) and visit.text(".camera .caption") == "demo hand")
        page.get_by_role("button", name=USE).click()
        visit.wait_until(lambda: robot.state.linear_mps > 0.02)
        visit.wait_until(lambda: done(page) == 3)
        assert not intro(page)
        assert page.evaluate("window.clicks") <= MOST_CLICKS
        visit.wait_until(lambda: not page.locator(".coach").is_visible())  # a moment later
        page.reload()
        visit.wait_until(lambda: visit.text(".lease .role") == "you drive")
        assert not page.locator(".coach").is_visible(), "it does not come back"
        assert visit.troubles == []


IS_REACHED = """button => {
    const {x, y, width, height} = button.getBoundingClientRect();
    return button.contains(document.elementFromPoint(x + width / 2, y + height / 2));
}"""


@pytest.mark.parametrize(
    "view", ["/teach 360 640", "/ 360 640", *each_when_there_is_time("/teach 683 384", "/ 1366 768")]
)
def test_while_no_picture_comes_the_offer_can_be_read_and_pressed(view: str) -> None:
    path, width, height = view.split()
    with visiting("Forward:600", path, camera={"fps": 0.2}) as visit:
        page = visit.page
        page.set_viewport_size({"width": int(width), "height": int(height)})
        button = page.locator(".camera").get_by_role("button", name=USE).first
        button.scroll_into_view_if_needed()
        visit.wait_until(lambda: page.locator(".camera .veil:not(.off)").is_visible())
        assert button.evaluate(IS_REACHED)
        words, offer = (page.locator(f".camera {each}").first.bounding_box() for each in (".veil", ".offer.demo"))
        assert words is not None
        assert offer is not None
        is_beside = words["x"] + words["width"] <= offer["x"] + 1
        is_above = words["y"] + words["height"] <= offer["y"] + 1
        assert is_beside or is_above, (words, offer)


SLOW_CAMERA = """() => {
    const open = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
    navigator.mediaDevices.getUserMedia = async (wanted) => {
        await new Promise((done) => setTimeout(done, 1e6));
        return open(wanted);
    };
}"""
PAUSE_PERMISSION = "navigator.permissions.query = async () => ({ state: 'prompt' })"


@pytest.mark.parametrize("path", ["/world", *each_when_there_is_time("/", "/settings")])
def test_ones_own_camera_stays_when_a_page_is_loaded(person: Path, path: str) -> None:
    with visiting("NONE:600", webcam=person, camera={"fps": 5}) as visit:
        page, camera = visit.page, visit.graph.camera

        def gives() -> bool:
            frames = camera.frames
            page.wait_for_timeout(100)
            return visit.graph.cameras.browser.is_given and camera.frames > frames

        page.context.grant_permissions(["camera"])
        page.get_by_role("button", name=USE).first.click()
        visit.wait_until(gives)
        page.goto(page.url.rstrip("/") + path)
        visit.wait_until(gives)

        # Where the browser would ask again, the page does.
        page.add_init_script(PAUSE_PERMISSION)
        page.reload()
        visit.wait_until(lambda: visit.text(".banner .reason") == "This browser's camera is off: Use my camera")
        assert not page.locator(".coach").is_visible()
        page.locator(".banner .use-camera").click()
        visit.wait_until(gives)
        visit.wait_until(lambda: visit.text(".banner .reason") != "This browser's camera is off: Use my camera")
        visit.wait_until(lambda: not page.locator(".banner .use-camera").is_visible())
        assert visit.troubles == []


def test_who_leaves_the_page_while_the_camera_opens_gives_it_on_the_next_one(person: Path) -> None:
    with visiting("NONE:600", webcam=person, camera={"fps": 5}) as visit:
        page = visit.page
        page.context.grant_permissions(["camera"])
        page.evaluate(SLOW_CAMERA)
        page.get_by_role("button", name=USE).first.click()
        page.goto(page.url.rstrip("/") + "/settings")
        visit.wait_until(lambda: visit.graph.cameras.browser.is_given)
        assert visit.troubles == []


MEAN_COLOUR = """() => {
    const picture = document.querySelector(".camera .stage > img"), canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
    if (!canvas.width) return null;
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((_, n) => n % 4 !== 3).reduce((sum, value) => sum + value, 0) / data.length;
}"""


def raw_picture(url: str) -> float:
    """Return the mean of a picture of the stream, as a program without a browser reads it."""
    connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=PATIENCE_MS / 1000)
    connection.request("GET", "/camera.mjpg")
    with closing(connection.getresponse()) as response:
        return float(read_jpeg(response).mean())


def test_others_see_a_drawn_hand_while_the_camera_is_for_me_only(person: Path) -> None:
    # Of two pages of one browser without a screen, only the newest plays a video.
    with visiting("NONE:600", webcam=person, camera={"fps": 5}) as visit, a_browser() as browser:
        page = visit.page
        only_me = page.get_by_role("button", name="Only me")

        def seen(viewer: Page) -> float:
            mean = viewer.evaluate(MEAN_COLOUR)
            return math.nan if mean is None else float(mean)

        page.context.grant_permissions(["camera"])
        only_me.click()
        visit.wait_until(lambda: only_me.get_attribute("aria-pressed") == "true")
        page.get_by_role("button", name=USE).first.click()
        visit.wait_until(lambda: visit.graph.cameras.browser.is_given)
        page.reload()  # the browser remembers it
        visit.wait_until(lambda: visit.graph.cameras.browser.is_given and seen(page) > 40)
        assert raw_picture(page.url) < 15

        other = browser.new_page(viewport=WINDOW)
        other.set_default_timeout(PATIENCE_MS)
        other.goto(page.url)
        visit.wait_until(lambda: seen(other) > 0)  # what is drawn
        visit.wait_until(lambda: not other.get_by_role("button", name="Only me").is_visible())
        assert seen(other) < 15
        assert seen(page) > 40

        only_me.click()
        visit.wait_until(lambda: seen(other) > 40 and raw_picture(page.url) > 40)
        only_me.click()
        visit.wait_until(lambda: seen(other) < 15 and raw_picture(page.url) < 15)
        assert seen(page) > 40
        page.get_by_role("button", name="Back to the virtual hand").click()
        visit.wait_until(lambda: seen(other) > 40)
        assert visit.troubles == []


def test_a_browser_that_refuses_says_in_the_same_place_what_to_do(visit: Visit) -> None:
    page = visit.page
    visit.wait_until(lambda: intro(page))
    page.evaluate(REFUSE)
    page.get_by_role("button", name=USE).click()
    visit.wait_until(lambda: "Allow it by the camera" in visit.text(".offer.demo .trouble"))
    assert intro(page)


def test_who_keeps_watching_is_not_asked_again(visit: Visit) -> None:
    page = visit.page
    visit.wait_until(lambda: intro(page))
    page.get_by_role("button", name=KEEP).click()
    visit.wait_until(lambda: not intro(page))
    page.reload()
    visit.wait_until(lambda: visit.text(".camera .caption") == "demo hand")
    assert not intro(page)
    assert page.get_by_role("button", name=USE).is_visible()
    assert not page.get_by_role("button", name=KEEP).is_visible()


def test_the_better_rule_is_chosen_with_a_click_and_not_offered_again(visit: Visit) -> None:
    """As after a minute, which the test does not wait for: ``driven_s`` has a test of its own."""
    page, offer = visit.page, visit.page.locator(".better")
    page.get_by_role("button", name=KEEP).click()
    visit.wait_until(lambda: offer.count() == 1)
    assert not offer.is_visible()
    page.evaluate("document.querySelector('.better').classList.remove('off')")
    offer.get_by_role("button", name="Try it").click()
    visit.wait_until(lambda: visit.graph.control._config.rule == "point")
    visit.wait_until(lambda: not offer.is_visible())
    page.reload()
    visit.wait_until(lambda: visit.text(".lease .role") == "you drive")
    page.evaluate("document.querySelector('.better').classList.remove('off')")
    assert not offer.is_visible()
    assert visit.troubles == []
