"""Stop in a real browser, while the page's server is busy with other viewers."""

import contextlib
import threading
import urllib.request
from collections.abc import Iterator

import pytest
from playwright.sync_api import Route

from handsteer.messages import STOP
from tests.plugins.page.test_sticks_in_browser import PLUG_IN
from tests.plugins.page.visits import NEEDS_A_BROWSER, Visit, visiting

pytestmark = NEEDS_A_BROWSER
OPENERS = 3


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
