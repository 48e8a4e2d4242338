"""The signs and what they do."""

from nicegui import ui

from handsteer.dashboard.panels.elements import box, card, switch, text
from handsteer.dashboard.panels.legend import LEGEND
from handsteer.dashboard.state import PageState
from handsteer.signs.vocabulary import NONE


class SignsPanel:
    """Which sign does what; the one that counts is lit."""

    def __init__(self) -> None:
        self._lit = NONE
        self._tiles: dict[str, ui.element] = {}
        with card("The signs", "panel legend"), box("signs"):
            for entry in LEGEND:
                with box("sign-tile") as tile:
                    ui.html(entry.drawing, sanitize=False)
                    with box("words"):
                        text("name", entry.sign)
                        text("pose", entry.pose)
                        text("effect", entry.effect)
                self._tiles[entry.sign] = tile

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        if state.sign == self._lit:
            return
        for sign in {self._lit, state.sign} & self._tiles.keys():
            switch(self._tiles[sign], "seen", on=sign == state.sign)
        self._lit = state.sign
