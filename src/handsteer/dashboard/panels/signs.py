"""The signs and what they do."""

from nicegui import ui

from handsteer.dashboard.panels.elements import box, card, switch, text
from handsteer.dashboard.panels.legend import LegendEntry, legend
from handsteer.dashboard.state import PageState
from handsteer.types import NONE, SIGNS


class SignsPanel:
    """Which sign does what, as the nodes say; the one that counts is lit."""

    def __init__(self) -> None:
        self._lit = NONE
        self._shown: tuple[LegendEntry, ...] = ()
        self._tiles: dict[str, ui.element] = {}
        with card("The signs", "panel legend"):
            self._signs = box("signs")
        self._fill(legend(SIGNS, None))

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        entries = legend(state.signs, state.rule)
        if entries != self._shown:
            self._fill(entries)
        if state.sign == self._lit:
            return
        for sign in {self._lit, state.sign} & self._tiles.keys():
            switch(self._tiles[sign], "seen", on=sign == state.sign)
        self._lit = state.sign

    def _fill(self, entries: tuple[LegendEntry, ...]) -> None:
        self._shown = entries
        self._lit = NONE
        self._signs.clear()
        with self._signs:
            self._tiles = {entry.sign: _tile(entry) for entry in entries}


def _tile(entry: LegendEntry) -> ui.element:
    with box("sign-tile") as tile:
        ui.html(entry.drawing, sanitize=False)
        with box("words"):
            text("name", entry.sign)
            text("pose", entry.pose)
            text("effect", entry.effect)
            if entry.figures:
                text("figures", entry.figures)
    return tile
