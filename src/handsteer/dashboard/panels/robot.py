"""What the robot has done so far."""

from nicegui import ui

from handsteer.dashboard.panels.elements import UNKNOWN, box, tag
from handsteer.dashboard.state import PageState

_DRIVERS = {"signs": "your signs", "steering": "hand steering", "nobody": "nobody"}


class RobotFoot:
    """How far the robot went, what it bumped into, and who drives it."""

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
