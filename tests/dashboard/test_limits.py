"""A crowd of silent connections leaves room for who stops the robot; with real sockets."""

import contextlib
import http.client
import resource
import socket
import ssl
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from handsteer.dashboard import limits
from tests.dashboard.served import PATIENCE_S, Site
from tests.dashboard.sockets import PageSocket
from tests.dashboard.test_socket_events import space, stopped
from tests.processes import eventually

CROWD = 1400


@contextlib.contextmanager
def crowd(port: int, count: int = CROWD, words: bytes = b"") -> Iterator[list[socket.socket]]:
    """Open ``count`` connections, on each of which only ``words`` are said."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, max(soft, 2 * count + 500)), hard))
    with contextlib.ExitStack() as stack:
        silent = []
        for _ in range(count):
            each = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S))
            if words:
                with contextlib.suppress(OSError):
                    each.sendall(words)
            silent.append(each)
        yield silent
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def is_open(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return connection.recv(1) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


@pytest.mark.parametrize("words", [b"", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"], ids=["silent", "half a header"])
def test_a_crowd_shuts_nobody_out(site: Site, words: bytes) -> None:
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page, crowd(site.port, words=words) as silent:
        eventually(lambda: sum(map(is_open, silent)) <= limits.MOST_OF_ONE_ADDRESS, PATIENCE_S)
        assert site.get("/").status == 200  # who comes for the first time
        assert site.get("/", Cookie=cookies).status == 200
        page.say("event", space(html, page.client))
        eventually(lambda: stopped(site), PATIENCE_S)


def test_who_is_known_is_not_sent_away_for_strangers(site: Site) -> None:
    _, cookies = site.page()
    known = http.client.HTTPConnection("127.0.0.1", site.port, timeout=PATIENCE_S)
    known.request("GET", "/camera.mjpg", headers={"Cookie": cookies})
    pictures = known.getresponse()
    with crowd(site.port, 200):
        for _ in range(5):
            assert pictures.read(1000)
    pictures.close()


@pytest.mark.slow
def test_a_connection_on_which_nothing_is_said_is_closed(site: Site) -> None:
    with crowd(site.port, 1) as (silent,):
        eventually(lambda: not is_open(silent), limits.FIRST_REQUEST_S + PATIENCE_S)


def test_a_handshake_of_https_that_does_not_come_is_not_waited_for(tmp_path: Path) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    site = Site(certificate=certificate, private_key=key)
    try:
        with crowd(site.port, 300) as silent:
            eventually(lambda: sum(map(is_open, silent)) <= limits.MOST_OF_ONE_ADDRESS, PATIENCE_S)
            trust = ssl._create_unverified_context()
            connection = http.client.HTTPSConnection("127.0.0.1", site.port, timeout=PATIENCE_S, context=trust)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
    finally:
        site.close()
