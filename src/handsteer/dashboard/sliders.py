"""Two sliders that stay where they are set, as in rqt_robot_steering: linear vertical, angular horizontal."""

import math
from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.elements import box, button, switch, text
from handsteer.types import Velocity

_LINEAR_MPS = 0.5
_ANGULAR_RADPS = 1.0
_STEP = 0.1
_DIGITS = 2


class Sliders:
    """Two sliders with editable limits, step buttons, and a return to zero.

    Args:
        change: Called with the velocity of both sliders after one was moved.

    Attributes:
        across: Holds the angular slider, with space below it.
    """

    def __init__(self, change: Callable[[Velocity], None]) -> None:
        self._change = change
        self._velocity = Velocity()
        with box("sliders") as self._box:
            names = ("Linear", "m/s", ("max", "min"), ("faster forward", "slower, then backward"))
            self._linear = _Axis("linear", *names, reach=_LINEAR_MPS, change=self._read, upright=True)
            names = ("Angular", "rad/s", ("left", "right"), ("more to the left", "more to the right"))
            with box("across") as self.across:
                self._angular = _Axis("angular", *names, reach=_ANGULAR_RADPS, change=self._read, upright=False)

    def show(self, velocity: Velocity) -> None:
        """Set both sliders to ``velocity``."""
        if velocity != self._velocity:
            self._velocity = velocity
            self._linear.set(velocity.linear_mps)
            self._angular.set(velocity.angular_radps)
            switch(self._box, "set", on=not velocity.is_zero)

    def limit(self, linear_mps: float, angular_radps: float) -> None:
        """Restrict the sliders' limits to these values."""
        self._linear.bound(linear_mps)
        self._angular.bound(angular_radps)

    def enable(self, *, on: bool) -> None:
        """Enable or disable the sliders."""
        self._linear.enable(on=on)
        self._angular.enable(on=on)

    def _read(self) -> None:
        wanted = Velocity(self._linear.value, self._angular.value)
        if wanted != self._velocity:
            self._velocity = wanted
            switch(self._box, "set", on=not wanted.is_zero)
            self._change(wanted)


class _Axis:
    """One slider; positive is up or left (REP 103)."""

    def __init__(
        self,
        kind: str,
        name: str,
        unit: str,
        ends: tuple[str, str],
        steps: tuple[str, str],
        *,
        reach: float,
        change: Callable[[], None],
        upright: bool,
    ) -> None:
        self._change = change
        self._name = name
        self.value = 0.0
        self._bound = reach
        self._high, self._low = reach, -reach
        with box(f"slider {kind}"):
            with box("line"):
                text("name", name)
                self._label = text("value", "0.00")
                text("unit", unit)
            self._slider = ui.slider(min=-reach, max=reach, step=0.05, value=0.0, on_change=self._on_slide)
            way = "vertical reverse" if upright else "reverse"
            self._slider.props(f'{way} aria-label="{name} velocity, in {unit}" selection-color="transparent"')
            with box("ends"):
                self._highest = self._number(ends[0], reach, self._on_limits)
                self._steps = [
                    button("+" if upright else "\u2039", f'aria-label="{steps[0]}"').on("click", lambda: self._step(1)),
                    button("0", f'aria-label="{name} to 0"').on("click", lambda: self._take(0.0)),
                    button("\u2212" if upright else "\u203a", f'aria-label="{steps[1]}"').on(
                        "click", lambda: self._step(-1)
                    ),
                ]
                self._lowest = self._number(ends[1], -reach, self._on_limits)
        self._show_bound()

    def set(self, value: float) -> None:
        """Set the slider to ``value`` without calling back."""
        self.value = value
        self._slider.set_value(value)
        self._label.set_text(f"{value + 0.0:.2f}")

    def bound(self, bound: float) -> None:
        """Restrict the limits to ``bound``, which is positive."""
        if bound != self._bound:
            self._bound = bound
            self._show_bound()
            self._on_limits()

    def enable(self, *, on: bool) -> None:
        """Enable or disable the slider and its step buttons."""
        if self._slider.enabled != on:
            self._slider.set_enabled(on)
            for step in self._steps:
                step.props("" if on else "disabled", remove="disabled" if on else "")

    def _show_bound(self) -> None:
        self._highest.min, self._highest.max = 0.0, self._bound
        self._lowest.min, self._lowest.max = -self._bound, 0.0

    def _number(self, name: str, value: float, change: Callable[[], None]) -> ui.number:
        number = ui.number(name, value=value, step=_STEP, format="%.2f", on_change=change)
        return number.props(f'dense outlined aria-label="{self._name}: {name}"').classes("limit")

    def _on_limits(self) -> None:
        self._high = read_limit(self._highest.value, 0.0, self._bound, self._high)
        self._low = read_limit(self._lowest.value, -self._bound, 0.0, self._low)
        self._slider.props["max"] = self._high
        self._slider.props["min"] = self._low
        self._take(self.value)

    def _on_slide(self) -> None:
        value = round(read_limit(self._slider.value, self._low, self._high, 0.0), _DIGITS)
        if value != self.value:  # moved by the viewer, not by set()
            self._take(value)

    def _step(self, direction: int) -> None:
        self._take(self.value + direction * _STEP)

    def _take(self, value: float) -> None:
        self.set(round(max(self._low, min(value, self._high)), _DIGITS))
        self._change()


def read_limit(sent: object, low: float, high: float, otherwise: float) -> float:
    """Return the number a browser sent, or ``otherwise`` if it is invalid, clamped to ``low`` to ``high``."""
    value = otherwise
    if isinstance(sent, int | float) and not isinstance(sent, bool) and -math.inf < sent < math.inf:
        value = sent  # clamped without conversion: an integer may be too large for any float
    return float(max(low, min(value, high)))
