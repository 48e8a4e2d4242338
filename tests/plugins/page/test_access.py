import asyncio
import http.client
import socket
import ssl
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import websockets
from hypothesis import given
from hypothesis import strategies as st
from nicegui import Client

from handsteer.config import DashboardConfig
from handsteer.errors import DashboardError
from handsteer.plugins.page.access import Access
from tests.plugins.page.network import cookies_of
from tests.plugins.page.served import PATIENCE_S, Site

PLACES = (
    "/",
    "/teach",
    "/settings",
    "/study",
    "/camera.mjpg",
    "/assets/page.js",
    "/_nicegui_ws/socket.io/?EIO=4&transport=polling",
)


@pytest.fixture
def open_site() -> Iterator[Site]:
    """One that other machines may reach."""
    site = Site(host="0.0.0.0")
    try:
        yield site
    finally:
        site.close()


def token_of(site: Site) -> str:
    return urlsplit(site.url).query.removeprefix("token=")


def status_of_websocket(site: Site, **headers: str) -> int:
    """Return 101 when the page's own websocket opens, else the status of the answer."""

    async def knock() -> int:
        address = f"ws://127.0.0.1:{site.port}/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
        try:
            async with websockets.connect(address, additional_headers=headers, open_timeout=PATIENCE_S):
                return 101
        except websockets.InvalidStatus as refusal:
            return refusal.response.status_code

    with ThreadPoolExecutor(1) as another:  # on this thread, a browser's loop may run
        return another.submit(asyncio.run, knock()).result()


def test_this_machine_alone_is_served_by_default_and_needs_no_token(site: Site) -> None:
    assert site.url == f"http://127.0.0.1:{site.port}"
    for path in PLACES:
        response = site.get(path, Host="localhost")
        assert response.status == 200
        response.close()
        assert site.get(path, Host="evil.example").status == 400
    assert status_of_websocket(site) == 101


def test_pages_of_other_sites_are_kept_out(site: Site) -> None:
    host = f"127.0.0.1:{site.port}"
    for path in PLACES:
        assert site.get(path, Origin="https://evil.example").status == 403
        assert site.get(path, Origin="null").status == 403
        assert site.get(path, **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}).status == 403
        # Another port of this machine is of the same site, and another's.
        assert site.get(path, **{"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "no-cors"}).status == 403
        for frame in ("iframe", "frame", "embed", "object"):
            for place in ("cross-site", "same-site", "same-origin"):
                framed = {"Sec-Fetch-Site": place, "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": frame}
                assert site.get(path, **framed).status == 403
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
    assert site.get("/", **link).status == 200
    assert site.get("/", Host=host, Origin=f"http://{host}").status == 200
    assert status_of_websocket(site, Origin="https://evil.example") == 403
    assert status_of_websocket(site, Origin=f"http://{host}") == 101


def test_from_elsewhere_nothing_is_to_be_had_without_the_token(open_site: Site) -> None:
    wrong = "x" * len(token_of(open_site))
    for path in PLACES:
        assert open_site.get(path).status == 401
        assert open_site.get(path, Authorization=f"Bearer {wrong}").status == 401
        assert open_site.get(path, Cookie=f"handsteer_{open_site.port}={wrong}").status == 401
        response = open_site.get(path, Authorization=f"Bearer {token_of(open_site)}")
        assert response.status == 200
        response.close()
    assert open_site.get(f"/?token={wrong}").status == 401
    assert status_of_websocket(open_site) == 401
    assert status_of_websocket(open_site, Cookie=f"handsteer_{open_site.port}={wrong}") == 401


def test_the_printed_address_lets_a_browser_in_and_hides_its_token(open_site: Site) -> None:
    response = open_site.get(f"/?token={token_of(open_site)}")
    assert response.status == 303
    assert response.headers["Location"] == "/"
    cookie = response.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    pair = cookie.partition(";")[0]
    assert open_site.get("/", Cookie=pair).status == 200
    assert status_of_websocket(open_site, Cookie=pair) == 101
    assert status_of_websocket(open_site, Cookie=pair, Origin="https://evil.example") == 403


@pytest.mark.parametrize("others", ['settings={"a": 1}', "list[0]=1", 'name="a "b', ";=;"])
def test_cookies_of_other_programs_of_the_machine_do_not_hide_ours(open_site: Site, others: str) -> None:
    pair = open_site.get(f"/?token={token_of(open_site)}").headers["Set-Cookie"].partition(";")[0]
    assert open_site.get("/", Cookie=f"{others}; {pair}").status == 200


def test_what_follows_the_token_is_a_status_of_this_server(open_site: Site) -> None:
    for path in ("//evil.example/", "///evil.example/", "/%2Fevil.example/", "/\\evil.example"):
        response = open_site.get(f"{path}?token={token_of(open_site)}&a=b")
        assert response.status == 303
        place = response.headers["Location"]
        assert place.startswith("/")
        assert not place.startswith(("//", "/\\"))
        assert place.endswith("?a=b")


def test_the_token_is_in_no_log(open_site: Site, caplog: pytest.LogCaptureFixture) -> None:
    token = token_of(open_site)
    bearer = {"Authorization": f"Bearer {token}"}
    for path in (f"/no/such/page?token={token}", f"/no/such/page?a=b&token={token}", f"/?x[]=1&%74oken={token}"):
        open_site.get(path, **bearer).read()
    assert token not in caplog.text
    assert "/no/such/page" in caplog.text


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_every_answer_keeps_itself_out_of_frames_and_says_nothing_of_the_server(host: str) -> None:
    site = Site(host=host)
    try:
        for path in (*PLACES, "/no/such/page", "/assets/none.js", "/_nicegui_ws/socket.io/?EIO=9"):
            for headers in ({}, {"Origin": "https://evil.example"}, {"Host": "evil.example"}):
                response = site.get(path, **headers)
                check_headers(response)
                response.close()
        with socket.create_connection(("127.0.0.1", site.port), timeout=PATIENCE_S) as connection:
            connection.sendall(b"NONSENSE\r\n\r\n")
            response = http.client.HTTPResponse(connection)
            response.begin()
            assert response.status == 400
            check_headers(response)
    finally:
        site.close()


def check_headers(response: http.client.HTTPResponse) -> None:
    policy = response.headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in policy
    assert "default-src 'none'" in policy
    assert response.headers["X-Frame-Options"] == "DENY"
    assert response.headers["X-Content-Type-Options"] == "nosniff"
    assert response.headers["Referrer-Policy"] == "no-referrer"
    assert "Server" not in response.headers


def test_each_browser_has_a_session_that_nobody_else_can_make(site: Site) -> None:
    first, second = (cookies_of(site.get("/")) for _ in range(2))
    assert first != second
    assert cookies_of(site.get("/", Cookie=first)) == ""
    tampered = first[:-1] + ("0" if first[-1] != "0" else "1")
    for cookie in (
        tampered,
        f"handsteer_{site.port}_session=\xe9.x",
        f"handsteer_{site.port}_session={'a' * 5000}",
        ";=;",
    ):
        assert cookies_of(site.get("/", Cookie=cookie)) not in ("", first)


def test_the_token_is_wanted_on_this_machine_too_where_that_is_set() -> None:
    site = Site(token="always")
    try:
        assert site.url.startswith("http://127.0.0.1:")
        assert site.get("/").status == 401
        assert site.get("/", Host="evil.example").status == 400
        assert site.get(f"/?token={token_of(site)}").status == 303
        assert site.get("/", Authorization=f"Bearer {token_of(site)}").status == 200
        assert not DashboardConfig(token="always").opens_browser
        assert DashboardConfig().opens_browser
    finally:
        site.close()


def test_https_with_a_certificate_of_ones_own(tmp_path: Path) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"]
    subprocess.run(
        [*command, "-addext", "subjectAltName=DNS:localhost", "-keyout", key, "-out", certificate],
        check=True,
        capture_output=True,
    )
    site = Site(certificate=certificate, private_key=key)
    try:
        assert site.url == f"https://127.0.0.1:{site.port}"
        trust = ssl.create_default_context(cafile=str(certificate))
        connection = http.client.HTTPSConnection("localhost", site.port, timeout=PATIENCE_S, context=trust)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
    finally:
        site.close()


def test_a_certificate_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    with pytest.raises(DashboardError, match=r"gone\.pem cannot be used for https: No such file"):
        Site(certificate=tmp_path / "gone.pem")
    (tmp_path / "no.pem").write_text("no certificate")
    with pytest.raises(DashboardError, match=r"no\.pem cannot be used for https"):
        Site(certificate=tmp_path / "no.pem")
    with pytest.raises(DashboardError, match=r"private_key is of no use without"):
        Site(private_key=tmp_path / "no.pem")


@pytest.mark.parametrize("host", ["203.0.113.7", "no.such.host.invalid"])
def test_an_address_of_another_machine_is_named(host: str) -> None:
    with pytest.raises(DashboardError, match=rf"^--host {host} is not an address of this machine"):
        Site(host=host)


@pytest.mark.parametrize(
    ("host", "alone"), [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False)]
)
def test_what_only_this_machine_can_reach(host: str, alone: bool) -> None:
    assert (Access.to(host).token is None) is alone


@given(st.text())
def test_only_the_token_is_admitted(given_text: str) -> None:
    access = Access.to("0.0.0.0")
    assert not access.admits(given_text)
    assert not access.admits(None)
    assert access.admits(access.token)


def test_recordings_are_for_those_with_the_token_only(open_site: Site) -> None:
    for path in ("/recordings/drive.mcap", "/recordings/drive.mcap/report"):
        assert open_site.get(path).status == 401
        assert open_site.get(path, Authorization=f"Bearer {token_of(open_site)}").status == 404


@pytest.mark.parametrize("frame", ["IFRAME", "Frame", " iframe ", "OBJECT", "document, iframe"])
def test_frames_are_refused_in_any_case_of_letters(site: Site, frame: str) -> None:
    assert site.get("/", **{"Sec-Fetch-Dest": frame}).status == 403


@pytest.mark.parametrize("there", ["cross-site", "Cross-Site", "SAME-SITE", "none, cross-site", "nonsense"])
def test_other_sites_are_refused_in_any_case_of_letters(site: Site, there: str) -> None:
    assert site.get("/", **{"Sec-Fetch-Site": there, "Sec-Fetch-Mode": "no-cors"}).status == 403
    assert site.get("/", **{"Sec-Fetch-Site": "SAME-ORIGIN", "Sec-Fetch-Mode": "no-cors"}).status == 200


HOSTS = ("", "a, b", "127.0.0.1, evil.example", "127.0.0.1 a", "user@127.0.0.1", "127.0.0.1/x", "127.0.0.1:x", "[::1")


@pytest.mark.parametrize("host", HOSTS)
def test_a_host_that_is_none_is_refused(site: Site, host: str) -> None:
    assert site.get("/", Host=host).status == 400


def test_two_hosts_are_refused(site: Site) -> None:
    with socket.create_connection(("127.0.0.1", site.port), PATIENCE_S) as connection:
        own = f"Host: 127.0.0.1:{site.port}\r\n"
        connection.sendall(f"GET /settings HTTP/1.1\r\n{own}{own}Connection: close\r\n\r\n".encode())
        assert b" 400 " in connection.recv(100)


@pytest.mark.parametrize("there", ["cross-site", "same-site", "CROSS-SITE"])
@pytest.mark.parametrize(("language", "words"), [("en", "Continue to handsteer"), ("de-CH, en;q=0.5", "Weiter zu")])
def test_a_link_of_another_site_builds_no_page_but_leads_to_it(
    site: Site, there: str, language: str, words: str
) -> None:
    pages = set(Client.instances)
    navigation = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document", "Accept-Language": language}
    answer = site.get("/settings?a=%22%3E%3Cscript%3E", **navigation, **{"Sec-Fetch-Site": there})
    text = answer.read().decode()
    assert answer.status == 200
    assert f'<a href="/settings?a=%22%3E%3Cscript%3E">{words}' in text
    assert not set(Client.instances) - pages
    assert site.get("/settings", **navigation, **{"Sec-Fetch-Site": "same-origin"}).status == 200
    assert len(set(Client.instances) - pages) == 1
    door = site.get("//evil.example/%22%3E", **navigation, **{"Sec-Fetch-Site": there}).read().decode()
    assert '<a href="/evil.example/%22%3E">' in door
