"""A crowd of silent connections leaves room for who stops the robot; with real sockets."""

import asyncio
import contextlib
import http.client
import os
import re
import resource
import socket
import ssl
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from handsteer.config import DashboardConfig
from handsteer.errors import DashboardError
from handsteer.plugins.page import limits
from tests.plugins.page.served import PATIENCE_S, Site
from tests.plugins.page.sockets import PageSocket
from tests.plugins.page.test_socket_events import space, stopped
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


@pytest.mark.timeout(60)
@pytest.mark.parametrize("what", ["pipe", "device", "large file", "missing file"])
@pytest.mark.parametrize("field", ["certificate", "private_key"])
def test_a_certificate_and_its_key_are_regular_files_of_limited_size(tmp_path: Path, field: str, what: str) -> None:
    path, regular = tmp_path / "given.pem", tmp_path / "certificate.pem"
    regular.write_text("not looked at before both files are known to be regular ones")
    if what == "pipe":
        os.mkfifo(path)
    elif what == "device":
        path.symlink_to("/dev/zero")
    elif what == "large file":
        with path.open("wb") as file:
            file.truncate(5_000_000_000)  # takes no space
    reason = {"large file": "it is larger than 1 MB", "missing file": "No such file"}.get(what, "it is a device or a")
    said = re.escape(f"the {field.replace('_', ' ')} {path} cannot be used for https: {reason}")
    with pytest.raises(DashboardError, match=f"^{said}"):
        limits.load_certificate(DashboardConfig(**{"certificate": regular, field: path}))


class Line(asyncio.Transport):
    """A connection of which only the address and the end are known."""

    def __init__(self, address: str, port: int) -> None:
        super().__init__({"peername": (address, port)})
        self.is_aborted = False

    def is_closing(self) -> bool:
        return self.is_aborted

    def abort(self) -> None:
        self.is_aborted = True


def test_only_so_many_unknown_connections_stay_open_and_known_ones_all() -> None:
    """The guard: the limits in ``Connections.add``."""

    async def come() -> tuple[Line, list[int]]:
        connections, viewer = limits.Connections(), Line("192.0.2.1", 1)
        connections.add(viewer)
        with connections.serving(("192.0.2.1", 1), is_known=True):
            pass
        crowds = [
            [Line("198.51.100.1", port) for port in range(300)],
            [Line(f"203.0.113.{port % 100}", port) for port in range(300)],
        ]
        counts = []
        for crowd in crowds:
            for line in crowd:
                connections.add(line)
            counts.append(sum(not line.is_aborted for each in crowds for line in each))
        return viewer, counts

    viewer, counts = asyncio.run(come())
    assert not viewer.is_aborted
    assert counts[0] - 300 <= limits.MOST_OF_ONE_ADDRESS
    assert counts[1] <= limits.MOST_UNKNOWN


def test_a_silent_connection_is_closed_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard: ``close_if_silent``."""
    monkeypatch.setattr(limits, "FIRST_REQUEST_S", 0.0)

    async def come() -> list[bool]:
        connections, lines = limits.Connections(), [Line("192.0.2.1", port) for port in (1, 2)]
        for line in lines:
            connections.add(line)
        with connections.serving(("192.0.2.1", 1), is_known=False):
            await asyncio.sleep(0.01)
        return [line.is_aborted for line in lines]

    assert asyncio.run(come()) == [False, True]
