"""The row of inputs that may drive, with the active one highlighted."""

from dataclasses import dataclass

from handsteer.dashboard.elements import box, switch, text
from handsteer.dashboard.state import PageState


@dataclass(frozen=True)
class MuxInput:
    """One input of the twist mux.

    Attributes:
        name: Its display name.
        is_active: Whether it drives the robot, or stops it.
        viewer: The viewer whose input it is, while active; empty if unknown.
    """

    name: str
    is_active: bool
    viewer: str = ""


def mux_inputs(state: PageState) -> tuple[MuxInput, ...]:
    """Return the inputs in order of priority; at most one is active."""
    directly = bool(state.viewers.topic and state.viewers.steers)
    by_hand = not state.stopped and (directly or state.driver == "steering")
    by_air = not state.stopped and not by_hand and state.driver in ("signs", "joystick")
    return (
        MuxInput("Stop", state.stopped, state.viewers.stopped),
        MuxInput("By hand", by_hand, state.viewers.steered or "another node"),
        MuxInput("Joystick" if state.is_joystick else "Signs", by_air),
    )


class MuxRow:
    """The inputs in a row, with the active one highlighted."""

    def __init__(self) -> None:
        with box("mux").props('role="group" aria-label="The active input; the first one overrides the others"'):
            text("name", "Active input")
            self._chips = [text("source chip", name) for name in ("Stop", "By hand", "Signs")]

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        for chip, each in zip(self._chips, mux_inputs(state), strict=True):
            chip.set_text(f"{each.name}: {each.viewer}" if each.is_active and each.viewer else each.name)
            chip.props('aria-current="true"' if each.is_active else "", remove="" if each.is_active else "aria-current")
            switch(chip, "holds", on=each.is_active)
