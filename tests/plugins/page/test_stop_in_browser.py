"""Stop in a real browser, while the page's server is busy with other viewers."""

import contextlib
import threading
import urllib.request
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, Page, Route

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import STOP
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import page_process
from tests.plugins.page.test_layout_in_browser import CUT
from tests.plugins.page.test_sticks_in_browser import PLUG_IN, phone
from tests.plugins.page.visits import (
    NEEDS_A_BROWSER,
    PATIENCE_MS,
    PHONE,
    Visit,
    each_when_there_is_time,
    visiting,
)
from tests.processes import free_port

pytestmark = NEEDS_A_BROWSER
OPENERS = 3
QUIET = {"camera": {"source": "virtual", "width": 320, "height": 240, "fps": 5}, "virtual_hand": {"script": "Stop:600"}}


@contextlib.contextmanager
def others_open_settings(visit: Visit) -> Iterator[None]:
    end = threading.Event()
    address = f"{visit.page.url.rstrip('/')}/settings"

    def keep_opening() -> None:
        while not end.is_set():
            with contextlib.suppress(OSError):
                urllib.request.urlopen(address, timeout=60).read()

    threads = [threading.Thread(target=keep_opening) for _ in range(OPENERS)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        end.set()
        for thread in threads:
            thread.join()


def shows(visit: Visit, stop: str) -> None:
    visit.page.wait_for_function("(stop) => (document.documentElement.dataset.stop ?? '') === stop", arg=stop)


@pytest.mark.parametrize(
    ("locale", "sent", "confirmed", "key"),
    [
        ("en-US", "Sent", "Stopped", ""),
        ("de-DE", "Gesendet", "Gestoppt", "Space"),
        ("en-US", "Sent", "Stopped", "B of a gamepad"),
    ],
)
def test_stop_shows_how_far_it_is_and_is_repeated_until_confirmed(
    locale: str, sent: str, confirmed: str, key: str
) -> None:
    with visiting("Stop:600", locale=locale, camera={"fps": 5}) as visit:
        heard = threading.Event()
        visit.graph.transport.subscribe("probe", STOP, lambda _: heard.set())
        requests: list[str] = []

        def lose(route: Route) -> None:
            requests.append(route.request.url)
            route.abort()

        with others_open_settings(visit):
            visit.page.route("**/stop?*", lose)
            if key.startswith("B"):
                visit.page.evaluate(PLUG_IN, [1])
            elif key:
                visit.page.keyboard.press(key)
            else:
                visit.page.locator(".banner .stop").click()
            shows(visit, "sent")
            assert visit.page.locator(".stop .sent").inner_text() == sent
            visit.wait_until(lambda: len(requests) >= 2)
            visit.page.unroute("**/stop?*")
            shows(visit, "confirmed")
            assert visit.page.locator(".stop .confirmed").inner_text() == confirmed
            assert heard.wait(60)
            shows(visit, "")
        assert visit.page.locator(".banner .stop").inner_text().strip() in {"Stop", "Stopp"}


def middle(element: Locator) -> tuple[float, float]:
    box = element.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


class Fingers:
    """Fingers on a screen, by number, each at a place or lifted."""

    def __init__(self, page: Page) -> None:
        self._session = page.context.new_cdp_session(page)
        self._at: dict[int, tuple[float, float]] = {}

    def put(self, number: int, x: float, y: float) -> None:
        self._at[number] = (x, y)
        self._send("touchStart")

    def move(self, number: int, x: float, y: float) -> None:
        self._at[number] = (x, y)
        self._send("touchMove")

    def lift(self, number: int) -> None:
        del self._at[number]
        self._send("touchEnd")

    def _send(self, kind: str) -> None:
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in self._at.items()]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def is_stopped(visit: Visit) -> bool:
    return visit.graph.control._safety.is_stopped


@pytest.fixture
def visit() -> Iterator[Visit]:
    with visiting("Stop:600", camera={"fps": 5}) as visit:
        yield visit


@pytest.mark.parametrize("press", ["mouse kept down", *each_when_there_is_time("mouse lifted beside", "enter")])
def test_stop_counts_when_it_is_pressed(visit: Visit, press: str) -> None:
    page, stop = visit.page, visit.page.locator(".banner .stop")
    if press == "enter":
        stop.focus()
        page.keyboard.press("Enter")
    else:
        x, y = middle(stop)
        page.mouse.move(x, y)
        page.mouse.down()
        if press == "mouse lifted beside":
            page.mouse.move(x, y + 150)
            page.mouse.up()
    visit.wait_until(lambda: is_stopped(visit))
    assert page.evaluate("press") == 1


def test_a_click_on_stop_counts_once(visit: Visit) -> None:
    visit.page.locator(".banner .stop").click()
    visit.wait_until(lambda: is_stopped(visit))
    assert visit.page.evaluate("press") == 1
    visit.page.locator(".banner .stop").click()
    assert visit.page.evaluate("press") == 2


@pytest.mark.parametrize("touch", ["second finger", *each_when_there_is_time("finger that stays", "finger that slips")])
def test_stop_is_pressed_by_any_finger(visit: Visit, touch: str) -> None:
    with phone(visit) as page:
        fingers = Fingers(page)
        page.locator(".pad").scroll_into_view_if_needed()
        if touch == "second finger":
            x, y = middle(page.locator(".pad"))
            fingers.put(1, x, y - 40)
            page.locator(".pad.held").wait_for()
        x, y = middle(page.locator(".banner .stop"))
        fingers.put(2, x, y)
        if touch == "finger that slips":
            fingers.move(2, x - 30, y + 30)
        visit.wait_until(lambda: is_stopped(visit))
        assert page.locator(".pad.held").count() == 0
    assert visit.troubles == []


def test_a_pad_that_is_held_while_the_phone_is_turned_is_let_go(visit: Visit) -> None:
    with phone(visit) as page:
        fingers = Fingers(page)
        page.locator(".pad").scroll_into_view_if_needed()
        x, y = middle(page.locator(".pad"))
        fingers.put(1, x, y - 40)
        page.locator(".pad.held").wait_for()
        page.set_viewport_size({"width": 740, "height": 390})
        page.wait_for_function("!document.querySelector('.pad.held')")
        fingers.move(1, x, y - 38)
        page.wait_for_timeout(300)
        assert page.locator(".pad.held").count() == 0


def test_a_stop_that_the_server_refuses_is_not_repeated_without_end(visit: Visit) -> None:
    """As where the browser has lost its session: then only the websocket is left, by which it counts."""
    answers: list[int] = []
    page = visit.page

    def refuse(route: Route) -> None:
        answers.append(403)
        route.fulfill(status=403)

    page.route("**/stop?*", refuse)
    page.keyboard.press("Space")
    visit.wait_until(lambda: is_stopped(visit) and bool(answers))
    page.wait_for_timeout(1000)
    assert len(answers) <= 4


def test_a_space_key_without_a_code_stops_too(visit: Visit) -> None:
    """As on-screen keyboards and remote desktops send it."""
    session = visit.page.context.new_cdp_session(visit.page)
    for kind in ("keyDown", "keyUp"):
        session.send("Input.dispatchKeyEvent", {"type": kind, "key": " ", "code": "", "windowsVirtualKeyCode": 32})
    visit.wait_until(lambda: is_stopped(visit))


def test_a_page_that_is_left_open_over_a_restart_says_that_it_knows_nothing() -> None:
    dashboard = {"port": free_port(), "token": "always"}
    with Graph(load(None, QUIET, {"dashboard": dashboard})) as graph, a_browser() as browser:
        served = page_process()
        page = browser.new_page(viewport=PHONE, locale="de-DE")
        page.set_default_timeout(PATIENCE_MS)
        page.goto(served.serve(graph))
        graph.start()
        page.locator(".banner .headline").wait_for()
        page.wait_for_function("window.socket?.connected")
        assert page.locator(".banner .lost:visible").count() == 0
        served.stop()
        page.locator(".lost.again:visible").wait_for()
        assert not page.locator(".banner .words").evaluate(CUT)
        assert not page.locator(".banner .headline").is_visible()
        served = page_process()
        served.serve(graph)
        page.locator(".lost.elsewhere:visible").wait_for()
        assert not page.locator(".banner .words").evaluate(CUT)
        page.locator(".banner .stop").click()
        page.wait_for_function("document.documentElement.dataset.stop === 'refused'")
        assert page.locator(".stop .refused").is_visible()
        page.context.close()
        served.stop()
