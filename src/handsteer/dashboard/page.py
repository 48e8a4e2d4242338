"""The page ``/``: what the camera sees, what was understood, what the robot does, and a pad to steer it."""

from nicegui import ui

from handsteer.cameras.browser import ChoiceOfCameras
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.panels import (
    Banner,
    CameraPanel,
    RobotFoot,
    SeatPanel,
    SignsPanel,
    SteerPanel,
    TimingPanel,
    VelocityPanel,
)
from handsteer.dashboard.scene import WorldView
from handsteer.dashboard.watch import WhileWatched

PICTURE_PATH = "/camera.mjpg"
WEBCAM_PATH = "/camera"
ASSETS_PATH = "/assets"

_WORLD_PERIOD_S = 0.05
_WORDS_PERIOD_S = 0.1

ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 64 64"><rect width="64" height="64" rx="16" fill="#2457d6"/>'
    '<g fill="none" stroke="#fff" stroke-linecap="round" stroke-width="6"><path d="M24 30V12M32 28V18M40 29V22"/>'
    '<path d="M18 34v-2a4 4 0 0 1 4-4h18a5 5 0 0 1 5 5v7a11 11 0 0 1-11 11h-5a11 11 0 0 1-11-11z" fill="#fff"/></g>'
    "</svg>"
)
_THEME_ICON = (
    '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" aria-hidden="true">'
    '<circle cx="12" cy="12" r="9"/><path d="M12 3a9 9 0 0 1 0 18z" fill="currentColor"/></svg>'
)


class Page:
    """One browser's view; its timers run while the browser is connected.

    Args:
        node: Is joined for as long as the browser shows the page.
        cameras: The graph's camera, which this browser's may stand in for; None where that cannot be.
    """

    def __init__(self, node: WhileWatched[DashboardNode], cameras: ChoiceOfCameras | None) -> None:
        self._client = ui.context.client
        self._node = node
        self._cameras = cameras
        self._client.on_disconnect(self._leave)
        self._client.on_delete(self._leave)
        ui.add_head_html(
            f'<link rel="stylesheet" href="{ASSETS_PATH}/page.css"><script src="{ASSETS_PATH}/page.js" defer></script>'
            f'<script src="{ASSETS_PATH}/webcam.js" defer></script>'
        )
        self._top()
        self._banner = Banner(self._halt, self._reset)
        self._camera = CameraPanel(PICTURE_PATH, cameras, self._client.id, self._use_own_camera)
        with ui.element("section").classes("card viewer world"):
            with ui.element("div").classes("stage"):
                self._world = WorldView()
                ui.label("drag to look around").classes("caption")
            self._robot = RobotFoot()
        with ui.element("div").classes("panels"):
            self._velocity = VelocityPanel()
            self._timing = TimingPanel()
            SteerPanel(self._steer, self._release)
            self._signs = SignsPanel()
        ui.timer(_WORLD_PERIOD_S, self._update_world)
        ui.timer(_WORDS_PERIOD_S, self._update_words)

    def _top(self) -> None:
        with ui.element("header").classes("top"):
            ui.html(ICON, sanitize=False)
            with ui.element("div"):
                ui.html("<h1>handsteer</h1>", sanitize=False)
                ui.label("drive a robot with your hand signs").classes("tagline")
            with ui.element("div").classes("right"):
                self._driving = SeatPanel(self._ask, self._answer)
                self._source = ui.label("").classes("source chip")
                with ui.element("button").classes("icon-button theme").props('aria-label="Light or dark"'):
                    ui.html(_THEME_ICON, sanitize=False)

    def _update_world(self) -> None:
        if node := self._joined():
            self._world.update(node.world)

    def _update_words(self) -> None:
        node = self._joined()
        if node is None:
            return
        self._driving.update(node.seat.place_of(self._client.id, node.clock.now()))
        state = node.state()
        self._source.set_text(state.camera)
        for panel in (self._banner, self._camera, self._robot, self._velocity, self._timing, self._signs):
            panel.update(state)

    def _steer(self, linear_mps: float, angular_radps: float) -> None:
        if node := self._joined():
            node.steer(self._client.id, linear_mps, angular_radps)

    def _release(self) -> None:
        if node := self._joined():
            node.release(self._client.id)

    def _halt(self) -> None:
        if node := self._joined():
            node.halt()

    def _reset(self) -> None:
        if node := self._joined():
            node.reset(self._client.id)

    def _use_own_camera(self) -> None:
        node = self._joined()
        if node and self._cameras and node.seat.take(self._client.id, node.clock.now()):
            self._cameras.choose("own")

    def _ask(self) -> None:
        if node := self._joined():
            node.seat.ask(self._client.id, node.clock.now())

    def _answer(self, hand_over: bool) -> None:
        if node := self._joined():
            node.seat.answer(self._client.id, hand_over=hand_over)

    def _joined(self) -> DashboardNode | None:
        """Return the node while the browser is connected and the page is served."""
        return self._node.join(self._client.id) if self._client.has_socket_connection else None

    def _leave(self) -> None:
        if self._node.is_watched_by(self._client.id) and (node := self._node.join(self._client.id)):
            node.leave(self._client.id)
        self._node.leave(self._client.id)
