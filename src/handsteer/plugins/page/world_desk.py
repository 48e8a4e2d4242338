"""Changes of the robot's world by one viewer, with undo and redo."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Literal

from handsteer.errors import HandsteerError
from handsteer.plugins.page.editing import replace
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.robots.world import Change, World

MOST_STEPS = 50
"""The oldest changes beyond these cannot be undone."""

_ANSWER_TIMEOUT_S = 5.0


Step = Literal[-1, 1]
"""Undo, or redo."""


class History:
    """The present world between those before and after it; forgotten when the world was changed by others."""

    def __init__(self) -> None:
        self._worlds: list[World] = []  # oldest first
        self._at = 0  # the present one

    def note(self, before: World, now: World) -> None:
        """Remember the change from ``before`` to ``now``."""
        self.follow(before)
        if now != before:
            self._worlds = [*self._worlds[: self._at + 1][-MOST_STEPS:], now]
            self._at = len(self._worlds) - 1

    def follow(self, now: World) -> None:
        """Forget everything if ``now`` is not the result of the last change."""
        if not self._worlds or now != self._worlds[self._at]:
            self._worlds, self._at = [now], 0

    def to(self, step: Step) -> World | None:
        """Return the world that undo (-1) or redo (1) leads to."""
        at = self._at + step
        return self._worlds[at] if 0 <= at < len(self._worlds) else None

    def go(self, step: Step) -> None:
        """Note that the last change was undone (-1), or made again (1)."""
        self._at += step


class WorldDesk:
    """Changes the world of a simulated robot, if this viewer drives; calls ``show`` with messages."""

    def __init__(self, page: Page, graph: RemoteGraph | None, show: Callable[[str], object]) -> None:
        self._page, self.graph, self._show = page, graph, show
        self.history = History()
        self._changing = asyncio.Lock()

    @property
    def world(self) -> World | None:
        """The world with all things where they start; None for a real robot."""
        return self.graph.state.world if self.graph else None

    def changeable(self) -> RemoteGraph | None:
        """Return the graph if this viewer may change its world; show why not otherwise."""
        if self.graph is None:
            why = "The robot runs in another process; its world can be edited on the page of `handsteer run` only."
        elif self.world is None:
            why = "This is a real robot: its world cannot be edited, nor can it be put back by a button."
        elif not self._page.drives():
            why = "Another viewer drives: ask to drive before you change the world."
        else:
            return self.graph
        self._show(why)
        return None

    def stop(self) -> None:
        """Stop the robot, unless it is stopped: it should not move while its world is edited."""
        self._page.do(
            lambda node, viewer: None if node.state(viewer).stopped else node.halt(viewer, "the world editor")
        )

    async def restart(self) -> None:
        """Move the robot and all things to their start positions."""
        if graph := self.changeable():
            await self._wait_for(graph.reset(), "The robot and all things are where they started.")

    def follow(self) -> None:
        """Forget the changes that can be undone, if the world was changed by others."""
        if not self._changing.locked() and self.world is not None:
            self.history.follow(self.world)

    async def change(self, change: Change, done: str = "") -> bool:
        """Stop the robot, make ``change`` and show ``done``; return whether it succeeded."""
        graph = self.changeable()
        return graph is not None and await self._do(lambda: graph.change_world(change), done)

    async def enter(self, world: World) -> None:
        """Stop the robot and load another world."""
        if graph := self.changeable():
            done = f"Loaded {world.name}; the robot is at the start."
            if await self._do(lambda: graph.enter_world(world), done):
                graph.saved_world = world

    async def undo(self) -> None:
        """Undo the last change that this page has made."""
        await self._go(-1, "Undone.", "There is nothing to undo.")

    async def redo(self) -> None:
        """Make again the last change that was undone."""
        await self._go(1, "Made again.", "There is nothing to make again.")

    async def _do(self, request: Callable[[], Future[None]], done: str) -> bool:
        async with self._changing:
            before = self.world
            self.stop()
            succeeded = await self._wait_for(request(), done)
            if succeeded and before is not None and self.world is not None:
                self.history.note(before, self.world)
            return succeeded

    async def _go(self, step: Step, done: str, none: str) -> None:
        graph = self.changeable()
        if graph is None:
            return
        self.follow()
        async with self._changing:
            target = self.history.to(step)
            if target is None:
                self._show(none)
                return
            self.stop()
            if await self._wait_for(graph.change_world(partial(replace, by=target)), done):
                self.history.go(step)

    async def _wait_for(self, change: Future[None], done: str) -> bool:
        """Return whether ``change`` succeeded; show ``done``, or the error."""
        try:
            await asyncio.wait_for(asyncio.wrap_future(change), _ANSWER_TIMEOUT_S)
        except HandsteerError as error:
            self._show(str(error))
        except TimeoutError:
            self._show("The robot does not answer; nothing has changed.")
        else:
            self._show(done)
            return True
        return False
