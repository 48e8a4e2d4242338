"""Everything that the pages listen to, told by a stranger's script in the shape of events, with anything in it."""

import itertools
import json
import logging
import random
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.server import Dashboard
from tests.fuzz import corpus
from tests.fuzz.mutants import CASES, mutants
from tests.plugins.page.served import PATIENCE_S, Site, remote
from tests.plugins.page.sockets import PageSocket, events_of
from tests.plugins.study.plans import a_task
from tests.processes import eventually

NESTED = json.loads("[" * 500 + "]" * 500)
VALUES: tuple[object, ...] = (
    None, True, 0, -1, 0.5, 1e308, 2**63, "", "Stop", "x" * 5000, "\x1b[2J\n", "../../etc/passwd", [], [1, 2], [[[]]],
    {}, {"value": 0}, {"value": 99}, {"value": "x"}, {"x": 1, "y": "1", "at": 1e400}, {"x": 0.1, "y": 0.2, "at": 1},
    {"name": "w.yaml", "text": corpus.ALIASES}, {"name": 1, "text": corpus.MERGES}, {"name": "w", "text": "[" * 9999},
    {"words": {"a": 1}}, {"object_id": "x", "x": "1", "y": None, "z": 1}, "rtsp://a:b@c/", "9" * 5000, ".nan",
    NESTED, {"value": NESTED}, {"section": NESTED, "index": NESTED}, {"name": "w", "text": NESTED},
)  # fmt: skip


class Whole(Site):
    """The page of a whole graph, which does not run: what is done by hand is all that happens."""

    def __init__(self, graph: RemoteGraph) -> None:
        self.dashboard = Dashboard.of(graph)
        self.url = self.dashboard.start()
        self.port = urlsplit(self.url).port or 0

    def close(self) -> None:
        self.dashboard.stop()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("work")
        patch.chdir(folder)
        config = load(base={"camera": {"source": "virtual"}, "dashboard": {"port": 0}, "teach": {}})
        with Graph(config, steering=False) as graph, remote(graph) as page:
            page.study = a_task(folder)
            site = Whole(page)
            yield site
            site.close()


def said(chance: random.Random) -> list[str]:
    """Return the arguments of an event: texts that should be JSON."""
    values = [chance.choice(VALUES) for _ in range(chance.choice((0, 1, 1, 1, 1, 2)))]
    texts = [json.dumps(value) for value in values]
    if chance.random() < 0.2 and texts:
        texts[0] = next(itertools.islice(mutants([texts[0].encode()], 2, chance.randrange(2**31)), 1, None)).decode(
            "utf-8", "replace"
        )
    return texts


@pytest.mark.parametrize("path", ["/", "/teach", "/settings", "/study", "/world"])
def test_nothing_that_is_said_keeps_the_page_from_stopping_the_robot(
    whole: Whole, path: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    chance = random.Random(0)
    html, cookies = whole.page(path)
    events = events_of(html)
    listeners = [each for kind, both in events.items() if kind != "space" for each in both]
    with PageSocket(whole, html, cookies) as page:
        for number in range(CASES):
            element, listener = chance.choice(listeners)
            event = {"id": element, "client_id": page.client, "listener_id": listener, "args": said(chance)}
            if number % 50:
                page.say("event", event)
            else:
                page.answered("event", event)
        node = whole.dashboard.context.node.join("test")
        assert node is not None
        node.reset(page.client)
        element, listener = events["space"][0]
        page.answered("event", {"id": element, "client_id": page.client, "listener_id": listener, "args": ["{}"]})
        eventually(lambda: node.state().viewers.stands, PATIENCE_S)
    messages = [record.getMessage() for record in caplog.records]
    assert len(messages) < 60, messages
    assert all(len(each) < 500 and each.isprintable() for each in messages)
    assert not any(record.exc_info for record in caplog.records)
