"""The world editor: adds, changes and removes things; loads and saves worlds."""

import asyncio
import math
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, get_args

from nicegui import ui

from handsteer.dashboard.page import Page, box, button, switch, tag, text
from handsteer.dashboard.remote_graph import RemoteGraph
from handsteer.dashboard.scene import WorldView
from handsteer.errors import WorldError
from handsteer.robots import Shape
from handsteer.robots.editing import MOST_OBSTACLES, Change, add, edit, numeric_properties, remove
from handsteer.robots.world import Thing, World, load_world, parse_world, shipped_worlds, write_world
from handsteer.types import Pose2D

LARGEST_FILE_BYTES = 64 * 1024
"""Largest world file accepted from a browser; 200 things need half of it."""

_ANSWER_TIMEOUT_S = 5.0
_LEAST_MOVE_M = 0.02
_FARTHEST_M = 1000
_DEBOUNCE_MS = 600
_DIGITS = 3
_SELECT = "outlined dense options-dense"

_READ_FILE = f"""async (event) => {{
    const file = event.target.files[0];
    event.target.value = "";
    if (file) emit({{ name: file.name, text: file.size > {LARGEST_FILE_BYTES} ? null : await file.text() }});
}}"""


class WorldEditor:
    """Edits the world of a simulated robot, for the driver.

    Args:
        page: Shows the editor.
        graph: The robot's graph; None if it cannot be accessed.
        view: Shows the world.

    Attributes:
        is_open: Whether the world is being edited.
        robot: Pose of the robot; new things are placed near it.
    """

    def __init__(self, page: Page, graph: RemoteGraph | None, view: WorldView) -> None:
        self._page, self._graph, self._view = page, graph, view
        self._chosen: str | None = None
        self.is_open = False
        self.robot = Pose2D(0.0, 0.0, 0.0)
        with box("editor off") as self._box:
            with box("row"):
                tag("h2", "", "Add")
                for shape in get_args(Shape):
                    button(shape.capitalize(), partial(self._add, shape), f"Add a {shape}")
            with box("row"):
                tag("h2", "", "Thing")
                self._things = ui.select([], on_change=self._on_choice)
                self._things.props(f'{_SELECT} aria-label="Which thing to change"')
                self._delete = button("Delete", self._remove, "Delete the chosen thing")
            self._form = _ThingForm(self._edit)
            with box("row"):
                tag("h2", "", "World")
                self._worlds = ui.select(shipped_worlds(), value=shipped_worlds()[0])
                self._worlds.props(f'{_SELECT} aria-label="Which world to load"')
                button("Load", self._load, "Load the chosen world")
                file = ui.element("input").classes("file")
                file.props('type="file" accept=".yaml,.yml" aria-label="World file" tabindex="-1"')
                file.on("change", lambda event: self._open_file(event.args), js_handler=_READ_FILE)
                button("Open file").on("click", js_handler=f"() => getHtmlElement({file.id}).click()")
                button("Save file", self._save)
        self._message = text("message", "").props('role="status"')

    def open(self) -> bool:
        """Start editing; return False and show why if that is not possible."""
        if self._changeable() is None:
            return False
        self._set_open("Drag things where you want them, or choose one and change its figures.", on=True)
        self._refresh()
        return True

    def close(self, why: str) -> None:
        """Stop editing, and show ``why``."""
        self._set_open(why, on=False)

    def pick(self, index: int) -> None:
        """Select the obstacle with this index."""
        if (world := self._world) and index < len(world.obstacles):
            self._things.set_value(world.obstacles[index].name)

    async def drop(self, index: int, x: float, y: float) -> None:
        """Move the obstacle with this index to x and y in metres, unless it is already there."""
        world = self._world
        # A browser may send anything.
        is_place = all(isinstance(value, int | float) and abs(value) <= _FARTHEST_M for value in (x, y))
        if world is None or index >= len(world.obstacles) or not is_place:
            return
        thing = world.obstacles[index]
        if math.dist(thing.position, (x, y)) > _LEAST_MOVE_M:
            await self._edit(thing.name, {"position": (round(x, 2), round(y, 2))})

    async def restart(self) -> None:
        """Move the robot and all things to their start positions."""
        if graph := self._changeable():
            await self._wait_for(graph.reset(), "The robot and all things are where they started.")

    def _set_open(self, message: str, *, on: bool) -> None:
        self.is_open = on
        switch(self._box, "off", on=not on)
        self._view.edit(on=on)
        self._message.set_text(message)

    @property
    def _world(self) -> World | None:
        return self._graph.state.world if self._graph else None

    def _changeable(self) -> RemoteGraph | None:
        """Return the graph if this viewer may change its world; show why not otherwise."""
        if self._graph is None:
            why = "The robot runs in another process; its world can be edited on the page of `handsteer run` only."
        elif self._world is None:
            why = "This is a real robot: its world cannot be edited, nor can it be put back by a button."
        elif not self._page.drives():
            why = "Somebody else drives: ask to drive before you change the world."
        else:
            return self._graph
        self._message.set_text(why)
        return None

    async def _add(self, shape: Shape) -> None:
        known = {thing.name for thing in self._world.obstacles} if self._world else set()
        if await self._change(partial(add, shape=shape, robot=self.robot), "") and self._world is not None:
            new = [thing.name for thing in self._world.obstacles if thing.name not in known]
            self._things.set_value(new[-1] if new else None)
            self._message.set_text(f"Added {new[-1]}." if new else "")

    async def _edit(self, name: str, fields: dict[str, Any]) -> None:
        await self._change(partial(edit, name=name, fields=fields), "")

    async def _remove(self) -> None:
        if name := self._chosen:
            await self._change(partial(remove, name=name), f"Deleted {name}.")

    async def _load(self) -> None:
        name = self._worlds.value
        if name in shipped_worlds():  # not a path chosen by a browser
            await self._enter(load_world(name), name)

    async def _open_file(self, sent: object) -> None:
        if self._changeable() is None:
            return
        try:
            name, content = read_file(sent)
            world = await asyncio.to_thread(parse_world, content, name)
            if len(world.obstacles) > MOST_OBSTACLES:
                raise WorldError(f"{name}: has {len(world.obstacles)} things; the page takes {MOST_OBSTACLES} at most")
        except WorldError as error:
            self._message.set_text(str(error))
        else:
            await self._enter(world, name)

    def _save(self) -> None:
        if world := self._world:
            ui.download.content(write_world(world), "world.yaml", "application/yaml")

    async def _enter(self, world: World, name: str) -> None:
        if graph := self._changeable():
            await self._wait_for(graph.enter_world(world), f"Loaded {name}; the robot is at the start.")

    async def _change(self, change: Change, done: str) -> bool:
        graph = self._changeable()
        return graph is not None and await self._wait_for(graph.change_world(change), done)

    async def _wait_for(self, change: Future[None], done: str) -> bool:
        """Return whether ``change`` succeeded; show ``done``, or the error."""
        try:
            await asyncio.wait_for(asyncio.wrap_future(change), _ANSWER_TIMEOUT_S)
        except WorldError as error:
            done, succeeded = str(error), False
        except TimeoutError:
            done, succeeded = "The robot does not answer; nothing has changed.", False
        else:
            succeeded = True
        self._refresh()
        self._message.set_text(done)
        return succeeded

    def _refresh(self) -> None:
        names = [thing.name for thing in self._world.obstacles] if self._world else []
        value = self._chosen if self._chosen in names else None
        if names != self._things.options or value != self._things.value:
            self._things.set_options(names, value=value)
        self._show_choice()

    def _on_choice(self) -> None:
        self._chosen = self._things.value
        self._show_choice()

    def _show_choice(self) -> None:
        things = self._world.obstacles if self._world else ()
        index = next((at for at, thing in enumerate(things) if thing.name == self._chosen), None)
        self._form.show(None if index is None else things[index])
        switch(self._delete, "hidden", on=index is None)
        if self.is_open:
            self._view.choose(index)


def read_file(sent: object) -> tuple[str, str]:
    """Return the name and text of a file sent by a browser.

    Raises:
        WorldError: It is too large, or not a file.
    """
    values = sent if isinstance(sent, dict) else {}
    name, content = values.get("name"), values.get("text")
    if not isinstance(name, str) or not isinstance(content, str | None):
        raise WorldError("that was no file")
    name = name[:60]
    if content is None or len(content.encode(errors="replace")) > LARGEST_FILE_BYTES:
        raise WorldError(f"{name}: is larger than {LARGEST_FILE_BYTES // 1024} kB, which no world should be")
    return name, content


class _ThingForm:
    """Inputs for one thing; calls ``edit`` with its name and the changed fields immediately."""

    def __init__(self, edit: Callable[[str, dict[str, Any]], Awaitable[None]]) -> None:
        self._edit = edit
        self._shown: Thing | None = None
        self._numbers: list[ui.number] = []
        self._box = box("row form")

    def show(self, thing: Thing | None) -> None:
        """Show the current values of ``thing``, replacing rejected input; nothing for None."""
        before, self._shown = self._shown, thing
        if thing is None:
            self._box.clear()
            return
        if before is None or (before.name, before.shape) != (thing.name, thing.shape):
            self._build(thing)
        else:  # The inputs are reused, so that the focused one keeps the focus.
            for number, each in zip(self._numbers, numeric_properties(thing), strict=True):
                number.set_value(round(each.value, _DIGITS))
            self._movable.set_value(thing.movable)
        switch(self._numbers[-1], "off", on=not thing.movable)  # a fixed thing's mass has no effect

    def _build(self, thing: Thing) -> None:
        self._box.clear()
        with self._box:
            self._numbers = []
            for index, each in enumerate(numeric_properties(thing)):
                number = ui.number(each.name, value=round(each.value, _DIGITS), step=each.step)
                number.on_value_change(lambda event, index=index: self._on_number(index, event.value))
                self._numbers.append(number.props(f"outlined dense debounce={_DEBOUNCE_MS}"))
            with ui.element("label").classes("field"):
                ui.label("colour")
                # An attribute, not a property, which would be set again while the viewer chooses a colour.
                colour = ui.element("input").props(f'type="color" ^value="{thing.colour}"')
                colour.on("change", lambda event: self._on_field("colour", event.args), js_handler=_EMIT_VALUE)
            self._movable = ui.checkbox("can be pushed", value=thing.movable)
            self._movable.on_value_change(lambda event: self._on_field("movable", bool(event.value)))

    async def _on_number(self, index: int, value: float | None) -> None:
        if self._shown is None or value is None:
            return
        each = numeric_properties(self._shown)[index]
        if round(value, _DIGITS) != round(each.value, _DIGITS):
            await self._edit(self._shown.name, each.fields(value))

    async def _on_field(self, name: str, value: object) -> None:
        if self._shown is not None and value != getattr(self._shown, name):
            await self._edit(self._shown.name, {name: value})


_EMIT_VALUE = "(event) => emit(event.target.value)"
