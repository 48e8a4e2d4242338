"""The page ``/``: camera, recognised sign, robot state, world, and manual steering."""

from handsteer.dashboard.camera import CameraPanel
from handsteer.dashboard.elements import box
from handsteer.dashboard.legend import LegendPanel
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import Page, PageContext
from handsteer.dashboard.record_panel import RecordPanel
from handsteer.dashboard.state import PageState
from handsteer.dashboard.steer_panel import SteerPanel, TopicPanel
from handsteer.dashboard.velocity_panel import VelocityPanel
from handsteer.dashboard.world_panel import WorldPanel

_PLOTS = ("uplot/uPlot.min.css", "uplot/uPlot.iife.min.js")
_PLOT_EVERY = 3
"""The plots are updated every third time the page is: samples are not urgent."""


class DrivePage(Page):
    """Drives the robot, and explains its behaviour."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(
            context, "/", "drive.css", "steer.css", "steer.js", "sticks.js", "world.css", "webcam.js", *_PLOTS
        )
        graph = context.graph
        self._camera = CameraPanel(self, graph, settings=context.settings, coaches=True)
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
