"""The world card: the 3D view with its controls, the course, and the editor."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.elements import UNKNOWN, box, button, switch, tag, text
from handsteer.dashboard.joined import RobotInWorld
from handsteer.dashboard.scene import View, WorldView
from handsteer.dashboard.state import PageState
from handsteer.dashboard.world_editor import WorldEditor
from handsteer.dashboard.world_state import WorldState
from handsteer.robots.course import BUMP_S, MISS_S, CourseState, stopwatch

_RULES = f"score: the time, {BUMP_S:.0f} s for each bump, {MISS_S:.0f} s for each missed gate"


class CourseLine:
    """Gates, collisions, stopwatch and score; hidden in a world without gates."""

    def __init__(self) -> None:
        self._shown: CourseState | None = None
        with box("course off") as self._box:
            self._time = tag("b", "time", "")
            self._gates = _part("gates")
            self._missed = _part("missed")
            self._bumps = _part("bumps")
            self._score = _part("score").props(f'title="{_RULES}"')

    def update(self, course: CourseState | None) -> None:
        """Show ``course``."""
        if course == self._shown:
            return
        self._shown = course
        switch(self._box, "off", on=course is None)
        if course is None:
            return
        self._time.set_text(stopwatch(course.time_s))
        self._gates.set_text(f"gates {course.passed}/{course.gates}")
        self._missed.set_text(f"missed {len(course.missed)}" if course.missed else "")
        self._bumps.set_text(f"bumps {course.bumps}")
        finished = course.phase == "finished"
        self._score.set_text(f"finished: score {course.score_s:.1f} s" if finished else _hint(course))
        switch(self._box, "finished", on=finished)


def _hint(course: CourseState) -> str:
    return "drive through the yellow gate" if course.phase == "ready" else ""


def _part(name: str) -> ui.label:
    return tag("span", name, "")


_DRIVERS = {"signs": "your signs", "steering": "hand steering", "nobody": "nobody"}


class RobotFoot:
    """Distance driven, collisions, and the active input."""

    def __init__(self) -> None:
        with box("foot"):
            self._driver = _fact("driven by")
            self._path = _fact("path")
            self._bumps = _fact("bumps")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._driver.set_text(_DRIVERS.get(state.driver, state.driver))
        self._path.set_text(UNKNOWN if state.path_length_m is None else f"{state.path_length_m:.1f} m")
        self._bumps.set_text(UNKNOWN if state.collisions is None else str(state.collisions))


def _fact(name: str) -> ui.label:
    with box("fact"):
        ui.label(name).style("display: inline")
        return tag("b", "", UNKNOWN)


_VIEWS: tuple[tuple[View, str, str], ...] = (
    ("orbit", "Orbit", "drag to look around"),
    ("follow", "Follow", "drag to look around"),
    ("top", "Top", "drag to move the map"),
)


class WorldPanel:
    """The robot in its world.

    Args:
        robot: The robot, if its world can be accessed.
        may: Returns whether this viewer drives; a free lease is given to it.
        watches: Returns whether another viewer drives.
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
        """Move the camera to the start of ``view``."""
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
        # Alternating between two names of one animation restarts it.
        self._flashes += 1
        for name, on in (("bump-a", self._flashes % 2 == 1), ("bump-b", self._flashes % 2 == 0)):
            switch(self._stage, name, on=on)
