"""The world card: the 3D view with its tools, the course, and the way to edit the world."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.joined import RobotInWorld
from handsteer.dashboard.node import WorldState
from handsteer.dashboard.panels.course import CourseLine
from handsteer.dashboard.panels.elements import box, button, switch, text
from handsteer.dashboard.panels.robot import RobotFoot
from handsteer.dashboard.panels.world_editor import WorldEditor
from handsteer.dashboard.scene import WorldView
from handsteer.dashboard.scene_objects import View
from handsteer.dashboard.state import PageState

_VIEWS: tuple[tuple[View, str, str], ...] = (
    ("orbit", "Orbit", "drag to look around"),
    ("follow", "Follow", "drag to look around"),
    ("top", "Top", "drag to move the map"),
)


class WorldPanel:
    """The robot in its world.

    Args:
        robot: The robot, if its world can be reached from here.
        may: Returns whether this viewer drives; it is given the seat if that is free.
        watches: Returns whether somebody else drives.
    """

    def __init__(self, robot: RobotInWorld | None, may: Callable[[], bool], watches: Callable[[], bool]) -> None:
        self._watches = watches
        self._collisions: int | None = None
        self._flashes = 0
        self._views: dict[View, ui.element] = {}
        with ui.element("section").classes("card viewer world"):
            with box("stage") as self._stage:
                self._view = WorldView(self._picked, self._dropped)
                self._caption = text("caption", _VIEWS[0][2])
                with box("views").props('role="group" aria-label="View"'):
                    for view, name, _ in _VIEWS:
                        self._views[view] = button(name, "").on("click", lambda view=view: self.look(view))
                self._course = CourseLine()
                with box("tools"):
                    self._restart = button("Back to start", "")
                    self._edit = button("Edit world", 'aria-expanded="false"').on("click", self._toggle)
            self._foot = RobotFoot()
            self._editor = WorldEditor(robot, may, self._view)
            self._restart.on("click", self._editor.restart)
        self.look("orbit")

    def update(self, state: PageState, world: WorldState) -> None:
        """Show ``state`` and ``world``."""
        self._view.update(world)
        self._editor.place = world.robot
        self._foot.update(state)
        self._course.update(state.course)
        self._flash(state.collisions)
        if self._editor.is_open and self._watches():
            self._close("Somebody else drives now, so the world is theirs to edit.")

    def look(self, view: View) -> None:
        """Look at the robot from where ``view`` begins."""
        self._view.look(view)
        for name, element in self._views.items():
            element.props(f'aria-pressed="{"true" if name == view else "false"}"')
        self._caption.set_text(next(hint for name, _, hint in _VIEWS if name == view))

    def _toggle(self) -> None:
        if self._editor.is_open:
            self._close("")
            return
        if self._editor.open():
            self._edit.props('aria-expanded="true"')
            switch(self._stage, "editing", on=True)
            self.look("top")

    def _close(self, why: str) -> None:
        self._editor.close(why)
        self._edit.props('aria-expanded="false"')
        switch(self._stage, "editing", on=False)

    def _picked(self, index: int) -> None:
        self._editor.pick(index)

    async def _dropped(self, index: int, x: float, y: float) -> None:
        await self._editor.drop(index, x, y)

    def _flash(self, collisions: int | None) -> None:
        before, self._collisions = self._collisions, collisions
        if before is None or collisions is None or collisions <= before:
            return
        # Two names of one animation, in turn: it begins anew.
        self._flashes += 1
        for name, on in (("bump-a", self._flashes % 2 == 1), ("bump-b", self._flashes % 2 == 0)):
            switch(self._stage, name, on=on)
