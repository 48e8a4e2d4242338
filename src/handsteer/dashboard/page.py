"""What every page has: the head with the way to the others, the sentence with the Stop button, and who drives."""

import time
from dataclasses import dataclass

from nicegui import ui

from handsteer.dashboard.joined import Cameras, RobotInWorld
from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.panels.banner import Banner
from handsteer.dashboard.panels.seat import SeatPanel
from handsteer.dashboard.seat import Place
from handsteer.dashboard.settings_store import Settings
from handsteer.dashboard.state import PageState
from handsteer.dashboard.teaching.teaching import Teaching
from handsteer.dashboard.watch import WhileWatched

PICTURE_PATH = "/camera.mjpg"
WEBCAM_PATH = "/camera"
ASSETS_PATH = "/assets"

_LINKS = (("/", "Drive"), ("/teach", "Teach"), ("/settings", "Settings"))
_PERIOD_S = 0.1
_ACK_PATIENCE_S = 5.0
"""A browser acknowledges every 3 s what it has got; one that has not for so long is sent no more until it does."""

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


@dataclass(frozen=True)
class Local:
    """What pages reach of the graph beside its topics; None is out of their reach.

    Attributes:
        cameras: The graph's camera, which a browser's may stand in for.
        robot: The robot whose world people edit.
        settings: The graph's parameters.
        teaching: Gives lessons.
    """

    cameras: Cameras | None = None
    robot: RobotInWorld | None = None
    settings: Settings | None = None
    teaching: Teaching | None = None


@dataclass(frozen=True)
class Served:
    """What the pages are made of.

    Attributes:
        node: Is joined for as long as a browser shows a page.
        local: What pages reach of the graph beside its topics.
        topics: Whether steering by hand may go to other topics than the control's.
    """

    node: WhileWatched[DashboardNode]
    local: Local
    topics: bool


class Page:
    """One browser's view; its timers run while the browser is connected.

    Args:
        served: What the page is made of.
        path: Where the page is, which its link in the head says.
    """

    def __init__(self, served: Served, path: str) -> None:
        self.client = ui.context.client
        self._served = served
        self.client.on_disconnect(self._leave)
        self.client.on_delete(self._leave)
        ui.add_head_html(
            f'<link rel="stylesheet" href="{ASSETS_PATH}/page.css"><script src="{ASSETS_PATH}/page.js" defer></script>'
        )
        self._top(path)
        self._banner = Banner(self._halt, self._reset)
        self._unread: tuple[int | None, float] = (None, 0.0)
        ui.timer(_PERIOD_S, self._update)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show what is new, ten times a second; a page adds its own to it."""
        self._driving.update(self.place(node))
        self._source.set_text(state.camera)
        self._banner.update(state)

    @property
    def joined(self) -> DashboardNode | None:
        """The node while the browser is connected and the page is served, else None."""
        return self._served.node.join(self.client.id) if self.client.has_socket_connection else None

    def drives(self) -> bool:
        """Return whether this viewer has the driver's seat, which it is given if it is free."""
        node = self.joined
        return node is not None and node.seat.take(self.client.id, node.clock.now())

    def place(self, node: DashboardNode) -> Place:
        """Return what the driver's seat is for this viewer."""
        return node.seat.place_of(self.client.id, node.clock.now())

    def use_own_camera(self) -> None:
        """Choose the camera of the machine that handsteer runs on, if this viewer drives."""
        if self._served.local.cameras and self.drives():
            self._served.local.cameras.choose("own")

    def _top(self, path: str) -> None:
        with ui.element("header").classes("top"):
            ui.html(ICON, sanitize=False)
            with ui.element("div"):
                ui.html("<h1>handsteer</h1>", sanitize=False)
                ui.label("drive a robot with your hand signs").classes("tagline")
            with ui.element("nav").classes("links"):
                for target, name in _LINKS:
                    ui.link(name, target).props('aria-current="page"' if target == path else "")
            with ui.element("div").classes("right"):
                self._driving = SeatPanel(self._ask, self._answer)
                self._source = ui.label("").classes("source chip")
                with ui.element("button").classes("icon-button theme").props('aria-label="Light or dark"'):
                    ui.html(_THEME_ICON, sanitize=False)

    def _update(self) -> None:
        node = self.joined
        if node is not None and self._reads():
            self.show(node, node.state(self.client.id))

    def _reads(self) -> bool:
        """Return whether the browser takes what it is sent; what it does not take would only pile up."""
        sent = self.client.outbox.message_history  # what was sent and not acknowledged yet, oldest first
        oldest = sent[0][0] if sent else None
        now_s = time.monotonic()
        if oldest != self._unread[0]:
            self._unread = (oldest, now_s)
        return oldest is None or now_s - self._unread[1] < _ACK_PATIENCE_S

    def _halt(self) -> None:
        if node := self.joined:
            node.halt(self.client.id)

    def _reset(self) -> None:
        if node := self.joined:
            node.reset(self.client.id)

    def _ask(self) -> None:
        if node := self.joined:
            node.seat.ask(self.client.id, node.clock.now())

    def _answer(self, hand_over: bool) -> None:
        if node := self.joined:
            node.seat.answer(self.client.id, hand_over=hand_over)

    def _leave(self) -> None:
        watched = self._served.node
        if watched.is_watched_by(self.client.id) and (node := watched.join(self.client.id)):
            node.leave(self.client.id)
        watched.leave(self.client.id)
