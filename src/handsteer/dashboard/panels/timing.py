"""How quick it is."""

from nicegui import ui

from handsteer.dashboard.panels.elements import UNKNOWN, box, card, text
from handsteer.dashboard.state import PageState


class TimingPanel:
    """How quick it is."""

    def __init__(self) -> None:
        with card("Camera to command", "panel timing"), box("figures"):
            self._median = _figure("ms", "median")
            self._p99 = _figure("ms", "99 of 100 below")
            self._fps = _figure("frames/s", "camera")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        for label, value, digits in (
            (self._median, state.latency_median_ms, 1),
            (self._p99, state.latency_p99_ms, 1),
            (self._fps, state.fps, 1),
        ):
            label.set_text(UNKNOWN if value is None else f"{value:.{digits}f}")


def _figure(unit: str, name: str) -> ui.label:
    with box("figure"):
        with box(""):
            value = ui.label(UNKNOWN).classes("value").style("display: inline")
            ui.label(unit).classes("unit").style("display: inline")
        text("name", name)
    return value
