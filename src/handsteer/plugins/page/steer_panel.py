"""The card for manual steering: pad, gamepad, tilt, sliders, active input, and topic."""

from collections.abc import Callable
from dataclasses import dataclass

from nicegui import ui

from handsteer.clock import monotonic
from handsteer.errors import TransportError
from handsteer.messages import STEERING_CMD_VEL
from handsteer.plugins.page.elements import box, button, card, read_words, set_property, switch, text
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.steering_input import SteeringInput, read_deflection, read_number
from handsteer.plugins.page.viewers import LeaseStatus
from handsteer.types import ZERO, Velocity

_LONGEST_TOPIC = 200
_SLIDER_MPS, _SLIDER_RADPS, _SLIDER_STEP = 0.5, 1.0, 0.1
_TURN_PER_SPEED = 2.0  # of the pad: rad/s to the left at full deflection for each m/s of top speed
_HINTS = {
    "free": "Hold the pad, or its arrow keys. Sliders stay, until you leave this page.",
    "driver": "Hold the pad, or W A S D anywhere. Sliders stay, until you leave this page.",
    "watcher": "You watch: request control, at the top.",
}
_LATE = "Your command came too late and was ignored: is the network slow? If not, reload the page."


@dataclass(frozen=True)
class MuxInput:
    """One input of the twist mux.

    Attributes:
        name: Its display name.
        is_active: Whether it drives the robot, or stops it.
        viewer: The viewer whose input it is, while active; empty if unknown.
    """

    name: str
    is_active: bool
    viewer: str = ""


def mux_inputs(state: PageState) -> tuple[MuxInput, ...]:
    """Return the inputs in order of priority; at most one is active."""
    directly = bool(state.viewers.topic and state.viewers.steers)
    by_hand = not state.stopped and (directly or state.control.source == "steering")
    by_air = not state.stopped and not by_hand and state.control.source in ("signs", "joystick")
    return (
        MuxInput("Stop", state.stopped, state.viewers.stopped),
        MuxInput("Pad and keys", by_hand, state.viewers.steered or "another node"),
        MuxInput("Joystick" if state.is_joystick else "Signs", by_air),
    )


class _MuxRow:
    """The inputs in a row, with the active one highlighted."""

    def __init__(self) -> None:
        with box("mux").props('role="group" aria-label="The active input; the first one overrides the others"'):
            text("name", "Active input")
            self._chips = [text("source chip", name) for name in ("Stop", "Pad and keys", "Signs")]

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        for chip, each in zip(self._chips, mux_inputs(state), strict=True):
            chip.set_text(f"{each.name}: {each.viewer}" if each.is_active and each.viewer else each.name)
            set_property(chip, "aria-current", "true" if each.is_active else None)
            switch(chip, "holds", on=each.is_active)


class SteerPanel:
    """A pad that drives while it is held, and sliders that drive while the page is in front.

    In the browser, a gamepad and the tilt of a phone move the pad.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._input = SteeringInput()
        with card("Pad and keys", "panel steer") as self._card:
            self._mux = _MuxRow()
            button("Hold to drive by tilt", label="Hold to drive by tilting this device").classes("tilt")
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
                with box("sliders") as self._sliders:
                    self._linear = _Slider("Linear", "m/s", _SLIDER_MPS, self._slide, upright=True)
                    with box("across"):
                        self._angular = _Slider("Angular", "rad/s", _SLIDER_RADPS, self._slide, upright=False)
            with box("last"):
                button("Both to 0", self.release)
                self._hint = text("hint", _HINTS["free"])
            self._sticks = text("sticks", "").props('role="status"')
        self._show_speed()
        ui.on("pad_held", lambda event: self._hold_pad(event.args))
        ui.on("sliders_held", lambda event: self._keep_sliders(event.args))
        ui.on("let_go", self.release)
        ui.on("sticks", lambda event: self._sticks.set_text(read_words(event.args)))

    def update(self, state: PageState, lease: LeaseStatus) -> None:
        """Show ``state`` to a viewer with ``lease``; sliders of others, and of a stopped robot, are at 0."""
        self._mux.update(state)
        self._input.end_if_silent(monotonic())
        can_steer = lease.role != "watcher" and not state.stopped
        if not can_steer:
            self._input.sliders = ZERO
        self._show_sliders()
        rule = state.control.rule
        limits = (rule.max_linear, rule.max_angular) if rule else (0.0, 0.0)
        for slider, limit in zip((self._linear, self._angular), limits, strict=True):
            slider.enable(on=can_steer)
            if all(limits):
                slider.restrict(limit)
        self._hint.set_text(_LATE if self._input.is_late else _HINTS[lease.role])
        switch(self._hint, "late", on=self._input.is_late)
        switch(self._card, "yours", on=lease.role == "driver")

    def release(self) -> None:
        """Stop steering from this page and set the sliders to zero."""
        self._input.sliders = ZERO
        self._show_sliders()
        self._page.do(DashboardNode.release)

    def _hold_pad(self, sent: object) -> None:
        x, y = read_deflection(sent)
        wanted = Velocity(y * self._top_mps, -x * self._top_mps * _TURN_PER_SPEED)
        self._steer(self._input.hold_pad(wanted, _sent_ms(sent), monotonic()))

    def _keep_sliders(self, sent: object) -> None:
        touched = sent.get("touched") if isinstance(sent, dict) else None
        for wanted in self._input.keep_sliders(_sent_ms(sent), touched, monotonic()):
            self._steer(wanted)
        self._show_sliders()

    def _slide(self) -> None:
        wanted = Velocity(self._linear.value, self._angular.value)
        if wanted == self._input.sliders:
            return
        if wanted.is_zero:
            self.release()
        else:
            self._input.slide(wanted, monotonic())
            self._show_sliders()

    def _steer(self, wanted: Velocity | None) -> None:
        self._show_sliders()
        if wanted is not None:
            self._page.do(lambda node, viewer: node.steer(viewer, wanted.linear_mps, wanted.angular_radps))

    def _show_sliders(self) -> None:
        self._linear.show(self._input.sliders.linear_mps)
        self._angular.show(self._input.sliders.angular_radps)
        switch(self._sliders, "set", on=not self._input.sliders.is_zero)

    def _show_speed(self) -> None:
        self._label.set_text(f"Top speed {self._top_mps:.1f} m/s")

    @property
    def _top_mps(self) -> float:
        return read_number(self._speed.value, 0.0, 1.0, 0.0)


def _sent_ms(sent: object) -> object:
    return sent.get("at") if isinstance(sent, dict) else None


class _Slider:
    """A slider that stays where it is set, as in rqt_robot_steering, with editable limits and step buttons.

    Positive is up or left (REP 103). Its limits are within plus and minus ``bound``.
    """

    def __init__(self, name: str, unit: str, bound: float, change: Callable[[], None], *, upright: bool) -> None:
        self.value = 0.0
        self._change = change
        self._bound, self._low, self._high = bound, -bound, bound
        high, low = ("max", "min") if upright else ("left", "right")
        more, less = ("+", "\u2212") if upright else ("\u2039", "\u203a")
        up, down = ("faster forward", "slower, then backward") if upright else ("more to the left", "more to the right")
        with box(f"slider {name.lower()}"):
            with box("line"):
                text("name", name)
                self._label = text("value", "0.00")
                text("unit", unit)
            self._slider = ui.slider(min=-bound, max=bound, step=0.05, value=0.0, on_change=self._on_slide)
            way = "vertical reverse" if upright else "reverse"
            self._slider.props(f'{way} aria-label="{name} velocity, in {unit}" selection-color="transparent"')
            with box("ends"):
                self._highest = self._limit(f"{name}: {high}", high, bound)
                self._buttons = [
                    button(more, lambda: self._take(self.value + _SLIDER_STEP), up),
                    button("0", lambda: self._take(0.0), f"{name} to 0"),
                    button(less, lambda: self._take(self.value - _SLIDER_STEP), down),
                ]
                self._lowest = self._limit(f"{name}: {low}", low, -bound)
        self._show_bound()

    def show(self, value: float) -> None:
        """Set the slider to ``value`` without calling back."""
        self.value = value
        self._slider.set_value(value)
        self._label.set_text(f"{value + 0.0:.2f}")

    def restrict(self, bound: float) -> None:
        """Restrict the limits to ``bound``, which is positive."""
        if bound != self._bound:
            self._bound = bound
            self._show_bound()
            self._read_limits()

    def enable(self, *, on: bool) -> None:
        """Enable or disable the slider and its step buttons."""
        if self._slider.enabled != on:
            self._slider.set_enabled(on)
            for each in self._buttons:
                set_property(each, "disabled", not on)

    def _limit(self, label: str, name: str, value: float) -> ui.number:
        number = ui.number(name, value=value, step=_SLIDER_STEP, format="%.2f", on_change=self._read_limits)
        return number.props(f'dense outlined aria-label="{label}"').classes("limit")

    def _show_bound(self) -> None:
        self._highest.min, self._highest.max = 0.0, self._bound
        self._lowest.min, self._lowest.max = -self._bound, 0.0

    def _read_limits(self) -> None:
        self._high = read_number(self._highest.value, 0.0, self._bound, self._high)
        self._low = read_number(self._lowest.value, -self._bound, 0.0, self._low)
        self._slider.props["max"], self._slider.props["min"] = self._high, self._low
        self._take(self.value)

    def _on_slide(self) -> None:
        value = round(read_number(self._slider.value, self._low, self._high, 0.0), 2)
        if value != self.value:  # moved by the viewer, not by show()
            self._take(value)

    def _take(self, value: float) -> None:
        self.show(round(max(self._low, min(value, self._high)), 2))
        self._change()


class TopicPanel:
    """The name of the steering topic, which the viewer may change if it ``has_choice``, and its consequences."""

    def __init__(self, page: Page, steering: SteerPanel, *, has_choice: bool) -> None:
        self._page, self._steering = page, steering
        self._shown = ""
        with card("Steering topic", "panel topic"):
            self._name = ui.input("topic", value=STEERING_CMD_VEL.name).props("dense outlined")
            self._name.props(f"maxlength={_LONGEST_TOPIC} spellcheck=false autocapitalize=off")
            if has_choice:
                self._name.on("keydown.enter", self._use)
                button("Use", self._use, "Steer on this topic")
            else:
                self._name.props("readonly")
            self._note = text("topic-words", "")
            self._error = text("trouble", "").props('role="alert"')

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        topic = state.viewers.topic
        shown = topic or STEERING_CMD_VEL.name
        if shown == self._shown:
            return  # or it would replace what the viewer is typing
        self._shown = shown
        self._name.set_value(shown)
        self._note.set_text(
            "Past the control: signs may drive at the same time. Stop works here too. "
            f"{STEERING_CMD_VEL.name} goes back."
            if topic
            else "Goes through the control, before the hand."
        )
        switch(self._note, "direct", on=bool(topic))

    def _use(self) -> None:
        topic = str(self._name.value)[:_LONGEST_TOPIC].strip()
        self._steering.release()
        self._error.set_text("")
        try:
            self._page.do(lambda node, viewer: node.steer_on(viewer, topic))
        except TransportError as error:
            self._error.set_text(str(error))
