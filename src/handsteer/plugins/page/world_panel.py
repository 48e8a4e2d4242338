"""The world card: the 3D view with its controls, and the course."""

from functools import partial

from nicegui import ui

from handsteer.cameras import VIRTUAL_HAND
from handsteer.plugins.page.elements import box, button, switch, tag, text
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.scene import View, WorldView
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.status_bar import UNKNOWN
from handsteer.plugins.page.world_desk import WorldDesk
from handsteer.plugins.page.world_state import WorldState
from handsteer.types import BUMP_S, MISS_S, CourseState, stopwatch

_RULES = f"score: the time, {BUMP_S:.0f} s for each bump, {MISS_S:.0f} s for each missed gate"
_DRIVERS = {"signs": "signs", "joystick": "the hand", "steering": "pad and keys", "none": "none"}
_VIEWS: tuple[tuple[View, str, str], ...] = (
    ("orbit", "Orbit", "drag to look around"),
    ("follow", "Follow", "drag to look around"),
    ("top", "Top", "drag to move the map"),
)


def driver_words(source: str, camera: str) -> str:
    """Return in words what drives: ``source`` as the control reports it; ``camera`` is the name of the camera."""
    if camera == VIRTUAL_HAND and source in ("signs", "joystick"):
        return "the demo hand"
    return _DRIVERS.get(source, source)


class WorldPanel:
    """The robot in its world."""

    def __init__(self, page: Page, graph: RemoteGraph | None) -> None:
        self._collisions: int | None = None
        self._flashes = 0
        self._views: dict[View, ui.element] = {}
        with ui.element("section").classes("card viewer world"):
            with box("stage") as self._stage:
                self._view = WorldView()
                self._caption = text("caption", "")
                with box("views").props('role="group" aria-label="View"'):
                    for view, name, _ in _VIEWS:
                        self._views[view] = button(name, partial(self._look, view))
                self._course = _CourseLine()
                with box("tools"):
                    restart = button("Back to start")
                    ui.link("Edit world", "/world").classes("text-button")
            with box("foot"):
                self._driver = _fact("driven by")
                self._path = _fact("path")
                self._bumps = _fact("bumps")
            message = text("message", "").props('role="status"')
            restart.on("click", WorldDesk(page, graph, message.set_text).restart)
        self._look("orbit")

    def update(self, state: PageState, world: WorldState) -> None:
        """Show ``state`` and ``world``."""
        self._view.update(world)
        self._driver.set_text(driver_words(state.control.source, state.camera))
        self._path.set_text(UNKNOWN if state.robot.path_length_m is None else f"{state.robot.path_length_m:.1f} m")
        self._bumps.set_text(UNKNOWN if state.robot.collisions is None else str(state.robot.collisions))
        self._course.update(state.robot.course)
        self._flash(state.robot.collisions)

    def _look(self, view: View) -> None:
        """Move the camera to the start of ``view``."""
        self._view.look(view)
        for name, _, hint in _VIEWS:
            self._views[name].props(f'aria-pressed="{"true" if name == view else "false"}"')
            if name == view:
                self._caption.set_text(hint)

    def _flash(self, collisions: int | None) -> None:
        before, self._collisions = self._collisions, collisions
        if before is not None and collisions is not None and collisions > before:
            # Alternating between two names of one animation restarts it.
            self._flashes += 1
            switch(self._stage, "bump-a", on=self._flashes % 2 == 1)
            switch(self._stage, "bump-b", on=self._flashes % 2 == 0)


def _fact(name: str) -> ui.label:
    with box("fact"):
        text("", name).style("display: inline")
        return tag("b", "", UNKNOWN)


class _CourseLine:
    """Gates, collisions, stopwatch and score; hidden in a world without gates."""

    def __init__(self) -> None:
        with box("course off") as self._box:
            self._time = tag("b", "time", "")
            self._gates = tag("span", "gates", "")
            self._missed = tag("span", "missed", "")
            self._bumps = tag("span", "bumps", "")
            self._score = tag("span", "score", "").props(f'title="{_RULES}"')

    def update(self, course: CourseState | None) -> None:
        """Show ``course``."""
        switch(self._box, "off", on=course is None)
        if course is None:
            return
        self._time.set_text(stopwatch(course.time_s))
        self._gates.set_text(f"gates {course.passed}/{course.gates}")
        self._missed.set_text(f"missed {len(course.missed)}" if course.missed else "")
        self._bumps.set_text(f"bumps {course.bumps}")
        hint = "drive through the yellow gate" if course.phase == "ready" else ""
        is_finished = course.phase == "finished"
        self._score.set_text(f"finished: score {course.score_s:.1f} s" if is_finished else hint)
        switch(self._box, "finished", on=is_finished)
