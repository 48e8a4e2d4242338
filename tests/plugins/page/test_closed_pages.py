"""Closed pages are freed without a search for garbage, and such a search waits until the robot stands."""

import asyncio
import gc
import mmap
import urllib.request
import weakref
from collections.abc import Callable, Iterator

import pytest
from nicegui import Client, core

from handsteer.config import load
from handsteer.graph import Graph
from handsteer.plugins.page import closed_pages
from handsteer.plugins.page.closed_pages import Garbage, memory_mb
from handsteer.plugins.page.server import Dashboard
from tests.plugins.page.network import client_of
from tests.plugins.page.served import PATIENCE_S, remote
from tests.processes import eventually

HELD_BYTES = 64 * 1024 * 1024


def fetched(address: str) -> str:
    with urllib.request.urlopen(address, timeout=PATIENCE_S) as answer:
        return str(answer.read().decode())


def on_pages_loop(call: Callable[[], object]) -> None:
    async def called() -> None:
        call()

    assert core.loop is not None
    asyncio.run_coroutine_threadsafe(called(), core.loop).result(PATIENCE_S)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    graph = Graph(load(base={"camera": {"source": "virtual"}, "dashboard": {"port": 0}}), steering=False)
    with graph, remote(graph) as end:
        dashboard = Dashboard.of(end)
        try:
            yield dashboard.start().rstrip("/")
        finally:
            dashboard.stop()


@pytest.fixture
def no_search() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("path", ["/", "/settings", "/world", "/teach"])
def test_a_closed_page_is_freed_without_a_search(
    address: str, path: str, no_search: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(closed_pages, "_IN_USE_S", 0.0)
    page = Client.instances[client_of(fetched(f"{address}{path}"))]
    parts = [part for each in page.elements.values() for part in (each, each.props, each.style)]
    elements = [weakref.ref(part) for part in parts]
    del parts
    assert len(elements) > 150
    on_pages_loop(page.delete)
    del page

    def kept() -> list[str]:
        return [repr(type(each)) for each in (one() for one in elements) if each is not None]

    # A few are held by our own panels, emptied.
    eventually(lambda: len(kept()) <= len(elements) // 5, PATIENCE_S, what=f"not to keep {kept()}")


@pytest.fixture
def garbage() -> Iterator[Garbage]:
    before, was_enabled = gc.get_threshold(), gc.isenabled()
    started = Garbage()
    started.start(0.0)
    yield started
    gc.unfreeze()
    gc.set_threshold(*before)
    if not was_enabled:
        gc.disable()


class Cycle:
    def __init__(self) -> None:
        self.me = self


def old_garbage() -> "weakref.ref[Cycle]":
    """Return what is no more used, and has outlived the searches among young objects."""
    cycle = Cycle()
    gc.collect(1)
    return weakref.ref(cycle)


def test_garbage_waits_while_the_robot_moves(garbage: Garbage, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = old_garbage()
    monkeypatch.setattr(closed_pages, "memory_mb", lambda: memory_mb() + 60.0)
    assert not any(garbage.look(float(now_s), stands=False, pages=1) for now_s in range(60))
    assert lost() is not None
    assert not garbage.look(60.0, stands=True, pages=1), "it may start again"
    assert garbage.look(61.5, stands=True, pages=1)
    assert lost() is None


def test_garbage_waits_while_many_pages_make_a_search_long(garbage: Garbage, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = old_garbage()
    monkeypatch.setattr(closed_pages, "memory_mb", lambda: memory_mb() + 100.0)
    assert not any(garbage.look(float(now_s), stands=True, pages=4) for now_s in range(60))
    assert lost() is not None
    assert garbage.look(60.0, stands=True, pages=3)
    assert lost() is None


def test_garbage_stays_while_there_is_little(garbage: Garbage) -> None:
    lost = old_garbage()
    assert not any(garbage.look(float(now_s), stands=True, pages=1) for now_s in range(60))
    assert lost() is not None


def test_memory_is_bounded_even_while_the_robot_moves(garbage: Garbage, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = old_garbage()
    monkeypatch.setattr(closed_pages, "memory_mb", lambda: memory_mb() + 420.0)
    assert garbage.look(1.0, stands=False, pages=1)
    assert lost() is None


def test_memory_is_what_the_process_holds() -> None:
    gc.collect()  # else what other tests left may be freed meanwhile
    before = memory_mb()
    with mmap.mmap(-1, HELD_BYTES) as held:  # an array may get memory that the allocator has kept
        held[:: mmap.PAGESIZE] = bytes(HELD_BYTES // mmap.PAGESIZE)
        assert memory_mb() - before == pytest.approx(1e-6 * HELD_BYTES, rel=0.5)


def test_young_garbage_is_found_as_usual(garbage: Garbage) -> None:
    lost = weakref.ref(Cycle())
    kept = [[each] for each in range(20_000)]
    assert lost() is None
    assert len(kept) > 0
