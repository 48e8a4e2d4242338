"""The page ``/``: camera, recognised sign, robot state, world, and manual steering."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from nicegui import ui

from handsteer.config import ControlConfig
from handsteer.control.explain import figures_of
from handsteer.dashboard.camera import CameraPanel
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import STATIC, UNKNOWN, Page, PageContext, box, card, switch, tag, text
from handsteer.dashboard.state import PageState
from handsteer.dashboard.steer_panel import SteerPanel
from handsteer.dashboard.world_panel import WorldPanel
from handsteer.dashboard.world_state import SPAN_S, Sample, VelocityHistory
from handsteer.types import (
    BACKWARD,
    EFFECTS,
    FORWARD,
    GO,
    NONE,
    SIGNS,
    STOP,
    TURN_LEFT,
    TURN_RIGHT,
    Velocity,
    action_of,
)

_PLOT_EVERY = 3
"""The plots are updated every third time the page is: samples are not urgent."""


class DrivePage(Page):
    """Drives the robot, and explains its behaviour."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/", "drive.css", "steer.css", "steer.js", "world.css", "webcam.js")
        graph = context.graph
        self._camera = CameraPanel(self, graph)
        self._world = WorldPanel(self, graph)
        with box("panels"):
            self._velocity = VelocityPanel()
            self._timing = TimingPanel()
            self._steering = SteerPanel(self, has_topics=graph is None)
            self._legend = LegendPanel()
        self._updates = 0

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        self._world.update(state, node.world)
        for panel in (self._camera, self._velocity, self._timing, self._legend):
            panel.update(state)
        self._steering.update(state, self.lease(node))
        self._updates += 1
        if self._updates % _PLOT_EVERY == 0:
            self._velocity.draw(node.history, node.clock.now())


class TimingPanel:
    """Latency and frame rate."""

    def __init__(self) -> None:
        with card("Camera to command", "panel timing"), box("figures"):
            self._median = _figure("ms", "median")
            self._p99 = _figure("ms", "99 of 100 below")
            self._fps = _figure("frames/s", "camera")

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        for label, value in (
            (self._median, state.latency_median_ms),
            (self._p99, state.latency_p99_ms),
            (self._fps, state.fps),
        ):
            label.set_text(UNKNOWN if value is None else f"{value:.1f}")


def _figure(unit: str, name: str) -> ui.label:
    with box("figure"):
        with box(""):
            value = text("value", UNKNOWN).style("display: inline")
            text("unit", unit).style("display: inline")
        text("name", name)
    return value


Row = tuple[float, float | None, float | None]
"""Seconds, and the commanded and measured velocity in m/s or rad/s; None if missing."""


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
    """The commanded and measured velocities, as figures, and as plots of the last 30 s."""

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
                axis.plot.run_method("add", rows, afresh)

    def _begin(self) -> None:
        self._sent = None


class _Plot(ui.element, component=STATIC / "plot.js"):
    """Two lines, stored in the browser; a plotting library would be a megabyte, and would send all points each time."""


class _Axis:
    def __init__(self, name: str, unit: str, *, least: float, ends: tuple[str, str], begin: Callable[[], None]) -> None:
        with box("axis"):
            with box("line"):
                text("name", name)
                self._commanded = text("told", "")
                self._measured = text("value", "0.00")
                text("unit", unit)
            with box("frame"):
                self.plot = _Plot().props(f'aria-label="{name} velocity over the last 30 s; its figures stand above"')
                self.plot.props(f":span={SPAN_S} :least={least}").on("begin", begin)
                text("end up", ends[0])
                text("end down", ends[1])

    def update(self, commanded: float, measured: float) -> None:
        # Adding zero turns -0.00 into 0.00.
        self._measured.set_text(f"{round(measured, 2) + 0.0:.2f}")
        self._commanded.set_text(f"commanded {round(commanded, 2) + 0.0:.2f}")


# The user's right hand in a mirror, in a box of 64 x 64: the palm, then the fingers as thick lines. The thumb is on the
# left, where a mirror shows the thumb of a right hand with its palm turned to it.
_PALM = '<rect x="20" y="30" width="26" height="26" rx="10" class="palm"/>'
_FINGER = '<path d="M{x} 34V{top}" class="finger"/>'
_FIST = _PALM + "".join(_FINGER.format(x=x, top=29) for x in (23, 30, 37, 43))
_TUCKED_THUMB = '<path d="M20 44L33 47" class="finger thumb"/>'
_THUMB_LEFT = _FIST + '<path d="M24 40L6 36" class="finger"/>'
_FINGERS = "".join(_FINGER.format(x=x, top=top) for x, top in ((23, 13), (30, 8), (37, 10), (43, 17)))
_OPEN_PALM = f'{_PALM}{_FINGERS}<path d="M22 46L9 34" class="finger"/>'
_INDEX_UP = _FIST + _FINGER.format(x=23, top=9) + _TUCKED_THUMB


def _svg(shapes: str, transform: str = "", classes: str = "") -> str:
    return (
        f'<svg viewBox="0 0 64 64" aria-hidden="true" class="{classes}"><g transform="{transform}">{shapes}</g></svg>'
    )


_DRAWN: Mapping[str, tuple[str, str]] = {
    FORWARD: ("index finger up", _svg(_INDEX_UP)),
    BACKWARD: ("index finger down", _svg(_INDEX_UP, "rotate(180 32 32)")),
    STOP: ("open palm", _svg(_OPEN_PALM)),
    TURN_LEFT: ("thumb to your left", _svg(_THUMB_LEFT)),
    TURN_RIGHT: ("thumb to your right", _svg(_THUMB_LEFT, "matrix(-1 0 0 1 64 0)")),
    GO: ("closed fist", _svg(_FIST + _TUCKED_THUMB)),
}
_TAUGHT = ("taught", _svg(_OPEN_PALM, classes="taught"))  # it may have any shape


@dataclass(frozen=True)
class LegendEntry:
    """One sign and its action.

    Attributes:
        sign: Its name on ``/gesture/hand_sign``.
        pose: How to hold the hand.
        drawing: SVG.
        effect: What the robot does.
        figures: Step and limit; empty if not applicable.
    """

    sign: str
    pose: str
    drawing: str
    effect: str
    figures: str


def legend(signs: tuple[str, ...], rule: ControlConfig | None) -> tuple[LegendEntry, ...]:
    """Return the legend of ``signs``: shipped ones first, in the page's order.

    Args:
        signs: The signs that the classifier recognises.
        rule: Configures the signs' actions; None if unknown, which gives the default actions, without figures.
    """

    def entry(sign: str) -> LegendEntry:
        action = action_of(sign, rule.actions if rule else {})
        # The semicolon precedes what does not change, which is left out for brevity.
        effect = EFFECTS[action].partition(";")[0]
        return LegendEntry(sign, *_DRAWN.get(sign, _TAUGHT), effect, figures_of(action, rule) if rule else "")

    order = [*(sign for sign in _DRAWN if sign in signs), *(sign for sign in signs if sign not in _DRAWN)]
    return tuple(entry(sign) for sign in order)


class LegendPanel:
    """The signs and their actions as reported by the nodes; the active sign is highlighted."""

    def __init__(self) -> None:
        self._active = NONE
        self._shown: tuple[LegendEntry, ...] = ()
        self._tiles: dict[str, ui.element] = {}
        with card("The signs", "panel legend"):
            self._box = box("signs")
        self._fill(legend(SIGNS, None))

    def update(self, state: PageState) -> None:
        """Show ``state``."""
        entries = legend(state.signs, state.rule)
        if entries != self._shown:
            self._fill(entries)
        if state.sign != self._active:
            for sign in {self._active, state.sign} & self._tiles.keys():
                switch(self._tiles[sign], "seen", on=sign == state.sign)
            self._active = state.sign

    def _fill(self, entries: tuple[LegendEntry, ...]) -> None:
        self._shown = entries
        self._active = NONE
        self._box.clear()
        with self._box:
            self._tiles = {entry.sign: _tile(entry) for entry in entries}


def _tile(entry: LegendEntry) -> ui.element:
    with box("sign-tile") as tile:
        ui.html(entry.drawing, sanitize=False)
        with box("words"):
            text("name", entry.sign)
            text("pose", entry.pose)
            text("effect", entry.effect)
            if entry.figures:
                text("figures", entry.figures)
    return tile
