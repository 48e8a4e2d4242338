"""A first visit in a real browser: the page says that its hand is drawn, and how to drive with one's own."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import pytest
from playwright.sync_api import Page

from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER

USE, KEEP = "Use my camera", "Keep watching"
SHOWN_FRAMES = 40
MOST_CLICKS = 4
COUNT_CLICKS = "window.clicks = 0; addEventListener('click', () => window.clicks++, true)"
REFUSE = """() => {
    navigator.mediaDevices.getUserMedia = async () => { throw new DOMException("no", "NotAllowedError"); };
}"""


def a_first_minute(slideshow: Path, path: Path) -> Path:
    """Write a clip that Chromium takes for a webcam: an open palm, then Forward, over and over."""
    with slideshow.with_suffix(".labels.csv").open() as file:
        sign_of = {int(row["frame"]): row["sign"] for row in csv.DictReader(file)}
    found: dict[str, list[bytes]] = {"Stop": [], "Forward": []}
    video = cv2.VideoCapture(str(slideshow))
    for number in range(max(sign_of) + 1):
        image = video.read()[1]
        frames = found.get(sign_of.get(number, ""))
        if frames is not None and len(frames) < SHOWN_FRAMES:
            frames.append(cv2.imencode(".jpg", image)[1].tobytes())
    path.write_bytes(b"".join(frame for frames in found.values() for frame in (frames * SHOWN_FRAMES)[:SHOWN_FRAMES]))
    return path


@pytest.fixture
def visit() -> Iterator[Visit]:
    with visiting("Forward:600", camera={"fps": 5}) as visit:
        yield visit


def intro(page: Page) -> bool:
    return page.get_by_text("This is a demo hand").is_visible()


def done(page: Page) -> int:
    return page.locator(".coach li.done").count()


def test_a_visitor_drives_by_signs_and_stops_in_few_clicks(slideshow: Path, tmp_path: Path) -> None:
    clip = a_first_minute(slideshow, tmp_path / "minute.mjpeg")
    # A machine that draws the world in software, and has little time, is slow to send its camera's frames.
    patient: dict[str, Any] = {"signs": {"max_frame_age": 2.0, "dropout_hold": 1.0}, "control": {"sign_timeout": 2.0}}
    with visiting("NONE:600", webcam=clip, **patient) as visit:
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


PAUSE_PERMISSION = "navigator.permissions.query = async () => ({ state: 'prompt' })"


@pytest.mark.parametrize("path", ["/", "/settings", "/world"])
def test_ones_own_camera_stays_when_a_page_is_loaded(slideshow: Path, tmp_path: Path, path: str) -> None:
    clip = a_first_minute(slideshow, tmp_path / "minute.mjpeg")
    with visiting("NONE:600", webcam=clip, camera={"fps": 5}) as visit:
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
