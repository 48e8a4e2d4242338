import http.client
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import DashboardError
from handsteer.plugins.page.pictures import next_quality, shrink
from tests.plugins.page.served import PATIENCE_S, Site


@contextmanager
def viewer(site: Site) -> Iterator[http.client.HTTPResponse]:
    response = site.get("/camera.mjpg")
    try:
        yield response
    finally:
        response.close()


def read_jpeg(response: http.client.HTTPResponse) -> np.ndarray:
    headers = http.client.parse_headers(skip_boundary(response))
    data = response.read(int(headers["Content-Length"]))
    assert response.readline() == b"\r\n"
    assert headers["Content-Type"] == "image/jpeg"
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


def skip_boundary(response: http.client.HTTPResponse) -> http.client.HTTPResponse:
    assert response.readline() == b"--frame\r\n"
    return response


def wait_until(condition: Callable[[], bool]) -> None:
    waiting = threading.Event()
    for _ in range(int(PATIENCE_S / 0.02)):
        if condition():
            return
        waiting.wait(0.02)
    pytest.fail("waited in vain")


def test_serves_the_page_with_nothing_from_elsewhere(site: Site) -> None:
    response = site.get("/")
    text = response.read().decode()
    assert response.status == 200
    assert "<title>handsteer</title>" in text
    assert "https://" not in text.replace("https://vuejs.org", "")
    for path in ("/assets/page.css", "/assets/page.js"):
        assert path in text
        assert site.get(path).status == 200


def test_streams_the_picture_as_jpeg_files(site: Site) -> None:
    with viewer(site) as response:
        assert response.headers["Content-Type"] == "multipart/x-mixed-replace; boundary=frame"
        for _ in range(3):
            picture = read_jpeg(response)
            assert picture.shape == (480, 640, 3)
            assert picture.mean(axis=(0, 1)) == pytest.approx((40, 160, 220), abs=4)


def test_shows_all_viewers_the_newest_picture(site: Site) -> None:
    with viewer(site) as first, viewer(site) as second:
        read_jpeg(first)
        site.image = np.full((240, 320, 3), 90, np.uint8)
        wait_until(lambda: read_jpeg(first).shape == (240, 320, 3))
        wait_until(lambda: read_jpeg(second).shape == (240, 320, 3))


def test_a_viewer_that_does_not_read_does_not_keep_others_from_it(site: Site) -> None:
    site.image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    with socket.create_connection(("127.0.0.1", site.port)) as deaf:
        deaf.sendall(b"GET /camera.mjpg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        with viewer(site) as response:
            for _ in range(30):
                read_jpeg(response)


def test_costs_nothing_while_nobody_watches(site: Site) -> None:
    is_wanted = site.pictures.has_subscribers or site.reports.has_subscribers
    assert not is_wanted
    with viewer(site) as response:
        read_jpeg(response)
        is_wanted = site.pictures.has_subscribers
        assert is_wanted
    wait_until(lambda: not site.pictures.has_subscribers)


def test_notices_that_a_viewer_has_left_even_when_no_picture_comes(site: Site) -> None:
    site._ended.set()
    site._camera.join()
    with socket.create_connection(("127.0.0.1", site.port)) as viewer:
        viewer.sendall(b"GET /camera.mjpg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        wait_until(lambda: site.pictures.has_subscribers)
    wait_until(lambda: not site.pictures.has_subscribers)


def test_ends_open_streams_when_it_stops() -> None:
    site = Site()
    try:
        with viewer(site) as response:
            read_jpeg(response)
            site.dashboard.stop()
            rest = response.read()  # ends, rather than waiting for ever
            assert rest.endswith(b"--frame\r\n")
    finally:
        site.close()
    with pytest.raises(ConnectionRefusedError):
        site.get("/")


def test_may_be_stopped_twice_and_served_again_on_the_same_port() -> None:
    first = Site()
    first.close()
    first.dashboard.stop()
    second = Site(port=first.port)
    try:
        assert second.get("/").status == 200
    finally:
        second.close()


def test_a_port_in_use_is_named_with_a_way_out() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(DashboardError, match=rf"^port {port} on 127\.0\.0\.1 is in use: .*--port"):
            Site(port=port)


def test_one_process_serves_one_page_at_a_time(site: Site) -> None:
    with pytest.raises(DashboardError, match="stop that one first"):
        Site()
    assert site.get("/").status == 200


@given(width=st.integers(1, 4000), height=st.integers(1, 3000))
def test_a_large_picture_is_shrunk_in_its_proportions(width: int, height: int) -> None:
    image = np.zeros((height, width, 3), np.uint8)
    shrunk_height, shrunk_width = shrink(image).shape[:2]
    assert shrunk_height * shrunk_width <= max(640 * 480, height, width)
    if min(shrunk_height, shrunk_width) >= 100:
        assert shrunk_width / shrunk_height == pytest.approx(width / height, rel=0.02)
    if height * width <= 640 * 480:
        assert shrink(image) is image


@given(quality=st.integers(40, 80), sizes=st.lists(st.integers(1_000, 300_000)))
def test_quality_falls_for_large_pictures_and_stays_in_its_range(quality: int, sizes: list[int]) -> None:
    for size in sizes:
        before, quality = quality, next_quality(quality, size)
        assert 40 <= quality <= 80
        assert quality <= before or size < 60_000
