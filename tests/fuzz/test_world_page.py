"""The world editor, by whose inputs a stranger's script sends anything."""

import json
import logging
from collections.abc import Iterator
from unittest import mock

import pytest
from nicegui import Client

from handsteer.config import load
from handsteer.graph import Graph
from tests.fuzz.test_page import NESTED, Whole
from tests.plugins.page.served import PATIENCE_S, remote
from tests.plugins.page.sockets import PageSocket, events_of
from tests.processes import eventually

COLOURS: tuple[object, ...] = (
    NESTED, json.loads('{"a":' * 500 + "0" + "}" * 500), [[[]]],
    "x" * 100_000, "\ud800", "\x1b[2J", 10**400, None, True,
)  # fmt: skip


@pytest.fixture
def driven() -> Iterator[Whole]:
    """The page of a graph whose robot runs, so that its world can be changed."""
    config = load(base={"camera": {"source": "virtual"}, "dashboard": {"port": 0}})
    with Graph(config, steering=False) as graph, remote(graph) as page:
        graph.robot.start()
        site = Whole(page)
        yield site
        site.close()
        graph.robot.stop()


def test_no_colour_that_is_sent_ends_the_way_to_the_robot(driven: Whole, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    graph = driven.dashboard.context.graph
    assert graph is not None
    assert graph.state.world is not None
    html, cookies = driven.page("/world")
    thing = graph.state.world.obstacles[0]
    with PageSocket(driven, html, cookies) as page:
        element, listener = events_of(html)["pick"][0]
        event = {"id": element, "client_id": page.client, "listener_id": listener}
        page.answered("event", event | {"args": [json.dumps({"section": "obstacles", "index": 0})]})
        colour = eventually(lambda: colour_input(page.client), PATIENCE_S)

        def is_coloured(colours: str) -> bool:
            page.answered("event", colour | {"args": [json.dumps(colours)]})
            return bool(graph.state.world and graph.state.world.obstacles[0].colour == colours)

        eventually(lambda: is_coloured("#654321"), PATIENCE_S)  # now it drives, which is needed to change the world
        with mock.patch.object(graph, "change_world", wraps=graph.change_world) as changes:
            for value in COLOURS:
                page.say("event", colour | {"args": [json.dumps(value)]})
                page.say("log", {"client_id": page.client, "level": "info", "message": value})
            eventually(lambda: is_coloured("#123456"), PATIENCE_S)
    requested = [call.args[0].keywords["fields"]["colour"] for call in changes.call_args_list]
    assert all(isinstance(each, str) for each in requested), requested
    assert graph.state.world.obstacles[0].name == thing.name
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) < 10, messages
    assert all(len(each) < 500 and each.isprintable() for each in messages)
    assert not any(record.exc_info for record in caplog.records)


def colour_input(page: str) -> dict[str, object] | None:
    """Return an event of the colour's input on a page, without arguments."""
    for element in list(Client.instances[page].elements.values()):
        if element.props.get("type") == "color":
            listener = next(iter(element._event_listeners))
            return {"id": element.id, "client_id": page, "listener_id": listener}
    return None
