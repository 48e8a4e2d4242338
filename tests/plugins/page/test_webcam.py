"""The browser's own webcam, in a real browser that plays photos of a real person as one."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from handsteer.config import load
from handsteer.graph import Graph
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import page_process
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, WINDOW

pytestmark = NEEDS_A_BROWSER


@pytest.fixture
def graph() -> Iterator[Graph]:
    hand = {
        "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
        "virtual_hand": {"script": "NONE:60"},
        # A machine that draws the world in software, and has little time, is slow to send its camera's frames.
        "signs": {"max_frame_age": 2.0, "dropout_hold": 1.0},
        "control": {"sign_timeout": 2.0},
    }
    config = load(base={**hand, "dashboard": {"port": 0}})
    with Graph(config, steering=False) as graph:
        graph.start()
        yield graph


@pytest.fixture
def url(graph: Graph) -> Iterator[str]:
    page = page_process()
    try:
        yield page.serve(graph)
    finally:
        page.stop()


@pytest.fixture
def browser(person: Path) -> Iterator[Browser]:
    with a_browser(person) as browser:
        yield browser


def show(browser: Browser, url: str) -> Page:
    page = browser.new_page(viewport=WINDOW)  # what is drawn takes the time in which the webcam's pictures grow old
    page.set_default_timeout(PATIENCE_MS)
    page.goto(url)
    return page


def wait_for_words(page: Page, selector: str, words: str) -> None:
    page.wait_for_function(
        "([selector, words]) => document.querySelector(selector)?.innerText.includes(words)", arg=[selector, words]
    )


def test_the_browsers_webcam_drives_until_its_page_is_closed(graph: Graph, url: str, browser: Browser) -> None:
    page = show(browser, url)
    wait_for_words(page, ".banner", "No hand is in view")
    page.get_by_role("button", name="Use my camera").click()
    wait_for_words(page, ".camera .sign", "Forward")
    wait_for_words(page, ".source", "browser's camera")
    wait_for_words(page, ".banner .headline", "Driving")
    assert page.get_by_text("Back to the virtual hand").is_visible()

    second = show(browser, url)
    second.get_by_role("button", name="Use my camera").wait_for(state="hidden")
    page.close()
    wait_until_stands(graph)
    # The robot's own camera does not come back by itself, whatever it sees.
    assert graph.cameras.source == "browser"
    wait_for_words(second, ".banner", "is off")
    second.get_by_text("Back to the virtual hand").click()
    wait_for_words(second, ".banner", "No hand seen for")


def wait_until(condition: Callable[[], bool], otherwise: str) -> None:
    waiting = threading.Event()
    for _ in range(PATIENCE_MS // 20):
        if condition():
            return
        waiting.wait(0.02)
    pytest.fail(otherwise)


def wait_until_stands(graph: Graph) -> None:
    wait_until(lambda: graph.robot.state.linear_mps == pytest.approx(0, abs=0.01), "the robot drives on")


def test_ones_own_camera_begins_at_the_start_and_not_where_the_demo_left_the_robot(browser: Browser) -> None:
    hand = {"camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15}}
    config = load(base={**hand, "virtual_hand": {"script": "Forward:4 NONE:4"}, "dashboard": {"port": 0}})
    page = page_process()
    try:
        with Graph(config, steering=False) as graph:
            url = page.serve(graph)
            graph.start()
            shown = show(browser, url)
            # The demo shows it again and again: a machine that is busy may stop the robot before it has come far.
            wait_until(lambda: graph.robot.state.truth.x > 0.2, "the robot has not left the start")
            shown.get_by_role("button", name="Use my camera").click()
            wait_until(
                lambda: graph.cameras.source == "browser" and graph.robot.state.truth.x < 0.1,
                "the robot is still where the demo left it",
            )
    finally:
        page.stop()


def test_only_who_drives_gives_a_camera(graph: Graph, url: str, browser: Browser) -> None:
    first, second = show(browser, url), show(browser, url)
    buttons = [page.get_by_role("button", name="Use my camera") for page in (first, second)]
    for button in buttons:
        button.wait_for()
    buttons[0].click()
    wait_for_words(first, ".camera .sign", "Forward")
    viewer = second.evaluate("window.clientId")
    second.evaluate("viewer => giveCamera(viewer)", viewer)
    wait_for_words(second, ".offer .trouble", "only the driver can share a camera")
    second.get_by_role("button", name="Ask to drive").click()
    first.get_by_text("Hand over").click()
    wait_for_words(first, ".offer .trouble", "another viewer drives now")
    second.evaluate("viewer => giveCamera(viewer)", viewer)
    wait_for_words(second, ".camera .sign", "Forward")


def test_a_browser_without_a_webcam_says_so(url: str) -> None:
    with a_browser() as browser:
        page = show(browser, url)
        page.get_by_role("button", name="Use my camera").click()
        wait_for_words(page, ".offer .trouble", "Plug one in, or open this page on a phone")


STILL_CAMERA = """
  delete HTMLVideoElement.prototype.requestVideoFrameCallback;
  const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 48 });
  canvas.getContext("2d").fillRect(0, 0, 64, 48);
  const stream = canvas.captureStream(0);
  navigator.mediaDevices.getUserMedia = async () => stream;
  window.takePicture = (colour) => {
    const paint = canvas.getContext("2d");
    paint.fillStyle = colour;
    paint.fillRect(0, 0, 64, 48);
    stream.getTracks()[0].requestFrame();
  };
  window.sent = 0;
  const post = Worker.prototype.postMessage;
  Worker.prototype.postMessage = function (message, ...rest) {
    if (message.picture) window.sent++;
    return post.call(this, message, ...rest);
  };
"""


def test_a_browser_that_does_not_tell_of_new_pictures_sends_each_once_too(url: str) -> None:
    with a_browser() as browser:
        page = browser.new_page(viewport=WINDOW)
        page.set_default_timeout(PATIENCE_MS)
        page.add_init_script(STILL_CAMERA)
        page.goto(url)
        page.get_by_role("button", name="Use my camera").wait_for()
        page.evaluate("setInterval(() => window.sent || takePicture('red'), 100)")  # until it is listened to
        page.get_by_role("button", name="Use my camera").click()
        page.wait_for_function("window.sent > 0")
        sent = -1
        while sent != page.evaluate("window.sent"):  # until what was painted meanwhile has come
            sent = page.evaluate("window.sent")
            page.wait_for_timeout(1000)
        for colour in ("green", "blue"):
            before = page.evaluate("window.sent")
            page.wait_for_timeout(1000)  # thirty times as long as a picture takes
            assert page.evaluate("window.sent") == before
            page.evaluate("takePicture", colour)
            page.wait_for_function("before => window.sent === before + 1", arg=before)
