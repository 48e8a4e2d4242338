"""The velocities, now and over the last 30 s."""

from collections.abc import Callable

from handsteer.dashboard.history import VelocityHistory
from handsteer.dashboard.panels.elements import box, card, tag, text
from handsteer.dashboard.panels.plot import Plot, rows_of
from handsteer.dashboard.state import PageState


class VelocityPanel:
    """Both velocities, commanded and measured, as figures and as a plot."""

    def __init__(self) -> None:
        self._sent: int | None = None
        with card("Velocity", "panel velocity"):
            self._linear = _Axis("Linear", "m/s", least=0.2, ends=("forward", "backward"), begin=self._begin)
            # Left is positive (REP 103), and up.
            self._angular = _Axis("Angular", "rad/s", least=0.5, ends=("left", "right"), begin=self._begin)
            with box("scale"):
                text("", "30 s ago")
                with box("key"):
                    tag("span", "commanded", "commanded")
                    tag("span", "measured", "measured")
                text("", "now")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._linear.update(state.commanded.linear_mps, state.measured.linear_mps)
        self._angular.update(state.commanded.angular_radps, state.measured.angular_radps)

    def draw(self, history: VelocityHistory, now_s: float) -> None:
        """Draw what ``history`` has that the browser does not have yet, at ``now_s`` of the graph's clock."""
        afresh = self._sent is None
        self._sent, samples = history.since(self._sent or 0, now_s)
        if samples or afresh:
            for axis, rows in zip((self._linear, self._angular), rows_of(samples), strict=True):
                axis.plot.add(rows, afresh=afresh)

    def _begin(self) -> None:
        self._sent = None


class _Axis:
    def __init__(self, name: str, unit: str, *, least: float, ends: tuple[str, str], begin: Callable[[], None]) -> None:
        with box("axis"):
            with box("line"):
                text("name", name)
                self._commanded = text("told", "")
                self._measured = text("value", "0.00")
                text("unit", unit)
            with box("frame"):
                self.plot = Plot(f"{name} velocity over the last 30 s; its figures stand above", least, begin)
                text("end up", ends[0])
                text("end down", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")
