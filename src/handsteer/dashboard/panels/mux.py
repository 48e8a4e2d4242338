"""Who drives: what goes before what, and which of it has the robot now."""

from dataclasses import dataclass

from handsteer.dashboard.panels.elements import box, switch, text
from handsteer.dashboard.state import PageState


@dataclass(frozen=True)
class Entry:
    """One source of commands.

    Attributes:
        name: What it is called.
        holds: Whether it has the robot now.
        whose: Whose it is, when it holds; empty when that is not known.
    """

    name: str
    holds: bool
    whose: str = ""


def entries(state: PageState) -> tuple[Entry, ...]:
    """Return the sources of commands, the first before the second and so on; at most one of them holds."""
    directly = bool(state.viewers.topic and state.viewers.steers)
    by_hand = not state.stopped and (directly or state.driver == "steering")
    by_signs = not state.stopped and not by_hand and state.driver == "signs"
    return (
        Entry("Stop", state.stopped, state.viewers.stopped),
        Entry("By hand", by_hand, state.viewers.steers or "another node"),
        Entry("Signs", by_signs),
    )


class MuxPanel:
    """The sources in a row, the one that holds lit."""

    def __init__(self) -> None:
        self._shown: tuple[Entry, ...] = ()
        with box("mux").props('role="group" aria-label="Who drives; the first goes before the others"'):
            text("name", "Who drives")
            self._chips = [text("source chip", name) for name in ("Stop", "By hand", "Signs")]

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        shown = entries(state)
        if shown == self._shown:
            return
        self._shown = shown
        for chip, entry in zip(self._chips, shown, strict=True):
            chip.set_text(f"{entry.name}: {entry.whose}" if entry.holds and entry.whose else entry.name)
            chip.props('aria-current="true"' if entry.holds else "", remove="" if entry.holds else "aria-current")
            switch(chip, "holds", on=entry.holds)
