"""Stop by a request of its own, which is answered while pages are built."""

import http.client
import threading
import time

import pytest
from nicegui import Client, core

from handsteer.plugins.page.front import Presses
from tests.plugins.page.network import client_of, cookies_of
from tests.plugins.page.served import PATIENCE_S, Site
from tests.plugins.page.sockets import PageSocket, events_of
from tests.plugins.page.test_socket_events import stopped
from tests.processes import eventually


def press(site: Site, page: str, cookies: str, number: object = 1, method: str = "POST", **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", site.port, timeout=PATIENCE_S)
    own = {"Cookie": cookies} if cookies else {}
    connection.request(method, f"/stop?page={page}&press={number}", headers={**own, **headers})
    return connection.getresponse().status


def stands(site: Site) -> bool:
    """Return whether the robot is stopped, of a site whose page may have no viewer."""
    return site.steering.is_stopped


def test_a_page_stops_the_robot_with_and_without_its_websocket(site: Site) -> None:
    html, cookies = site.page()
    assert press(site, client_of(html), cookies) == 200
    assert stands(site)


def test_stop_is_answered_while_the_pages_loop_is_busy(site: Site) -> None:
    html, cookies = site.page()
    begun, end = threading.Event(), threading.Event()

    def block() -> None:
        begun.set()
        end.wait(PATIENCE_S)

    assert core.loop is not None
    core.loop.call_soon_threadsafe(block)
    assert begun.wait(PATIENCE_S)
    try:
        assert press(site, client_of(html), cookies) == 200
        assert stands(site)
    finally:
        end.set()


def test_a_page_that_the_server_has_forgotten_stops_the_robot(site: Site) -> None:
    html, cookies = site.page()
    page = client_of(html)
    Client.instances[page].delete()  # as when its websocket was gone for some seconds
    assert page not in Client.instances
    assert press(site, page, "") == 403
    assert not stands(site)
    assert press(site, page, cookies) == 200
    assert stands(site)


def test_a_stranger_cannot_stop_by_it(site: Site) -> None:
    html, cookies = site.page()
    _, other = site.page()
    page = client_of(html)
    assert press(site, page, "") == 403
    assert press(site, page, other) == 403
    assert press(site, "", cookies) == 403
    assert press(site, "x" * 1000, cookies) == 403
    assert press(site, page, cookies, method="GET") == 405
    assert press(site, page, cookies, Origin="https://evil.example") == 403
    assert press(site, page, cookies, **{"Sec-Fetch-Site": "cross-site"}) == 403
    assert press(site, page, cookies, Host="evil.example") == 400
    assert not stands(site)


def test_with_a_token_it_is_needed() -> None:
    site = Site(token="always")
    try:
        answer = site.get(site.url.partition(str(site.port))[2])
        assert answer.status == 303
        token = next(each for each in cookies_of(answer).split("; ") if "_session" not in each)
        page = site.get("/", Cookie=token)
        session, name = cookies_of(page), client_of(page.read().decode())
        assert press(site, name, session) == 401
        assert not stands(site)
        assert press(site, name, f"{token}; {session}") == 200
        assert stands(site)
    finally:
        site.close()


def test_a_press_is_obeyed_once_however_it_comes(site: Site) -> None:
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page:
        element, listener = events_of(html)["space"][0]
        event = {"id": element, "client_id": page.client, "listener_id": listener, "args": ['{"press": 7}']}
        page.answered("event", event)
        eventually(lambda: stopped(site), PATIENCE_S)
        node = site.dashboard.context.node.join("test")
        assert node is not None
        node.reset(page.client)
        for _ in range(3):
            assert press(site, page.client, cookies, 7) == 200
            page.answered("event", event)
        assert not stands(site)  # repetitions of a press that was before the reset
        assert press(site, page.client, cookies, 8) == 200
        assert stands(site)
        for nonsense in ("", "x", "-1", "9" * 400, "%F0%9F%96%90"):
            node.reset(page.client)
            assert press(site, page.client, cookies, nonsense) in (200, 403)
            assert stands(site) or len(nonsense) > 300


def test_a_press_that_fails_is_obeyed_again() -> None:
    presses, done = Presses(), []

    def fail() -> None:
        raise OSError

    with pytest.raises(OSError):
        presses.obey("page", 1, fail)
    for _ in range(2):
        presses.obey("page", 1, lambda: done.append(time.monotonic()))
    assert len(done) == 1


def test_presses_of_many_pages_take_little_memory() -> None:
    presses = Presses()
    for number in range(5000):
        presses.obey(f"page {number}", 1, lambda: None)
    assert len(presses) == 1000
