"""The page ``/``: camera, recognised sign, robot state, world, and manual steering."""

from collections.abc import Callable, Sequence

from nicegui import ui

from handsteer.dashboard.camera import CameraPanel
from handsteer.dashboard.legend import LegendPanel
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import STATIC, Page, PageContext, box, card, tag, text
from handsteer.dashboard.record_panel import RecordPanel
from handsteer.dashboard.state import PageState
from handsteer.dashboard.steer_panel import SteerPanel, TopicPanel
from handsteer.dashboard.world_panel import WorldPanel
from handsteer.dashboard.world_state import SPAN_S, Sample, VelocityHistory
from handsteer.types import Velocity

_PLOT_EVERY = 3
"""The plots are updated every third time the page is: samples are not urgent."""


class DrivePage(Page):
    """Drives the robot, and explains its behaviour."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/", "drive.css", "steer.css", "steer.js", "sticks.js", "world.css", "webcam.js")
        graph = context.graph
        self._camera = CameraPanel(self, graph, coaches=True)
        self._world = WorldPanel(self, graph)
        with box("panels"):
            self._velocity = VelocityPanel()
            self._recording = (
                RecordPanel(self, graph, context.recordings) if graph is not None and context.recordings else None
            )
            self._steering = SteerPanel(self)
            self._topic = TopicPanel(self, self._steering, has_choice=graph is None)
            self._legend = LegendPanel(self, context.settings)
        self._updates = 0

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        self._world.update(state, node.world)
        for panel in (self._camera, self._velocity, self._topic, self._legend):
            panel.update(state)
        self._steering.update(state, self.lease(node))
        if self._recording is not None:
            self._recording.update(self.lease(node))
        self._updates += 1
        if self._updates % _PLOT_EVERY == 0:
            self._velocity.draw(node.history, node.clock.now())


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
        with card(f"Velocity, last {SPAN_S:.0f} s", "panel velocity"):
            self._linear = _Axis("Linear", "m/s", least=0.2, ends=("forward", "backward"), begin=self._begin)
            # Left is positive (REP 103) and drawn upwards.
            self._angular = _Axis("Angular", "rad/s", least=0.5, ends=("left", "right"), begin=self._begin)
            with box("key"):
                tag("span", "commanded", "commanded")
                tag("span", "measured", "measured")

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
