"""The panels of the page: each builds its elements once and then only changes what has changed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

from nicegui import ui

from handsteer.cameras.browser import ChoiceOfCameras
from handsteer.dashboard.legend import LEGEND
from handsteer.dashboard.seat import Place, Role
from handsteer.dashboard.state import PageState
from handsteer.signs.vocabulary import NONE

_UNKNOWN = "--"
_DRIVERS = {"signs": "your signs", "steering": "hand steering", "nobody": "nobody"}


@contextmanager
def card(title: str, classes: str) -> Iterator[None]:
    """Put what follows into a card with a heading."""
    with ui.element("section").classes(f"card {classes}"):
        _tag("h2", "", title)
        yield


class Banner:
    """The sentence: what the robot does, and why; and the button that stops it.

    Args:
        halt: Is called to stop the robot.
        reset: Is called to let it be driven again.
    """

    def __init__(self, halt: Callable[[], None], reset: Callable[[], None]) -> None:
        with ui.element("section").classes("card banner").props('role="status"') as self._banner:
            _box("lamp")
            self._headline = _text("headline", "Starting")
            self._reason = _text("reason", "waiting for the first report")
            with _box("buttons"):
                self._reset = _button("Reset", 'aria-label="Reset: let the robot be driven again"').on("click", reset)
                self._stop = _button("Stop", 'aria-label="Stop the robot (space key)" aria-keyshortcuts="Space"')
                self._stop.classes("stop").on("click", halt)
        ui.on("space", halt)
        self._mood = ""

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._headline.set_text(state.headline)
        self._reason.set_text(state.reason)
        _switch(self._reset, "hidden", on=not state.stopped)
        if state.mood != self._mood:
            self._banner.classes(remove=self._mood, add=state.mood)
            self._mood = state.mood


class CameraPanel:
    """The mirrored picture, what was understood of it, and whose camera it is from.

    Args:
        picture_url: Where the stream of pictures is.
        cameras: What there is to choose from; None where there is no choice.
        viewer: Who looks at this page.
        use_own: Is called to choose the camera of the machine that handsteer runs on.
    """

    def __init__(
        self, picture_url: str, cameras: ChoiceOfCameras | None, viewer: str, use_own: Callable[[], None]
    ) -> None:
        self._cameras = cameras
        with ui.element("section").classes("card viewer camera"):
            with _box("stage"):
                # Lazy, because a page counts as loaded only when its other pictures have come.
                picture = ui.element("img").props('loading="lazy" alt="What the camera sees, mirrored"')
                picture.props(f'src="{picture_url}"')
                with _box("veil") as self._veil:
                    self._excuse = _text("", "waiting for the first picture")
                _text("caption", "as in a mirror")
            with _box("foot"):
                self._sign = _text("sign", "No sign")
                with _box("meter"):
                    self._confidence = _box("")
                self._percent = _text("percent", "")
                self._hand = _text("hand", "")
            if cameras is not None:
                self._choice(viewer, use_own)
        self._width = 0

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        # A sign that counts goes on counting for a moment in which it is not seen.
        shown = state.sign if state.seen == NONE else state.seen
        self._sign.set_text("No sign" if shown == NONE else shown)
        _switch(self._sign, "pending", on=shown != state.sign)
        self._hand.set_text(f"{state.handedness} hand" if state.handedness else "No hand")
        percent = round(100 * state.confidence) if state.seen != NONE else 0
        self._percent.set_text(f"{percent} %" if percent else "")
        if percent != self._width:
            self._confidence.style(f"width: {percent}%")
            self._width = percent
        self._excuse.set_text(state.no_picture)
        _switch(self._veil, "off", on=not state.no_picture)
        if self._cameras is not None:
            self._show_choice(self._cameras.source)

    def _choice(self, viewer: str, use_own: Callable[[], None]) -> None:
        self._chosen = ""
        with _box("foot choice"):
            self._browsers = _button("Use this device's camera", f'data-camera="browser" data-viewer="{viewer}"')
            self._own = _button("Use the robot's camera", 'data-camera="own"')
            self._trouble = _text("trouble", "").props('role="alert"')
        self._own.on("click", use_own)
        ui.on("webcam", lambda event: self._trouble.set_text(str(event.args.get("words", ""))))

    def _show_choice(self, source: str) -> None:
        if source != self._chosen:
            self._chosen = source
            _switch(self._browsers, "hidden", on=source == "browser")
            _switch(self._own, "hidden", on=source == "own")


class SeatPanel:
    """Whether this viewer drives, and the way to the driver's seat.

    Args:
        ask: Is called to ask for it.
        answer: Is called with True to hand it over, with False to keep it.
    """

    _WORDS: ClassVar[dict[Role, str]] = {"driver": "you drive", "watcher": "you watch", "free": "nobody drives"}

    def __init__(self, ask: Callable[[], None], answer: Callable[[bool], None]) -> None:
        with _box("seat"):
            self._question = _text("question", "")
            self._words = _text("role chip", "")
            self._ask = _button("Ask to drive", "").on("click", ask)
            self._yes = _button("Hand over", "").on("click", lambda: answer(True))
            self._no = _button("Keep", "").on("click", lambda: answer(False))

    def update(self, place: Place) -> None:
        """Show what the seat is for this viewer."""
        is_driver = place.role == "driver"
        asks = f"Somebody asks to drive; unanswered, they do in {place.left_s:.0f} s"
        waits = f"You drive in {place.left_s:.0f} s, or sooner"
        self._question.set_text((asks if is_driver else waits) if place.asked else "")
        self._words.set_text(self._WORDS[place.role])
        _switch(self._ask, "hidden", on=is_driver or place.asked)
        for button in (self._yes, self._no):
            _switch(button, "hidden", on=not (is_driver and place.asked))


class RobotFoot:
    """How far the robot went, what it bumped into, and who drives it."""

    def __init__(self) -> None:
        with _box("foot"):
            self._driver = _fact("driven by")
            self._path = _fact("path")
            self._bumps = _fact("bumps")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        self._driver.set_text(_DRIVERS.get(state.driver, state.driver))
        self._path.set_text(_UNKNOWN if state.path_length_m is None else f"{state.path_length_m:.1f} m")
        self._bumps.set_text(_UNKNOWN if state.collisions is None else str(state.collisions))


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


class TimingPanel:
    """How quick it is."""

    def __init__(self) -> None:
        with card("Camera to command", "panel timing"), _box("figures"):
            self._median = _figure("ms", "median")
            self._p99 = _figure("ms", "99 of 100 below")
            self._fps = _figure("frames/s", "camera")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        for label, value, digits in (
            (self._median, state.latency_median_ms, 1),
            (self._p99, state.latency_p99_ms, 1),
            (self._fps, state.fps, 1),
        ):
            label.set_text(_UNKNOWN if value is None else f"{value:.{digits}f}")


class SteerPanel:
    """A pad to drive by hand: hold it to drive, let go to stop.

    Args:
        steer: Is called with m/s forward and rad/s to the left again and again while the pad is held.
        release: Is called when it is let go.
    """

    _TURN_PER_SPEED = 2.0  # rad/s to the left at full deflection for each m/s of top speed

    def __init__(self, steer: Callable[[float, float], None], release: Callable[[], None]) -> None:
        self._steer = steer
        with card("Steer by hand", "panel steer"), _box("row"):
            with _box("pad").props('tabindex="0" role="application" aria-label="Drive pad: drag it, or use the keys"'):
                for turn in (0, 90, 180, 270):
                    _box("arrow").style(f"transform: rotate({turn}deg)")
                _box("knob")
            with _box("side"):
                ui.label("Hold to drive, let go to stop. Arrow keys or W A S D work too.")
                self._label = _text("speed", "")
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


class SignsPanel:
    """Which sign does what; the one that counts is lit."""

    def __init__(self) -> None:
        self._lit = NONE
        self._tiles: dict[str, ui.element] = {}
        with card("The signs", "panel legend"), _box("signs"):
            for entry in LEGEND:
                with _box("sign-tile") as tile:
                    ui.html(entry.drawing, sanitize=False)
                    with _box("words"):
                        _text("name", entry.sign)
                        _text("pose", entry.pose)
                        _text("effect", entry.effect)
                self._tiles[entry.sign] = tile

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        if state.sign == self._lit:
            return
        for sign in {self._lit, state.sign} & self._tiles.keys():
            _switch(self._tiles[sign], "seen", on=sign == state.sign)
        self._lit = state.sign


def read_deflection(sent: object) -> tuple[float, float]:
    """Return x (right) and y (forward) of the pad, -1 to 1, as a browser sent it; anything odd is 0."""
    values = sent if isinstance(sent, dict) else {}
    x, y = (_within_one(values.get(name)) for name in ("x", "y"))
    return x, y


def _within_one(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1:
        return 0.0
    return float(value)


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
        with _box("axis"):
            with _box("line"):
                _text("", name)
                self._measured = _text("value", "0.00")
                _text("unit", unit)
            with _box("bar"):
                self._fill = _box("fill")
                self._mark = _box("mark")
            with _box("ends"):
                _text("", ends[0])
                self._commanded = _text("", "")
                _text("", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")
        shown = bar(commanded, measured, self._scale)
        if shown != self._shown:
            self._shown = shown
            self._fill.style(f"left: {shown.left}%; width: {shown.width}%")
            self._mark.style(f"left: {shown.mark}%")


def _figure(unit: str, name: str) -> ui.label:
    with _box("figure"):
        with _box(""):
            value = ui.label(_UNKNOWN).classes("value").style("display: inline")
            ui.label(unit).classes("unit").style("display: inline")
        _text("name", name)
    return value


def _fact(name: str) -> ui.label:
    with _box("fact"):
        ui.label(name).style("display: inline")
        return _tag("b", "", _UNKNOWN)


def _switch(element: ui.element, name: str, *, on: bool) -> None:
    element.classes(add=name if on else "", remove="" if on else name)


def _button(text: str, props: str) -> ui.element:
    with ui.element("button").classes("text-button").props(f'type="button" {props}') as button:
        ui.label(text).style("display: inline")
    return button


def _box(classes: str) -> ui.element:
    return ui.element("div").classes(classes)


def _text(classes: str, text: str) -> ui.label:
    return ui.label(text).classes(classes)


def _tag(tag: str, classes: str, text: str) -> ui.label:
    label = ui.label(text).classes(classes)
    label.tag = tag
    return label
