"""The card *Make it yours* of the page ``/teach``: a calibration of the six signs, and the choice of a profile."""

import asyncio
from collections.abc import Callable
from typing import Final

from nicegui import ui

from handsteer.errors import HandsteerError
from handsteer.plugins.page.calibration import SIDES, CalibrationNode, Calibrations, CalibrationState, Side
from handsteer.plugins.page.elements import box, button, card, sentence, switch, tag, text
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.sign_pictures import DRAWN
from handsteer.plugins.teach.calibration import HOLD, SignResult

_NOT_DRIVING: Final = "Another viewer drives: ask to drive first, then calibrate."
_EVERYBODY: Final = "as everybody shows them"


class CalibrationPanel:
    """Leads through a calibration; shows the result, and chooses among the saved profiles."""

    def __init__(self, page: Page, calibrations: Calibrations) -> None:
        self._page, self._calibrations = page, calibrations
        self._viewer = page.client.id
        self._message = ""
        self._is_over = False
        self._is_updating = False
        self._shown: object = None
        self._result_of: object = None
        with card("Make it yours", "panel start calibration") as self.element:
            self._start = box("start")
            with self._start:
                self._fill_start()
            with box("hidden start") as self._run:
                self._what = text("lead", "").props('role="status"')
                self._how = text("", "")
                self._picture = ui.html("", sanitize=False)
                self._count = text("hint", "")
                self._results = tag("ul", "recalls", "")
                with box("buttons"):
                    self._skip = button("Skip", lambda: self._do(CalibrationNode.skip))
                    self._save = button("Save and use", self._save_profile).classes("primary")
                    button("End the calibration", self.end).classes("end")
            self._trouble = text("trouble", "").props('role="alert"')

    def _fill_start(self) -> None:
        text("lead", "Show each of the six signs once with each hand: a minute later they are read as you show them.")
        self._name = ui.input("Name of the profile", value="me").props("outlined dense maxlength=40")
        with box("buttons"):
            self._sides = {side: ui.checkbox(f"{side} hand", value=True) for side in SIDES}
        with box("buttons"):
            button("Calibrate", self._begin).classes("primary")
        self._choice = ui.select({"": _EVERYBODY}, value="", label="Signs are read", on_change=self._choose)
        self._choice.props("outlined dense options-dense")
        text("faint", "The robot is stopped meanwhile. A profile has no pictures, and helps no one else to drive.")

    @property
    def node(self) -> CalibrationNode | None:
        """The calibration of the viewer, if there is one."""
        return self._calibrations.node(self._viewer)

    def update(self) -> None:
        """Show changes."""
        node = self.node
        switch(self._start, "hidden", on=node is not None)
        switch(self._run, "hidden", on=node is None)
        if node is None:
            self._trouble.set_text(self._message)
            self._show_choice()
            return
        node.attend()
        if node.state != self._shown:
            self._shown = node.state
            self._show(node.state)

    def end(self, why: str = "The calibration is over. Press Reset to drive.") -> None:
        """End the calibration, and show ``why``."""
        self._calibrations.end(self._viewer)
        self._message = why

    def leave(self) -> None:
        """End the calibration, because the page is left."""
        self._is_over = True
        self._calibrations.end(self._viewer)

    def _show(self, state: CalibrationState) -> None:
        self._trouble.set_text(state.message)
        switch(self._skip, "hidden", on=not state.sign)
        switch(self._save, "hidden", on=state.result is None)
        for each in (self._how, self._picture, self._count):
            switch(each, "hidden", on=not state.sign)
        if state.sign:
            self._what.set_text(f"{state.sign}, {state.side} hand: {state.step + 1} of {state.steps}")
            self._how.set_text(sentence(HOLD[state.sign]))
            if self._picture.content != DRAWN[state.sign][1]:
                self._picture.set_content(DRAWN[state.sign][1])
            self._count.set_text(state.words)
        elif state.is_computing:
            self._what.set_text("Making the profile")
        else:
            self._what.set_text("What was read" if state.result else "")
        if state.result is not self._result_of:
            self._result_of = state.result
            self._results.clear()
            if state.result is not None:
                with self._results:
                    for result in state.result.results:
                        _line(result)

    def _show_choice(self) -> None:
        chosen = self._calibrations.chosen
        names = self._calibrations.names
        value = str(chosen) if chosen is not None else ""
        options = {"": _EVERYBODY} | {name: name for name in sorted({*names, value} - {""})}
        if (options, value) != self._shown:
            self._shown = options, value
            self._is_updating = True  # not a choice of the viewer
            self._choice.set_options(options, value=value)
            self._is_updating = False

    async def _begin(self) -> None:
        node = self._page.node
        if node is None or not self._may_change():
            return
        node.halt(self._viewer, "the calibration")
        sides: list[Side] = [side for side in SIDES if self._sides[side].value]
        await self._try(lambda: self._calibrations.begin(self._viewer, str(self._name.value or ""), sides))
        if self._is_over:  # the viewer has left the page
            self._calibrations.end(self._viewer)

    async def _save_profile(self) -> None:
        if self._may_change():
            error = await self._try(lambda: self._calibrations.save(self._viewer))
            if error:
                self._do(lambda node: node.say(error))

    async def _choose(self) -> None:
        if self._is_updating:
            return
        name, chosen = str(self._choice.value or ""), self._calibrations.chosen
        if name == (str(chosen) if chosen is not None else ""):
            return  # set back after an error, which stays
        if self._may_change():
            await self._try(lambda: self._calibrations.choose(name))
        self._shown = None

    def _may_change(self) -> bool:
        drives = self._page.drives()
        self._message = "" if drives else _NOT_DRIVING
        return drives

    def _do(self, action: Callable[[CalibrationNode], object]) -> None:
        if node := self.node:
            action(node)

    async def _try(self, action: Callable[[], object]) -> str:
        """Call ``action``, which reads or writes files; show and return an error message, empty if none."""
        try:
            await asyncio.to_thread(action)
        except HandsteerError as error:
            self._message = f"{error}."
        else:
            self._message = ""
        return self._message


def _line(result: SignResult) -> None:
    with ui.element("li"):
        tag("b", "", result.sign)
        before = f"{result.before.rate or 0.0:.0%}"
        if result.after is not None:
            text("faint", f"{before} of {result.before.of} hands before, {result.after.rate or 0.0:.0%} now")
        else:
            text("faint", f"{before} of {result.before.of} hands, as before")
            text("hint", f"Not adapted: {result.why_not}.")
