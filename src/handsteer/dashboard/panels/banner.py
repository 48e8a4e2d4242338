"""The sentence at the top, and the button that stops the robot."""

import re
from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.panels.elements import box, button, switch, text
from handsteer.dashboard.state import PageState

_TIME = re.compile(r" for \d+(\.\d+)? s\b")


def spoken(state: PageState) -> str:
    """Return the sentence for a screen reader, which would read out each tenth of a second of a time that passes."""
    return ". ".join([f"{state.headline}: {_TIME.sub('', state.reason)}", *state.warnings])


class Banner:
    """The sentence: what the robot does, and why; and the button that stops it.

    Args:
        halt: Is called to stop the robot.
        reset: Is called to let it be driven again.
    """

    def __init__(self, halt: Callable[[], None], reset: Callable[[], None]) -> None:
        with ui.element("section").classes("card banner") as self._banner:
            self._spoken = text("spoken", "").props('role="status"')
            box("lamp")
            self._headline = text("headline", "Starting")
            self._reason = text("reason", "waiting for the first report")
            self._warning = text("warning hidden", "")
            with box("buttons"):
                self._reset = button("Reset", 'aria-label="Reset: let the robot be driven again"').on("click", reset)
                self._stop = button("Stop", 'aria-label="Stop the robot (space key)" aria-keyshortcuts="Space"')
                self._stop.classes("stop").on("click", halt)
        ui.on("space", halt)
        self._mood = ""

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._headline.set_text(state.headline)
        self._reason.set_text(state.reason)
        self._spoken.set_text(spoken(state))
        self._warning.set_text("; ".join(state.warnings))
        switch(self._warning, "hidden", on=not state.warnings)
        switch(self._reset, "hidden", on=not state.stopped)
        if state.mood != self._mood:
            self._banner.classes(remove=self._mood, add=state.mood)
            self._mood = state.mood
