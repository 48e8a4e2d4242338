"""The card of the commanded and measured velocities: figures, and plots of the last 30 s."""

from collections.abc import Sequence
from typing import Final

from nicegui import ui

from handsteer.dashboard.elements import STATIC, box, card, tag, text
from handsteer.dashboard.state import PageState
from handsteer.dashboard.world_state import SPAN_S, Sample, VelocityHistory
from handsteer.types import Velocity

Row = tuple[float, float | None, float | None]
"""Seconds, and the commanded and measured velocity in m/s or rad/s; None if missing."""

_AT_CURSOR: Final = "{seconds} s ago: commanded {commanded}, measured {measured}"
_ZOOM: Final = "Drag sideways in a plot to zoom in, which pauses the plots"
_PAUSE, _RESUME = "Pause", "Resume"


def rows_of(samples: Sequence[Sample]) -> tuple[list[Row], list[Row]]:
    """Return the rows of the linear and of the angular velocity, rounded for sending."""
    rows = [(round(each.at_s, 2), _rounded(each.commanded), _rounded(each.measured)) for each in samples]
    return (
        [(at_s, commanded[0], measured[0]) for at_s, commanded, measured in rows],
        [(at_s, commanded[1], measured[1]) for at_s, commanded, measured in rows],
    )


def _rounded(velocity: Velocity | None) -> tuple[float | None, float | None]:
    return (None, None) if velocity is None else (round(velocity.linear_mps, 3), round(velocity.angular_radps, 3))


class VelocityPanel:
    """The commanded and measured velocities, as figures, and as plots that can be paused and zoomed."""

    def __init__(self) -> None:
        self._sent: int | None = None
        self._is_paused = False
        with card(f"Velocity, last {SPAN_S:.0f} s", "panel velocity"):
            with box("key"):
                tag("span", "commanded", "commanded")
                tag("span", "measured", "measured")
                self._button = tag("button", "text-button", _PAUSE).props(f'type="button" title="{_ZOOM}"')
                self._button.on("click", lambda: self._hold(on=not self._is_paused))
            self._linear = _Axis("Linear", "m/s", least=0.2, ends=("forward", "backward"), panel=self)
            # Left is positive (REP 103) and drawn upwards.
            self._angular = _Axis("Angular", "rad/s", least=0.5, ends=("left", "right"), panel=self, times=True)

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
                axis.plot.run_method("add", rows, afresh)

    def begin(self) -> None:
        """Send all samples again, to a plot that has none."""
        self._sent = None

    def pause(self) -> None:
        """Pause the plots."""
        self._hold(on=True)

    def _hold(self, *, on: bool) -> None:
        self._is_paused = on
        for axis in (self._linear, self._angular):
            axis.plot.run_method("pause", on)
        self._button.set_text(_RESUME if on else _PAUSE)


class _Plot(ui.element, component=STATIC / "plot.js"):
    """Two lines, stored in the browser, so that each sample is sent once."""


class _Axis:
    def __init__(
        self, name: str, unit: str, *, least: float, ends: tuple[str, str], panel: VelocityPanel, times: bool = False
    ) -> None:
        with box("axis"):
            with box("line"):
                text("name", name)
                self._commanded = text("commanded-value", "")
                self._measured = text("value", "0.00")
                text("unit", unit)
            with box("frame"):
                self.plot = _Plot().props(f'aria-label="{name} velocity over the last 30 s; its figures stand above"')
                self.plot.props(f':span={SPAN_S} :least={least} :times={str(times).lower()} form="{_AT_CURSOR}"')
                self.plot.on("begin", panel.begin).on("zoom", panel.pause)
                text("end up", ends[0])
                text("end down", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")
