"""A page of somebody else, in a real browser, that shows this one in a frame: it shows nothing, and steers nothing."""

import http.server
import threading
from collections.abc import Iterator

import pytest
from playwright.sync_api import Error, Frame

from handsteer.config import load
from handsteer.graph import Graph
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import page_process
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, WINDOW

pytestmark = NEEDS_A_BROWSER

TRAP = """<!doctype html><title>A game</title>
<style>iframe, embed, object { position: fixed; inset: 0; width: 100%; height: 100%; opacity: 0.01 }</style>
<img id="picture" src="TARGET/camera.mjpg">
<KIND id="trap" src="TARGET" data="TARGET"></KIND>"""


@pytest.fixture
def url() -> Iterator[str]:
    config = load(
        base={
            "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
            "virtual_hand": {"script": "NONE:600"},
            "dashboard": {"port": 0},
        }
    )
    with Graph(config, steering=False) as graph:
        graph.start()
        page = page_process()
        try:
            yield page.serve(graph)
        finally:
            page.stop()


@pytest.fixture
def foreign(url: str) -> Iterator[int]:
    """The port of a foreign site, whose pages show ours in a frame of the kind that their path names."""

    class Site(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            content = TRAP.replace("TARGET", url).replace("KIND", self.path.strip("/") or "iframe").encode()
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Site)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"], ids=["another port", "another site"])
@pytest.mark.parametrize("kind", ["iframe", "embed", "object"])
def test_a_foreign_page_shows_and_steers_nothing(url: str, foreign: int, host: str, kind: str) -> None:
    with a_browser() as browser:
        page = browser.new_page(viewport=WINDOW)
        page.set_default_timeout(PATIENCE_MS)
        requests: list[int | None] = []
        page.on("response", lambda answer: requests.append(answer.status) if answer.url.startswith(url) else None)
        page.goto(f"http://{host}:{foreign}/{kind}", wait_until="load")
        assert requests
        assert set(requests) == {403}
        assert all(not shows_the_page(frame) for frame in page.frames)
        assert page.evaluate("document.getElementById('picture').naturalWidth") == 0
        # To follow a link to the page is all right.
        page.goto(url)
        page.locator(".banner").wait_for()


def shows_the_page(frame: Frame) -> bool:
    try:
        return bool(frame.locator(".pad, .banner, button").count())
    except Error:  # the browser has done away with it: what it was for was refused
        return False
