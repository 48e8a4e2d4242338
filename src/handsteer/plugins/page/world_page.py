"""The page ``/world``: edits the world of the simulated robot, seen from above."""

from functools import partial
from typing import Final

from nicegui import ui

from handsteer.plugins.page.editing import rename
from handsteer.plugins.page.elements import box, button, card, set_property, switch, tag, text
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page, PageContext
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.world_desk import WorldDesk
from handsteer.plugins.page.world_editor import WorldEditor
from handsteer.plugins.page.world_plan import WorldPlan

_STOPS = "A change stops the robot, and it stays stopped until you press Reset."
_LONGEST: Final = 200


class WorldPage(Page):
    """Edits the world; nothing on it steers the robot."""

    title = "World"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/world", "world-editor.css")
        graph = context.graph
        self._shown_name: str | None = None
        with box("world-editor"):
            with ui.element("section").classes("card panel bar"):
                tag("h2", "", "World")
                self._name = ui.input("Name of the world").props("outlined dense maxlength=60").classes("name")
                for event in ("blur", "keydown.enter"):
                    self._name.on(event, self._rename)
                self._saved = text("saved", "")
                self._undo = button("Undo", label="Undo the last change (Ctrl-Z)")
                self._redo = button("Redo", label="Make the change again (Ctrl-Shift-Z)")
                files = box("files")
                self._message = text("message", _STOPS).props('role="status"')
            self._desk = desk = WorldDesk(self, graph, self._message.set_text)
            self._undo.on("click", desk.undo)
            self._redo.on("click", desk.redo)
            with ui.element("section").classes("card plan-card").props('aria-label="Plan"'):
                self._plan = plan = WorldPlan()
                with box("zoom").props('role="group" aria-label="View"'):
                    button("Fit", self._fit, "Show the whole world")
                    button("+", lambda: plan.run_method("zoom", 0.8), "Zoom in")
                    button("-", lambda: plan.run_method("zoom", 1.25), "Zoom out")
            self._editor = WorldEditor(desk, plan, self._message.set_text)
            with box("side"):
                with card("Add and move", "panel"):
                    self._editor.tools()
                    snap = ui.switch("snap to 0.1 m and 15°", value=True)
                    snap.on_value_change(lambda event: plan.snap(on=bool(event.value)))
                with card("Chosen thing", "panel"):
                    self._editor.properties()
            with files:
                self._editor.files()
        if desk.world is None:
            desk.changeable()  # shows why not

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        self._editor.robot = node.world.robot
        self._plan.go(node.world.robot)
        self._editor.update()
        graph, world, history = self._desk.graph, self._desk.world, self._desk.history
        if graph is not None and world is not None:
            is_saved = graph.saved_world == world
            if world.name != self._shown_name:
                self._shown_name = world.name
                self._name.set_value(world.name)
            self._saved.set_text("no unsaved changes" if is_saved else "unsaved changes")
            switch(self._saved, "unsaved", on=not is_saved)
        for element, target in ((self._undo, history.to(-1)), (self._redo, history.to(1))):
            set_property(element, "disabled", target is None)

    async def _rename(self) -> None:
        name, world = " ".join(str(self._name.value or "").split()), self._desk.world
        if world is not None and name != world.name:
            await self._desk.change(partial(rename, name=name[:_LONGEST]), f"It is called {name} now.")
        self._shown_name = None  # the input shows what is, not what was refused

    def _fit(self) -> None:
        if self._desk.world is not None:
            self._plan.show(self._desk.world, fit=True)
        self._plan.run_method("fit")
