"""What all pages share: the head with links, the bar with the state and Stop, and the timer that updates them."""

import copy
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import ClassVar, Final, Protocol

from nicegui import ui

from handsteer import doors
from handsteer.errors import HandsteerError, PluginError
from handsteer.plugins.page.access import session_of
from handsteer.plugins.page.calibration import Calibrations
from handsteer.plugins.page.elements import switch, tag, text
from handsteer.plugins.page.front import Presses
from handsteer.plugins.page.languages import ENGLISH, preferred_language
from handsteer.plugins.page.lessons import Lessons
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.pictures import CameraPrivacy
from handsteer.plugins.page.recordings import Recordings, duration_text
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.status_bar import Banner, Cues, LeasePanel, TimingLine
from handsteer.plugins.page.viewers import FreeSeat, LeaseStatus, OnDemandNode, PageAudit
from handsteer.plugins.study.session import Session

log = logging.getLogger(__name__)

PICTURE_PATH = "/camera.mjpg"
WEBCAM_PATH = "/camera"
ASSETS_PATH = "/assets"

MANIFEST_PATH = "/handsteer.webmanifest"
MANIFEST = {
    "name": "handsteer",
    "short_name": "handsteer",
    "description": "Drive a mobile robot with your hand signs",
    "id": "/",
    "start_url": "/",
    "scope": "/",
    "display": "standalone",
    "background_color": "#eef1f8",
    "theme_color": "#eef1f8",
    "icons": [
        {"src": f"{ASSETS_PATH}/icons/icon-192.png", "sizes": "192x192", "type": "image/png"},
        {"src": f"{ASSETS_PATH}/icons/icon-512.png", "sizes": "512x512", "type": "image/png"},
        {"src": f"{ASSETS_PATH}/icons/icon-full.png", "sizes": "512x512", "type": "image/png", "purpose": "maskable"},
    ],
}
"""With this browsers install the page as an app; it has no token, because the browser keeps that as a cookie."""

# With credentials: the cookie gives access. The colours are those of the ground, light and dark.
_INSTALLABLE = (
    f'<link rel="manifest" href="{MANIFEST_PATH}" crossorigin="use-credentials">'
    f'<link rel="apple-touch-icon" href="{ASSETS_PATH}/icons/icon-full.png">'
    '<meta name="theme-color" content="#eef1f8" media="(prefers-color-scheme: light)">'
    '<meta name="theme-color" content="#0a0f1c" media="(prefers-color-scheme: dark)">'
)

ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 64 64"><rect width="64" height="64" rx="16" fill="#2457d6"/>'
    '<g fill="none" stroke="#fff" stroke-linecap="round" stroke-width="6"><path d="M24 30V12M32 28V18M40 29V22"/>'
    '<path d="M18 34v-2a4 4 0 0 1 4-4h18a5 5 0 0 1 5 5v7a11 11 0 0 1-11 11h-5a11 11 0 0 1-11-11z" fill="#fff"/></g>'
    "</svg>"
)
_ASSET = {"css": '<link rel="stylesheet" href="{}">', "js": '<script src="{}" defer></script>'}
# Not deferred: they translate the page while the browser reads it.
_TRANSLATED = '<script src="{0}/languages/{1}.js"></script><script src="{0}/translate.js"></script>'
# What the browser draws while it still loads the scripts that draw everything else.
_LOADING = f'<div class="loading" aria-hidden="true" translate="no">{ICON}<b>handsteer</b></div>'

_FIRST_LINKS: Final = ("/world", "/teach", "/settings")
_CAMERA_OFF: Final = "this browser's camera is off: Use my camera"
_DRIVERS_CAMERA_OFF: Final = "the camera of the driver's browser is off"
_PERIOD_S = 0.1
_ACK_PATIENCE_S = 5.0
"""A browser acknowledges received messages every 3 s; after this time without one, sending pauses until the next."""

_THEME_ICON = (
    '<svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2" aria-hidden="true">'
    '<circle cx="12" cy="12" r="9"/><path d="M12 3a9 9 0 0 1 0 18z" fill="currentColor"/></svg>'
)


@dataclass(frozen=True)
class PageContext:
    """What all pages share.

    Attributes:
        node: Joined while a browser shows a page.
        audit: Publishes what viewers do.
        graph: The graph, for what pages do in addition to its topics; None if its nodes run elsewhere.
        settings: The graph's parameters, likewise.
        lessons: Teaches the graph signs, likewise.
        study: Leads a participant through a study; None without one.
        recordings: Serves recordings; None if none can be made.
        calibrations: Adapts the signs to a person; None if the graph's nodes run elsewhere.
        presses: Recognises repetitions of a press of Stop.
        privacy: Who sees the camera of a browser.
    """

    node: OnDemandNode[DashboardNode]
    audit: PageAudit
    graph: RemoteGraph | None = None
    settings: Settings | None = None
    lessons: Lessons | None = None
    study: Session | None = None
    recordings: Recordings | None = None
    calibrations: Calibrations | None = None
    presses: Presses = field(default_factory=Presses)
    privacy: CameraPrivacy = field(default_factory=CameraPrivacy)


class Page:
    """One browser's view at a URL ``path``, with its own stylesheets and scripts (``assets``).

    Its timers run while the browser is connected.

    Attributes:
        title: Of the link to it at the top of all pages; empty without one.
    """

    title: ClassVar[str] = ""

    def __init__(self, context: PageContext, path: str, *assets: str) -> None:
        self.client = ui.context.client
        self._context = context
        self._introduce()
        self.client.on_disconnect(self._leave)
        self.client.on_delete(self._leave)
        self.client.on_delete(lambda: context.audit.forget(self.client.id))
        ui.add_head_html(_INSTALLABLE)
        ui.add_body_html(_LOADING)
        self._speak(preferred_language(self.client.request.headers.get("accept-language", "")))
        webcam = ("webcam.js",) if context.graph is not None else ()
        for name in ("page.css", "page.js", "sound.js", *webcam, *assets):
            ui.add_head_html(_ASSET[name.rpartition(".")[2]].format(f"{ASSETS_PATH}/{name}"))
        self._top(path)
        self._banner = Banner(self._halt, self._reset)
        self._free_seat = FreeSeat()
        self._unread: tuple[int | None, float] = (None, 0.0)
        ui.timer(_PERIOD_S, self._update)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes, ten times a second; pages extend this."""
        self._driving.update(self.lease(node))
        self._timing.update(state)
        self._source.set_text(state.camera)
        recording = self._context.graph.state.recording if self._context.graph is not None else None
        is_on = recording is not None and recording.ended_s is None
        switch(self._recorded, "hidden", on=not is_on)
        if recording is not None and is_on:
            self._recorded.set_text(duration_text(recording, node.clock.now()))
        self._banner.update(state)
        self._cues.update(state)

    @property
    def node(self) -> DashboardNode | None:
        """The node while the browser is connected and the page is served, else None."""
        return self._context.node.join(self.client.id) if self.client.has_socket_connection else None

    @property
    def session(self) -> str:
        """The session of the browser that shows the page; empty without one."""
        return session_of(self.client.request.scope)

    @property
    def may_be_alone(self) -> bool:
        """Whether this browser gives its camera or may do so, as no other does."""
        return self._context.privacy.owner in (None, self.session)

    def do(self, action: Callable[[DashboardNode, str], object]) -> None:
        """Call ``action`` with the node and this viewer, if the page is in use."""
        if node := self.node:
            action(node, self.client.id)

    def drives(self) -> bool:
        """Return whether this viewer has the control lease; a free lease is given to it."""
        node = self.node
        return node is not None and node.lease.take(self.client.id, node.clock.now())

    def change(self, action: Callable[[], object], refusal: str) -> str:
        """Call ``action`` if this viewer drives; return an error message, or ``refusal``; empty if it succeeded."""
        if not self.drives():
            return refusal
        try:
            action()
        except HandsteerError as error:
            return str(error)
        return ""

    def lease(self, node: DashboardNode) -> LeaseStatus:
        """Return the control lease as this viewer sees it."""
        return node.lease.status_of(self.client.id, node.clock.now())

    def _introduce(self) -> None:
        host = self.client.request.client
        self._context.audit.introduce(self.client.id, self.session, host.host if host else "")

    def _speak(self, language: str) -> None:
        if language != ENGLISH:
            # For this client only: all clients of a path share the page. Quasar's and NiceGUI's own words follow it.
            self.client.page = copy.copy(self.client.page)
            self.client.page.language = language  # type: ignore[assignment]
            ui.add_head_html(_TRANSLATED.format(ASSETS_PATH, language))

    def _top(self, path: str) -> None:
        with ui.element("header").classes("top"):
            ui.html(ICON, sanitize=False)
            tag("h1", "", "handsteer").props("translate=no")
            with ui.element("nav").classes("links"):
                for target, name in (links() if self._context.study is None else {}).items():
                    ui.link(name, target).props('aria-current="page"' if target == path else "")
            self._timing = TimingLine()
            with ui.element("div").classes("right"):
                self._driving = LeasePanel(
                    lambda: self.do(DashboardNode.ask_to_drive),
                    lambda hand_over: self.do(lambda node, viewer: node.lease.answer(viewer, hand_over=hand_over)),
                )
                self._recorded = text("recorded hidden", "").props('title="A recording is being made"')
                self._source = ui.label("").classes("source chip")
                self._cues = Cues()
                with ui.element("button").classes("icon-button theme").props('aria-label="Light or dark"'):
                    ui.html(_THEME_ICON, sanitize=False)

    def _update(self) -> None:
        node = self.node
        if node is not None and self._reads():
            viewer, now_s = self.client.id, node.clock.now()
            drove_last = self._context.audit.drove_last(viewer)
            is_alone = self._context.node.is_watched_only_by(viewer)
            may_take = self._free_seat.is_for(drove_last=drove_last, is_alone=is_alone, now_s=now_s)
            if may_take and node.lease.driver is None:
                node.lease.take(viewer, now_s)
            self.show(node, self._with_camera(node.state(self.client.id), self.lease(node)))

    def _with_camera(self, state: PageState, lease: LeaseStatus) -> PageState:
        """Return ``state`` with the browser's camera that is off as the reason why the robot stands."""
        graph = self._context.graph
        is_off = graph is not None and graph.lacks_browser
        self._banner.offer_camera(on=is_off and lease.role == "driver")
        if not is_off or state.stopped or state.mood == "driving":
            return state
        reason = _CAMERA_OFF if lease.role == "driver" else _DRIVERS_CAMERA_OFF
        return replace(state, mood="trouble", reason=reason, no_picture=reason)

    def _reads(self) -> bool:
        """Return whether the browser acknowledges messages; otherwise they would accumulate."""
        sent = self.client.outbox.message_history  # messages sent but not acknowledged, oldest first
        oldest = sent[0][0] if sent else None
        now_s = time.monotonic()
        if oldest != self._unread[0]:
            self._unread = (oldest, now_s)
        return oldest is None or now_s - self._unread[1] < _ACK_PATIENCE_S

    def _halt(self, sent: object) -> None:
        press = sent.get("press") if isinstance(sent, dict) else None
        if node := self.node:
            self._context.presses.obey(self.client.id, press, lambda: node.halt(self.client.id))

    def _reset(self) -> None:
        if self._context.study is None:  # else its page decides
            self.do(DashboardNode.reset)

    def _leave(self) -> None:
        node = self._context.node
        if node.is_watched_by(self.client.id) and (joined := node.join(self.client.id)):
            joined.leave(self.client.id)
        node.leave(self.client.id)


class PageMaker(Protocol):
    """A class of pages, as plug-ins bring them.

    Attributes:
        title: Of the link to it at the top of all pages; empty without one.
    """

    title: str

    def __call__(self, context: PageContext) -> Page:
        """Build the page for one browser."""
        ...


@cache
def added_pages() -> dict[str, PageMaker]:
    """Return the pages besides ``/``, those of plug-ins included, by their paths."""
    pages: dict[str, PageMaker] = {}
    for name in doors.PAGES.names():
        try:
            pages[f"/{name}"] = doors.PAGES.load(name)
        except PluginError as error:  # it must not keep others from driving
            log.warning("%s", error)
    return pages


def links() -> dict[str, str]:
    """Return the titles of the pages that are linked at the top, by their paths: our own first."""
    titles = {path: page.title for path, page in added_pages().items() if page.title}
    first = {path: titles[path] for path in _FIRST_LINKS if path in titles}
    return {"/": "Drive"} | first | titles
