"""The current velocities, and those of the last 30 s, as figures and plots."""

from collections.abc import Callable, Sequence

from nicegui import ui

from handsteer.dashboard.elements import STATIC, box, card, tag, text
from handsteer.dashboard.history import SPAN_S, Sample, VelocityHistory
from handsteer.dashboard.state import PageState
from handsteer.types import Velocity

Row = tuple[float, float | None, float | None]
"""Seconds, and the commanded and measured velocity in m/s or rad/s; None if missing."""


class Plot(ui.element, component=STATIC / "plot.js"):
    """Commanded and measured velocity as two lines, stored in the browser; each sample is sent once.

    A plotting library would add a megabyte to the page, and would send all points for each new one.

    Args:
        name: Label for screen readers.
        least: Smallest range of the axis, in m/s or rad/s.
        begin: Called when the browser has no samples.
    """

    def __init__(self, name: str, least: float, begin: Callable[[], None]) -> None:
        super().__init__()
        self.props(f'aria-label="{name}"')
        self._props["span"] = SPAN_S
        self._props["least"] = least
        self.on("begin", begin)

    def add(self, rows: Sequence[Row], *, afresh: bool) -> None:
        """Append ``rows``, or replace all."""
        self.run_method("add", rows, afresh)


def rows_of(samples: Sequence[Sample]) -> tuple[list[Row], list[Row]]:
    """Return the rows of the linear and of the angular velocity, rounded for sending."""
    linear: list[Row] = []
    angular: list[Row] = []
    for sample in samples:
        at_s = round(sample.at_s, 2)
        (linear_told, angular_told), (linear_done, angular_done) = _short(sample.commanded), _short(sample.measured)
        linear.append((at_s, linear_told, linear_done))
        angular.append((at_s, angular_told, angular_done))
    return linear, angular


def _short(velocity: Velocity | None) -> tuple[float | None, float | None]:
    if velocity is None:
        return None, None
    return round(velocity.linear_mps, 3), round(velocity.angular_radps, 3)


class VelocityPanel:
    """Commanded and measured velocities, as figures and plots."""

    def __init__(self) -> None:
        self._sent: int | None = None
        with card("Velocity", "panel velocity"):
            self._linear = _Axis("Linear", "m/s", least=0.2, ends=("forward", "backward"), begin=self._begin)
            # Left is positive (REP 103) and drawn upwards.
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
        """Plot the samples of ``history`` that the browser does not have yet; ``now_s`` is of the graph's clock."""
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
