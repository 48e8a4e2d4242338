"""The world editor: adds, moves, changes and removes things and gates; loads and saves worlds."""

import asyncio
import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, get_args

from nicegui import ui

from handsteer.errors import WorldError
from handsteer.plugins.page.editing import (
    MOST_OBSTACLES,
    Place,
    Section,
    add,
    add_gate,
    add_wall,
    edit,
    place,
    put,
    remove,
    reorder,
)
from handsteer.plugins.page.elements import box, button, switch, text
from handsteer.plugins.page.world_desk import WorldDesk
from handsteer.plugins.page.world_plan import ThingForm, Tool, WorldPlan, read_tool
from handsteer.robots import Shape
from handsteer.robots.world import (
    Change,
    Gate,
    Thing,
    World,
    load_world,
    named_by_file,
    parse_world,
    shipped_worlds,
    write_world,
)
from handsteer.types import Pose2D

LARGEST_FILE_BYTES = 64 * 1024
"""Largest world file accepted from a browser; 200 things need half of it."""

_LEAST_MOVE_M = 0.02
_FARTHEST_M = 1000
_SELECT = "outlined dense options-dense"
_TOOLS: dict[Tool, tuple[str, str]] = {
    "move": ("Move", "Press a thing and drag it; press the floor and drag it to move the plan."),
    "wall": ("Wall", "Press where the wall begins, drag to where it ends, and release."),
    "gate": ("Gate", "Press at the gate's left post, drag to its right post, and release: it is passed forward."),
}
Key = tuple[Section, str]
"""A thing or gate, by its section and name."""

_NOTHING = "Choose a thing on the plan or in this list to change its size, place or colour."

_READ_FILE = f"""async (event) => {{
    const file = event.target.files[0];
    event.target.value = "";
    if (file) emit({{ name: file.name, text: file.size > {LARGEST_FILE_BYTES} ? null : await file.text() }});
}}"""


class WorldEditor:
    """Edits the world of a simulated robot, for the driver; new things are placed near the pose ``robot``."""

    def __init__(self, desk: WorldDesk, plan: WorldPlan, show: Callable[[str], object]) -> None:
        self._desk, self._plan, self._show = desk, plan, show
        self._world: World | None = None
        self.robot = Pose2D(0.0, 0.0, 0.0)
        plan.on("pick", lambda event: self.pick(event.args))
        plan.on("drop", lambda event: self.drop(event.args))
        plan.on("draw", lambda event: self.draw(event.args))
        plan.on("key", lambda event: self._on_key(event.args))

    def tools(self) -> None:
        """Make the buttons that add things."""
        self._tools: dict[Tool, ui.element] = {}
        with box("row tools").props('role="group" aria-label="Tool"'):
            for tool, (name, _) in _TOOLS.items():
                self._tools[tool] = button(name, partial(self._use, tool))
        self._hint = text("hint", "")
        with box("row add").props('role="group" aria-label="Add"'):
            for shape in get_args(Shape):
                button(f"+ {shape.capitalize()}", partial(self._add, shape), f"Add a {shape}")
        self._use("move")

    def properties(self) -> None:
        """Make the inputs of the chosen thing."""
        self._things = ui.select({}, on_change=self._show_choice)
        self._things.props(f'{_SELECT} aria-label="Which thing to change"')
        self._nothing = text("hint", _NOTHING)
        self._form = ThingForm(self._edit)
        with box("row"):
            self._earlier = button("Earlier", partial(self._reorder, -1), "Pass this gate earlier")
            self._later = button("Later", partial(self._reorder, 1), "Pass this gate later")
            self._delete = button("Delete", self._remove, "Delete the chosen thing")
        self._show_choice()

    def files(self) -> None:
        """Make the inputs that load and save worlds."""
        self._worlds = ui.select(shipped_worlds(), value=shipped_worlds()[0])
        self._worlds.props(f'{_SELECT} aria-label="Which world to load"')
        button("Load", self._load, "Load the chosen world")
        file = ui.element("input").classes("file")
        file.props('type="file" accept=".yaml,.yml" aria-label="World file" tabindex="-1"')
        file.on("change", lambda event: self._open_file(event.args), js_handler=_READ_FILE)
        button("Open file").on("click", js_handler=f"() => getHtmlElement({file.id}).click()")
        button("Save file", self._save)

    def update(self) -> None:
        """Show the world, if it has changed."""
        world = self._desk.world
        if world is not None and world is not self._world:
            fit, self._world = self._world is None, world
            own = [world.name] if world.name not in shipped_worlds() else []
            self._worlds.set_options([*own, *shipped_worlds()], value=world.name)
            self._desk.follow()
            self._plan.show(world, fit=fit)
            self._refresh()

    def pick(self, sent: object) -> None:
        """Select the thing or gate that a browser names."""
        if found := self._named(sent):
            self._things.set_value(found)

    async def drop(self, sent: object) -> None:
        """Move the thing or gate that a browser names, unless it is already there."""
        found, to = self._named(sent), _read_place(sent, "x", "y")
        if found is None or to is None:
            return
        _, thing = self._all[found]
        if math.dist(place(thing), to) > _LEAST_MOVE_M:
            await self._edit(found[1], put(thing, to), found[0])
        self._plan.update()  # a refused thing returns

    async def draw(self, sent: object) -> None:
        """Add the wall or gate that a browser sends."""
        values = sent if isinstance(sent, dict) else {}
        start, end = (_read_place(values.get(key), 0, 1) for key in ("from", "to"))
        tool = read_tool(values.get("tool"))
        if start is None or end is None:
            return
        if tool == "wall":
            await self._add_last(partial(add_wall, start=start, end=end), "obstacles")
        elif tool == "gate":
            await self._add_last(partial(add_gate, left=start, right=end), "gates")

    async def _on_key(self, sent: object) -> None:
        actions = {"undo": self._desk.undo, "redo": self._desk.redo, "delete": self._remove}
        if isinstance(sent, str) and sent in actions:
            await actions[sent]()

    def _use(self, tool: Tool) -> None:
        self._plan.use(tool)
        self._hint.set_text(_TOOLS[tool][1])
        for each, element in self._tools.items():
            element.props(f'aria-pressed="{"true" if each == tool else "false"}"')

    @property
    def _all(self) -> dict[Key, tuple[int, Thing | Gate]]:
        """All things and gates, with their index in the section."""
        world = self._desk.world or World()
        sections: dict[Section, Sequence[Thing | Gate]] = {"obstacles": world.obstacles, "gates": world.gates}
        return {(section, of[at].name): (at, of[at]) for section, of in sections.items() for at in range(len(of))}

    @property
    def _chosen(self) -> Key | None:
        """The chosen thing or gate, which may be gone."""
        chosen: Key | None = self._things.value
        return chosen

    def _named(self, sent: object) -> Key | None:
        """Return what a browser names by its section and index, which may be anything."""
        values = sent if isinstance(sent, dict) else {}
        named = (values.get("section"), values.get("index"))
        return next((key for key, (index, _) in self._all.items() if (key[0], index) == named), None)

    async def _add(self, shape: Shape) -> None:
        await self._add_last(partial(add, shape=shape, robot=self.robot), "obstacles")

    async def _add_last(self, change: Change, section: Section) -> None:
        if await self._desk.change(change):
            self.update()
            if keys := [key for key in self._all if key[0] == section]:
                self._things.set_value(keys[-1])
                self._show(f"Added {keys[-1][1]}.")

    async def _edit(self, name: str, fields: dict[str, Any], section: Section | None = None) -> None:
        section = section or (self._chosen[0] if self._chosen else "obstacles")
        await self._desk.change(partial(edit, name=name, fields=fields, section=section))
        self._refresh()  # the inputs show what is, not what was refused

    async def _reorder(self, step: int) -> None:
        if self._chosen:
            await self._desk.change(partial(reorder, name=self._chosen[1], step=step))

    async def _remove(self) -> None:
        if self._chosen:
            section, name = self._chosen
            await self._desk.change(partial(remove, name=name, section=section), f"Deleted {name}.")

    async def _load(self) -> None:
        name = self._worlds.value
        if name in shipped_worlds():  # not a path chosen by a browser
            await self._enter(load_world(name))
        else:
            self._show(f"{name} is loaded already: choose another world, or open a file.")

    async def _open_file(self, sent: object) -> None:
        if self._desk.changeable() is None:
            return
        try:
            name, content = read_file(sent)
            world = named_by_file(await asyncio.to_thread(parse_world, content, name), Path(name))
            if len(world.obstacles) > MOST_OBSTACLES:
                raise WorldError(f"{name}: has {len(world.obstacles)} things; the page takes {MOST_OBSTACLES} at most")
        except WorldError as error:
            self._show(str(error))
        else:
            await self._enter(world)

    async def _enter(self, world: World) -> None:
        await self._desk.enter(world)
        self._world = None  # shown again, to fit
        self.update()

    def _save(self) -> None:
        graph, world = self._desk.graph, self._desk.world
        if graph is not None and world is not None:
            name = re.sub(r'[\\/:*?"<>|]', "-", world.name)  # what file systems refuse
            ui.download.content(write_world(world), f"{name or 'world'}.yaml", "application/yaml")
            graph.saved_world = world

    def _refresh(self) -> None:
        names = {key: key[1] for key in self._all}
        if names != self._things.options:
            self._things.set_options(names)
        self._show_choice()

    def _show_choice(self) -> None:
        chosen = self._chosen
        index, thing = self._all.get(chosen, (0, None)) if chosen else (0, None)
        self._form.show(thing)
        self._plan.choose((chosen[0], index) if chosen and thing else None)
        switch(self._nothing, "hidden", on=thing is not None)
        switch(self._delete, "hidden", on=thing is None)
        for each in (self._earlier, self._later):
            switch(each, "hidden", on=not isinstance(thing, Gate))


def _read_place(sent: Any, x: str | int, y: str | int) -> Place | None:
    """Return x and y in metres, to 1 mm, from what a browser sent, which may be anything; None if invalid."""
    try:
        values = (sent[x], sent[y])
    except (TypeError, KeyError, IndexError):
        return None
    if not all(isinstance(value, int | float) and abs(value) <= _FARTHEST_M for value in values):
        return None
    return round(float(values[0]), 3), round(float(values[1]), 3)


def read_file(sent: object) -> tuple[str, str]:
    """Return the name and text of a file sent by a browser.

    Raises:
        WorldError: It is too large, or not a file.
    """
    values = sent if isinstance(sent, dict) else {}
    name, content = values.get("name"), values.get("text")
    if not isinstance(name, str) or not isinstance(content, str | None):
        raise WorldError("that was not a file")
    name = name[:60]
    if content is None or len(content.encode(errors="replace")) > LARGEST_FILE_BYTES:
        raise WorldError(f"{name}: is larger than {LARGEST_FILE_BYTES // 1024} kB, which no world should be")
    return name, content
