"""A velocity over the last 30 s."""

from collections.abc import Callable, Sequence

from nicegui import ui

from handsteer.dashboard.history import SPAN_S, Sample
from handsteer.types import Velocity

Row = tuple[float, float | None, float | None]
"""Seconds, and the velocity commanded and measured, in m/s or rad/s; None where there was none."""


class Plot(ui.element, component="plot.js"):
    """Two lines, commanded and measured, which the browser keeps; it is sent each sample once.

    A library for plots would cost the browser a megabyte, and sends all points again for each that is new.

    Args:
        name: What a screen reader says of it.
        least: The reach of the axis when there is less to show, in m/s or rad/s.
        begin: Is called when the browser has none of the samples.
    """

    def __init__(self, name: str, least: float, begin: Callable[[], None]) -> None:
        super().__init__()
        self.props(f'aria-label="{name}"')
        self._props["span"] = SPAN_S
        self._props["least"] = least
        self.on("begin", begin)

    def add(self, rows: Sequence[Row], *, afresh: bool) -> None:
        """Show further ``rows``, or these only."""
        self.run_method("add", rows, afresh)


def rows_of(samples: Sequence[Sample]) -> tuple[list[Row], list[Row]]:
    """Return the rows of the linear velocity and of the angular velocity, as short as they are to be sent."""
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
