"""How the robot does on its course."""

from nicegui import ui

from handsteer.dashboard.panels.elements import box, switch, tag
from handsteer.robots.course import BUMP_S, MISS_S, CourseState, stopwatch

_RULES = f"score: the time, {BUMP_S:.0f} s for each bump, {MISS_S:.0f} s for each missed gate"


class CourseLine:
    """Gates, bumps, stopwatch and score; hidden in a world without gates."""

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
