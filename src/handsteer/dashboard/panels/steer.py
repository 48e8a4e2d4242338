"""Steering by hand."""

from collections.abc import Callable

from nicegui import ui

from handsteer.dashboard.manual import Manual
from handsteer.dashboard.panels.elements import box, button, card, switch, text
from handsteer.dashboard.panels.mux import MuxPanel
from handsteer.dashboard.panels.sliders import Sliders, read_limit
from handsteer.dashboard.panels.topic import TopicBox
from handsteer.dashboard.seat import Place
from handsteer.dashboard.state import PageState
from handsteer.types import Velocity

_HINTS = {
    "free": "Hold the pad, or its arrow keys. Sliders stay, until you leave this page.",
    "driver": "Hold the pad, or W A S D anywhere. Sliders stay, until you leave this page.",
    "watcher": "You watch: ask for the seat, at the top.",
}
_LATE = "What you asked for came too late, and was left out: is the network slow? Else load the page anew."


class SteerPanel:
    """A pad that drives while it is held, and sliders that drive while the page is in front.

    Args:
        steer: Is called with m/s forward and rad/s to the left again and again while the robot is to go on.
        release: Is called when it is to stop.
        now: Returns seconds of a monotonic clock.
        choose_topic: Is called with the name of another topic to steer on; None where there is no choice.
    """

    _TURN_PER_SPEED = 2.0  # rad/s to the left at full deflection for each m/s of top speed

    def __init__(
        self,
        steer: Callable[[float, float], None],
        release: Callable[[], None],
        now: Callable[[], float],
        choose_topic: Callable[[str], None] | None,
    ) -> None:
        self._steer = steer
        self._release = release
        self._now = now
        self._manual = Manual()
        with card("Steer by hand", "panel steer") as self._card:
            self._mux = MuxPanel()
            with box("row"):
                with box("pad-side"):
                    with box("pad").props(
                        'tabindex="0" role="application" aria-label="Drive pad: drag it, or use the keys"'
                    ):
                        for turn in (0, 90, 180, 270):
                            box("arrow").style(f"transform: rotate({turn}deg)")
                        box("knob")
                    self._label = text("speed", "")
                    self._speed = ui.slider(min=0.1, max=1.0, step=0.1, value=0.5, on_change=self._show_speed)
                    self._speed.props('aria-label="Top speed of the pad in metres a second"')
                self._sliders = Sliders(self._slide)
                with self._sliders.across:
                    self._topic = TopicBox(choose_topic)
            with box("last"):
                button("Both to 0", "").on("click", self.let_go)
                self._hint = text("hint", _HINTS["free"])
        self._show_speed()
        ui.on("pad_held", lambda event: self._hold(event.args))
        ui.on("sliders_held", lambda event: self._keep_on(event.args))
        ui.on("let_go", self.let_go)

    def update(self, state: PageState, place: Place) -> None:
        """Show ``state`` to a viewer who has ``place``; sliders of others, and of a robot that is stopped, are at 0."""
        self._mux.update(state)
        self._topic.update(state)
        watches = place.role == "watcher"
        self._manual.end_if_silent(self._now())
        if watches or state.stopped:
            self._manual.let_go()
        self._sliders.show(self._manual.sliders)
        self._sliders.enable(on=not (watches or state.stopped))
        if state.max_linear_mps and state.max_angular_radps:
            self._sliders.limit(state.max_linear_mps, state.max_angular_radps)
        self._hint.set_text(_LATE if self._manual.is_late else _HINTS[place.role])
        switch(self._hint, "late", on=self._manual.is_late)
        switch(self._card, "yours", on=place.role == "driver")

    def let_go(self) -> None:
        """Stop what is steered from here; the sliders go to zero."""
        self._manual.let_go()
        self._sliders.show(self._manual.sliders)
        self._release()

    def _hold(self, sent: object) -> None:
        x, y = read_deflection(sent)
        top = self._top_mps
        wanted = Velocity(y * top, -x * top * self._TURN_PER_SPEED)
        self._follow(self._manual.hold_pad(wanted, _sent_ms(sent), self._now()))

    def _slide(self, wanted: Velocity) -> None:
        if wanted.is_zero:
            self.let_go()
        else:
            self._manual.slide(wanted, self._now())

    def _keep_on(self, sent: object) -> None:
        self._follow(self._manual.keep_on(_sent_ms(sent), self._now()))

    def _follow(self, wanted: Velocity | None) -> None:
        self._sliders.show(self._manual.sliders)
        if wanted is not None:
            self._steer(wanted.linear_mps, wanted.angular_radps)

    def _show_speed(self) -> None:
        self._label.set_text(f"Top speed {self._top_mps:.1f} m/s")

    @property
    def _top_mps(self) -> float:
        return read_limit(self._speed.value, 0.0, 1.0, 0.0)


def read_deflection(sent: object) -> tuple[float, float]:
    """Return x (right) and y (forward) of the pad, -1 to 1, as a browser sent it; anything odd is 0."""
    values = sent if isinstance(sent, dict) else {}
    x, y = (_within_one(values.get(name)) for name in ("x", "y"))
    return x, y


def _within_one(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1:
        return 0.0
    return float(value)


def _sent_ms(sent: object) -> object:
    return sent.get("at") if isinstance(sent, dict) else None
