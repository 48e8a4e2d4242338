"""Manual steering: pad, sliders, active input, and topic."""

from collections.abc import Callable
from dataclasses import dataclass

from nicegui import ui

from handsteer.dashboard.elements import box, button, card, switch, text
from handsteer.dashboard.pad_input import PadInput
from handsteer.dashboard.sliders import Sliders, read_limit
from handsteer.dashboard.state import PageState
from handsteer.dashboard.viewers import LeaseStatus
from handsteer.errors import TransportError
from handsteer.messages import STEERING_CMD_VEL
from handsteer.types import Velocity

_LONGEST = 200


class TopicBox:
    """The steering topic's name, and its consequences.

    Args:
        choose: Called with another name; raises TransportError if it is rejected. None if there is no choice.
    """

    def __init__(self, choose: Callable[[str], None] | None) -> None:
        self._choose = choose
        self._shown = ""
        with box("topic"):
            self._name = ui.input("topic", value=STEERING_CMD_VEL.name).props(f"dense outlined maxlength={_LONGEST}")
            self._name.props("spellcheck=false autocapitalize=off")
            if choose is None:
                self._name.props("readonly")
            else:
                self._name.on("keydown.enter", self._use)
                button("Use", 'aria-label="Steer on this topic"').on("click", self._use)
        self._words = text("topic-words", "")
        self._trouble = text("trouble", "").props('role="alert"')

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        topic = state.viewers.topic
        shown = topic or STEERING_CMD_VEL.name
        if shown == self._shown:
            return
        self._shown = shown
        self._name.set_value(shown)
        self._words.set_text(
            f"Past the control: signs may drive meanwhile. Stop holds here too. {STEERING_CMD_VEL.name} goes back."
            if topic
            else "Goes through the control, before the signs."
        )
        switch(self._words, "direct", on=bool(topic))

    def _use(self) -> None:
        if self._choose is None:
            return
        try:
            self._choose(str(self._name.value)[:_LONGEST].strip())
        except TransportError as error:
            self._trouble.set_text(str(error))
        else:
            self._trouble.set_text("")


@dataclass(frozen=True)
class Entry:
    """One input of the twist mux.

    Attributes:
        name: Its display name.
        holds: Whether it is active.
        whose: The viewer whose input it is, while active; empty if unknown.
    """

    name: str
    holds: bool
    whose: str = ""


def entries(state: PageState) -> tuple[Entry, ...]:
    """Return the inputs in order of priority; at most one is active."""
    directly = bool(state.viewers.topic and state.viewers.steers)
    by_hand = not state.stopped and (directly or state.driver == "steering")
    by_signs = not state.stopped and not by_hand and state.driver == "signs"
    return (
        Entry("Stop", state.stopped, state.viewers.stopped),
        Entry("By hand", by_hand, state.viewers.steers or "another node"),
        Entry("Signs", by_signs),
    )


class MuxPanel:
    """The inputs in a row, with the active one highlighted."""

    def __init__(self) -> None:
        self._shown: tuple[Entry, ...] = ()
        with box("mux").props('role="group" aria-label="Who drives; the first goes before the others"'):
            text("name", "Who drives")
            self._chips = [text("source chip", name) for name in ("Stop", "By hand", "Signs")]

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        shown = entries(state)
        if shown == self._shown:
            return
        self._shown = shown
        for chip, entry in zip(self._chips, shown, strict=True):
            chip.set_text(f"{entry.name}: {entry.whose}" if entry.holds and entry.whose else entry.name)
            chip.props('aria-current="true"' if entry.holds else "", remove="" if entry.holds else "aria-current")
            switch(chip, "holds", on=entry.holds)


_HINTS = {
    "free": "Hold the pad, or its arrow keys. Sliders stay, until you leave this page.",
    "driver": "Hold the pad, or W A S D anywhere. Sliders stay, until you leave this page.",
    "watcher": "You watch: request control, at the top.",
}
_LATE = "What you asked for came too late, and was left out: is the network slow? Else load the page anew."


class SteerPanel:
    """A pad that drives while it is held, and sliders that drive while the page is in front.

    Args:
        steer: Called repeatedly with m/s forward and rad/s to the left while the robot is to move.
        release: Called to stop.
        now: Returns seconds of a monotonic clock.
        choose_topic: Called with the name of another topic to steer on; None if there is no choice.
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
        self._manual = PadInput()
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

    def update(self, state: PageState, place: LeaseStatus) -> None:
        """Show ``state`` to a viewer with ``place``; sliders of others, and of a stopped robot, are at 0."""
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
        """Stop steering from this page and set the sliders to zero."""
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
    """Return the pad's x (right) and y (forward), -1 to 1, as sent by a browser; 0 for invalid values."""
    values = sent if isinstance(sent, dict) else {}
    x, y = (_within_one(values.get(name)) for name in ("x", "y"))
    return x, y


def _within_one(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1:
        return 0.0
    return float(value)


def _sent_ms(sent: object) -> object:
    return sent.get("at") if isinstance(sent, dict) else None
