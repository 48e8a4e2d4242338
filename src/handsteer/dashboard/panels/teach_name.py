"""The first step of a lesson: which sign, and who shows it."""

from collections.abc import Callable
from typing import Any

from nicegui import ui

from handsteer.dashboard.panels.elements import box, button, text
from handsteer.signs.teaching.dataset import Dataset, summarise
from handsteer.types import NONE

_LONGEST = 200


class NamePanel:
    """Name a sign, or pick one that was taught before.

    Args:
        begin: Is called with the name and the person to begin the lesson.
    """

    def __init__(self, begin: Callable[[str, str], Any]) -> None:
        with box("step name") as self.element:
            ui.label("Show a sign of your own to the camera a few times, and say what the robot does when it sees it.")
            with box("fields"):
                self._name = ui.input("Name of the sign", placeholder="Peace").props("outlined dense maxlength=40")
                self._person = ui.input("Who shows it", value="me").props("outlined dense maxlength=40")
            self._known = box("picks")
            self._name.on("keydown.enter", lambda: begin(*self._said))
            with box("buttons"):
                button("Begin", "").classes("primary").on("click", lambda: begin(*self._said))
            text("faint", "The robot is stopped while you teach. Pictures are not stored, only the hand's landmarks.")

    def show_known(self, known: Dataset) -> None:
        """Offer the signs of ``known`` to be picked."""
        self._known.clear()
        takes = {each.label: each.takes for each in summarise(known)}
        with self._known:
            for label, count in takes.items():
                if label != NONE:
                    self._pick(label, f"{label} ({count} takes)")
            if takes:
                self._pick(NONE, "No sign: what shall not count")

    @property
    def _said(self) -> tuple[str, str]:
        return str(self._name.value or "")[:_LONGEST], str(self._person.value or "")[:_LONGEST]

    def _pick(self, label: str, words: str) -> None:
        button(words, "").on("click", lambda: self._name.set_value(label))
