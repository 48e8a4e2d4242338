"""What viewers cost, and what becomes of a robot whose driver is gone."""

import itertools
import json
import socket
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

from handsteer.messages import DiagnosticArray, DiagnosticStatus, Header, KeyValue
from handsteer.plugins.page.pictures import BYTES_PER_S
from tests.plugins.page.network import Relay, client_of, deaf, deaf_page, send_frame
from tests.plugins.page.served import PATIENCE_S, Site
from tests.plugins.page.test_server import read_jpeg, viewer


def wait_until(condition: Callable[[], bool], patience_s: float = 3 * PATIENCE_S) -> None:
    waiting = threading.Event()
    for _ in range(int(patience_s / 0.05)):
        if condition():
            return
        waiting.wait(0.05)
    pytest.fail("waited in vain")


def test_no_viewer_is_sent_more_than_it_should_be(site: Site) -> None:
    site.image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)  # as large as JPEG gets
    with Relay(site.port) as relay:
        site.port = relay.port
        with viewer(site) as response:
            began_s, sent = time.monotonic(), relay.to_browser
            for _ in range(30):
                read_jpeg(response)
            elapsed_s = time.monotonic() - began_s
            # Beside what a second allows: what was under way when it began, and the next one.
            assert relay.to_browser - sent <= BYTES_PER_S * elapsed_s + 1_000_000


@pytest.mark.slow
def test_viewers_who_never_read_hold_up_nobody_and_are_let_go(site: Site) -> None:
    deaf_ones = [deaf(site.port, "/camera.mjpg") for _ in range(3)]
    deaf_ones += [page := deaf_page(site.port, *site.page())]
    try:
        wait_until(lambda: site.reports.has_subscribers)  # the page has been joined
        with viewer(site) as response:
            for beat in range(100):
                report(site, str(beat))
                read_jpeg(response)
            # A page that does not answer is let go, so that nothing is kept for it.
            wait_until(lambda: not site.reports.has_subscribers and is_closed(page))
            for _ in range(10):
                read_jpeg(response)
    finally:
        for each in deaf_ones:
            each.close()


@pytest.mark.slow
def test_a_page_that_acknowledges_nothing_is_sent_nothing_more_until_it_does(site: Site) -> None:
    html, cookies = site.page()
    with deaf_page(site.port, html, cookies) as page:
        page.settimeout(1.5)
        beats = itertools.count()

        def hear() -> bytes:
            report(site, str(next(beats)))  # there is always something new to say
            try:
                return page.recv(1 << 16)
            except TimeoutError:
                return b""

        assert hear()
        wait_until(lambda: not hear())
        everything = {"client_id": client_of(html), "next_message_id": 1_000_000}
        send_frame(page, b"42" + json.dumps(["ack", everything]).encode())
        wait_until(lambda: b".0 m" in hear())


def report(site: Site, value: str) -> None:
    status = DiagnosticStatus(0, "robot", "moves freely", "", [KeyValue("path_length_m", value)])
    header = Header(site.clock.stamp(site.clock.now()), "")
    site.reports.publish(DiagnosticArray(header, [status]))


def is_closed(connection: socket.socket) -> bool:
    try:
        send_frame(connection, b"2")  # Engine.IO: ping
    except OSError:
        return True
    return False
