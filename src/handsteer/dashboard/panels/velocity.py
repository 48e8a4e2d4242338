"""The velocities as bars."""

from dataclasses import dataclass

from handsteer.dashboard.panels.elements import box, card, text
from handsteer.dashboard.state import PageState


class VelocityPanel:
    """Both velocities: a bar for the measured one, a mark for the commanded one."""

    def __init__(self) -> None:
        with card("Velocity", "panel velocity"):
            self._linear = _Axis("Linear", "m/s", scale=1.0, ends=("backward", "forward"), sign=1)
            # Left is positive (REP 103), and stands at the left.
            self._angular = _Axis("Angular", "rad/s", scale=2.0, ends=("left", "right"), sign=-1)

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._linear.update(state.commanded.linear_mps, state.measured.linear_mps)
        self._angular.update(state.commanded.angular_radps, state.measured.angular_radps)


@dataclass(frozen=True)
class Bar:
    """A bar that starts in the middle: where it begins and how long it is, in percent of its track."""

    left: float
    width: float
    mark: float


def bar(commanded: float, measured: float, scale: float) -> Bar:
    """Return the bar of ``measured`` with a mark at ``commanded``; ``scale`` is the value at the right end."""
    at, mark = (50 + 50 * max(-1.0, min(value / scale, 1.0)) for value in (measured, commanded))
    return Bar(round(min(at, 50.0), 1), round(abs(at - 50), 1), round(mark, 1))


class _Axis:
    def __init__(self, name: str, unit: str, *, scale: float, ends: tuple[str, str], sign: int) -> None:
        self._scale = scale * sign
        self._shown: Bar | None = None
        with box("axis"):
            with box("line"):
                text("", name)
                self._measured = text("value", "0.00")
                text("unit", unit)
            with box("bar"):
                self._fill = box("fill")
                self._mark = box("mark")
            with box("ends"):
                text("", ends[0])
                self._commanded = text("", "")
                text("", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")
        shown = bar(commanded, measured, self._scale)
        if shown != self._shown:
            self._shown = shown
            self._fill.style(f"left: {shown.left}%; width: {shown.width}%")
            self._mark.style(f"left: {shown.mark}%")
