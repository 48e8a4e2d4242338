"""Steering by hand."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.panels.elements import box, card, text


class SteerPanel:
    """A pad to drive by hand: hold it to drive, let go to stop.

    Args:
        steer: Is called with m/s forward and rad/s to the left again and again while the pad is held.
        release: Is called when it is let go.
    """

    _TURN_PER_SPEED = 2.0  # rad/s to the left at full deflection for each m/s of top speed

    def __init__(self, steer: Callable[[float, float], None], release: Callable[[], None]) -> None:
        self._steer = steer
        with card("Steer by hand", "panel steer"), box("row"):
            with box("pad").props('tabindex="0" role="application" aria-label="Drive pad: drag it, or use the keys"'):
                for turn in (0, 90, 180, 270):
                    box("arrow").style(f"transform: rotate({turn}deg)")
                box("knob")
            with box("side"):
                ui.label("Hold to drive, let go to stop. Arrow keys or W A S D work too.")
                self._label = text("speed", "")
                self._speed = ui.slider(min=0.1, max=1.0, step=0.1, value=0.5, on_change=self._show_speed)
                self._speed.props('aria-label="Top speed in metres a second"')
        self._show_speed()
        ui.on("pad_held", lambda event: self._drive(event.args))
        ui.on("pad_released", lambda _: release())

    def _drive(self, deflection: object) -> None:
        x, y = read_deflection(deflection)
        top: float = self._speed.value
        self._steer(y * top, -x * top * self._TURN_PER_SPEED)

    def _show_speed(self) -> None:
        self._label.set_text(f"Top speed {self._speed.value:.1f} m/s")


def read_deflection(sent: object) -> tuple[float, float]:
    """Return x (right) and y (forward) of the pad, -1 to 1, as a browser sent it; anything odd is 0."""
    values = sent if isinstance(sent, dict) else {}
    x, y = (_within_one(values.get(name)) for name in ("x", "y"))
    return x, y


def _within_one(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1:
        return 0.0
    return float(value)
