"""What a stranger's script says by a page's websocket: it speaks for its own page only, and harms nothing."""

import json
import logging
from typing import Any

import pytest

from tests.plugins.page.served import PATIENCE_S, Site
from tests.plugins.page.sockets import PageSocket, events_of
from tests.processes import eventually


def space(html: str, client: str) -> dict[str, object]:
    """Return what the page says when its space key is pressed, which stops the robot."""
    element, listener = events_of(html)["space"][0]
    return {"id": element, "client_id": client, "listener_id": listener, "args": ["{}"]}


def stopped(site: Site) -> bool:
    node = site.dashboard.context.node.join("test")
    assert node is not None
    return node.state().viewers.stands


def test_a_page_speaks_for_itself(site: Site) -> None:
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page:
        page.say("event", space(html, page.client))
        eventually(lambda: stopped(site), PATIENCE_S)


def test_a_page_cannot_speak_for_another(site: Site) -> None:
    (html, cookies), (other_html, other_cookies) = site.page(), site.page()
    with PageSocket(site, html, cookies) as page, PageSocket(site, other_html, other_cookies) as other:
        for name in ("event", "log", "ack", "javascript_response"):
            said = space(html, page.client) | {"level": "error", "message": "", "next_message_id": 1, "request_id": "x"}
            other.answered(name, said)
        assert not stopped(site)
        assert page.joined


@pytest.mark.parametrize("cookies", ["", "handsteer_{port}_session=a.b"], ids=["none", "made up"])
def test_a_page_is_joined_only_by_the_browser_that_it_was_served_to(site: Site, cookies: str) -> None:
    html, _ = site.page()
    _, stranger = site.page()
    for each in (cookies.format(port=site.port), stranger):
        with PageSocket(site, html, each) as socket:
            assert not socket.joined
    _, mine = site.page()
    with PageSocket(site, site.page()[0], mine, query="") as socket:
        said = {"client_id": socket.client, "tab_id": "t", "document_id": "d", "next_message_id": 0}
        assert socket.answered("handshake", said) == [False]


@pytest.mark.parametrize(
    "argument", ["[" * 9 + "]" * 9, '{"a":' * 400 + "0" + "}" * 400, "[" * 5000, json.dumps("x" * 600_000), "nothing"]
)
def test_an_argument_that_is_deep_or_long_does_not_reach_the_page(site: Site, argument: str) -> None:
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page:
        page.answered("event", space(html, page.client) | {"args": [argument]})
        page.answered("event", space(html, page.client) | {"args": ["{}", argument]})
        assert not stopped(site)
        page.answered("event", space(html, page.client) | {"args": ["[" * 8 + "]" * 8]})
        eventually(lambda: stopped(site), PATIENCE_S)


MALFORMED: tuple[list[Any], ...] = (
    [],
    [None],
    ["words"],
    [[1, 2]],
    [{}],
    [{"client_id": None}],
    [{"client_id": ["a"]}],
    [{"client_id": "CLIENT"}],
    [{"client_id": "CLIENT", "id": [1], "listener_id": "x", "args": []}],
    [{"client_id": "CLIENT", "id": 4, "listener_id": "none such", "args": ["{}"]}],
    [{"client_id": "CLIENT", "id": 4, "listener_id": "x", "args": ["{"]}],
    [{"client_id": "CLIENT", "id": 10**400, "listener_id": "x", "args": [1]}],
    [{"client_id": "CLIENT", "level": "fatal", "message": {}, "next_message_id": "x", "request_id": []}],
    [{"client_id": "CLIENT", "level": ["info"], "message": "a\n" * 9999, "next_message_id": -1}],
    [{"client_id": "CLIENT", "level": "error", "message": "\x1b[2Ja\n" * 9999}],
    [1, 2, 3],
)


def test_what_makes_no_sense_is_said_in_a_line_a_kind(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page:
        for name in ("handshake", "event", "ack", "log", "javascript_response", "no such event"):
            for said in MALFORMED:
                filled = [
                    {key: page.client if value == "CLIENT" else value for key, value in each.items()}
                    if isinstance(each, dict)
                    else each
                    for each in said
                ]
                page.say(name, *filled)
        page.say("event", space(html, page.client))
        eventually(lambda: stopped(site), PATIENCE_S)
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) <= 10, messages
    assert all(len(each) < 500 and each.isprintable() for each in messages)
    assert not any(record.exc_info for record in caplog.records)


@pytest.mark.parametrize(
    "packet",
    ["4", "42", "42[", '42[""]', "45", "451-[]", "4999", "x", "", b"\x00\xff", '42["event"', "43[]", "44", "6"],
)
def test_packets_that_are_none_end_nothing_but_their_own_websocket(
    site: Site, packet: str | bytes, caplog: pytest.LogCaptureFixture
) -> None:
    html, cookies = site.page()
    other_html, other_cookies = site.page()
    with PageSocket(site, html, cookies) as page, PageSocket(site, other_html, other_cookies) as other:
        page.say_raw(packet)
        other.say("event", space(other_html, other.client))
        eventually(lambda: stopped(site), PATIENCE_S)
    assert not any(record.exc_info for record in caplog.records)
