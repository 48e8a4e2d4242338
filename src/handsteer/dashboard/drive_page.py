"""The page ``/``: camera, recognised sign, robot state, world, and manual steering."""

import time

from nicegui import ui

from handsteer.dashboard.camera_panel import CameraPanel
from handsteer.dashboard.elements import UNKNOWN, box, card, text
from handsteer.dashboard.legend import SignsPanel
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import ASSETS_PATH, PICTURE_PATH, Page, PageContext
from handsteer.dashboard.state import PageState
from handsteer.dashboard.steer_panel import SteerPanel
from handsteer.dashboard.velocity import VelocityPanel
from handsteer.dashboard.world_panel import WorldPanel


class TimingPanel:
    """Latency and frame rate."""

    def __init__(self) -> None:
        with card("Camera to command", "panel timing"), box("figures"):
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
            label.set_text(UNKNOWN if value is None else f"{value:.{digits}f}")


def _figure(unit: str, name: str) -> ui.label:
    with box("figure"):
        with box(""):
            value = ui.label(UNKNOWN).classes("value").style("display: inline")
            ui.label(unit).classes("unit").style("display: inline")
        text("name", name)
    return value


_PLOT_EVERY = 3
"""The plots are updated every third time the page is: samples are not urgent."""


class DrivePage(Page):
    """Drives the robot, and explains its behaviour."""

    def __init__(self, served: PageContext) -> None:
        super().__init__(served, "/")
        ui.add_head_html(
            f'<link rel="stylesheet" href="{ASSETS_PATH}/drive.css">'
            f'<link rel="stylesheet" href="{ASSETS_PATH}/steer.css">'
            f'<script src="{ASSETS_PATH}/steer.js" defer></script>'
            f'<link rel="stylesheet" href="{ASSETS_PATH}/world.css">'
            f'<script src="{ASSETS_PATH}/webcam.js" defer></script>'
        )
        self._camera = CameraPanel(PICTURE_PATH, served.local.cameras, self.client.id, self.use_own_camera)
        self._world = WorldPanel(served.local.robot, self.drives, self._watches)
        with ui.element("div").classes("panels"):
            self._velocity = VelocityPanel()
            self._timing = TimingPanel()
            choose_topic = self._steer_on if served.topics else None
            self._steering = SteerPanel(self._steer, self._release, time.monotonic, choose_topic)
            self._signs = SignsPanel()
        self._shown = 0

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        self._world.update(state, node.world)
        for panel in (self._camera, self._velocity, self._timing, self._signs):
            panel.update(state)
        self._steering.update(state, self.place(node))
        self._shown += 1
        if self._shown % _PLOT_EVERY == 0:
            self._velocity.draw(node.history, node.clock.now())

    def _watches(self) -> bool:
        node = self.joined
        return node is not None and self.place(node).role == "watcher"

    def _steer(self, linear_mps: float, angular_radps: float) -> None:
        if node := self.joined:
            node.steer(self.client.id, linear_mps, angular_radps)

    def _steer_on(self, topic: str) -> None:
        if node := self.joined:
            self._steering.let_go()
            node.steer_on(self.client.id, topic)

    def _release(self) -> None:
        if node := self.joined:
            node.release(self.client.id)
