"""What a visit leaves behind: nothing, whether the browser has joined its page or not."""

import gc
import itertools
import logging
import urllib.parse
from collections import Counter

import pytest
from nicegui import Client

from handsteer.plugins.page.limits import MOST_UNCONNECTED_PAGES
from handsteer.plugins.page.world_state import Sample
from tests.plugins.page.network import client_of, join_query
from tests.plugins.page.served import Site
from tests.plugins.page.sockets import PageSocket
from tests.processes import eventually

PATHS = ("/", "/teach", "/settings", "/study")
VISITS = 18


def visit(site: Site, number: int) -> None:
    """Come, look and leave, as another tab each time."""
    html, cookies = site.page(PATHS[number % len(PATHS)])
    with PageSocket(site, html, cookies, join_query(client_of(html), tab=f"tab-{number}")) as page:
        assert page.joined
        page.answered("ack", {"client_id": page.client, "next_message_id": 0})


@pytest.fixture
def others() -> set[str]:
    """Pages of earlier tests of this process, which NiceGUI keeps."""
    return set(Client.instances)


def objects() -> Counter[str]:
    """Return how many there are of each kind, but for what is bounded by its own, or kept by pytest."""
    urllib.parse.clear_cache()  # type: ignore[attr-defined]
    gc.collect()
    kinds = [type(each) for each in gc.get_objects() if not isinstance(each, (Sample, logging.LogRecord))]
    return Counter(f"{kind.__module__}.{kind.__qualname__}" for kind in kinds)


@pytest.mark.exhaustive
@pytest.mark.slow
def test_a_visit_leaves_nothing_behind(site: Site, others: set[str]) -> None:
    def visit_all() -> Counter[str]:
        for _ in range(VISITS):
            visit(site, next(numbers))
        eventually(lambda: Client.instances.keys() <= others, what="the pages to be gone")
        return objects()

    numbers = itertools.count()
    visit_all()  # what comes with the first visits, and stays, is no more with the next ones
    before = visit_all()
    visit_all()

    def grown() -> dict[str, int]:
        return {kind: more for kind, more in (objects() - before).items() if more >= VISITS // len(PATHS)}

    # What a tab stored is looked through every ten seconds.
    eventually(lambda: not grown(), what=f"nothing of {VISITS} visits to be left; there is {grown()}")


@pytest.mark.slow
def test_pages_that_nobody_joins_do_not_pile_up(site: Site, others: set[str]) -> None:
    html, cookies = site.page()
    with PageSocket(site, html, cookies) as page:
        for _ in range(MOST_UNCONNECTED_PAGES + 5):
            site.page()
        newest, cookies = site.page()
        assert len(Client.instances.keys() - others) <= MOST_UNCONNECTED_PAGES + 1
        assert page.client in Client.instances, "who has joined stays"
        with PageSocket(site, newest, cookies) as other:
            assert other.joined
