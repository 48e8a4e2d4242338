"""The web server of the page, on its own threads next to the graph."""

import functools
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from nicegui import app, core, ui
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from handsteer.audit import WARN
from handsteer.cameras.browser import LARGEST_BYTES
from handsteer.clock import Clock
from handsteer.config import DEFAULT_FILE, DashboardConfig
from handsteer.errors import DashboardError
from handsteer.making import cmd_vel_topic
from handsteer.messages import CMD_VEL, Topic
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.access import HEADERS, Access, AccessMiddleware, session_of
from handsteer.plugins.page.calibration import Calibrations
from handsteer.plugins.page.camera import FrameSocket
from handsteer.plugins.page.closed_pages import free_when_closed
from handsteer.plugins.page.drive_page import DrivePage
from handsteer.plugins.page.elements import STATIC
from handsteer.plugins.page.front import PagesLoop, StopPath
from handsteer.plugins.page.lesson_files import serve_lesson_files
from handsteer.plugins.page.lessons import Lessons
from handsteer.plugins.page.limits import FRONT_THREAD, Connections, UnconnectedPages, limit_log, load_certificate
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import (
    ASSETS_PATH,
    ICON,
    MANIFEST,
    MANIFEST_PATH,
    PICTURE_PATH,
    WEBCAM_PATH,
    Page,
    PageContext,
    added_pages,
)
from handsteer.plugins.page.pictures import PictureResponse, Pictures
from handsteer.plugins.page.recordings import Recordings, serve_recordings
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.settings import Settings, SettingsFile
from handsteer.plugins.page.sign_pictures import serve_sign_pictures
from handsteer.plugins.page.socket_events import SocketEvents
from handsteer.plugins.page.study_page import StudyPage
from handsteer.plugins.page.viewers import OnDemandNode, PageAudit
from handsteer.plugins.page.world_state import VelocityHistory
from handsteer.plugins.study.session import Session
from handsteer.transports.addresses import host_for_others, listen
from handsteer.transports.base import Transport

_START_TIMEOUT_S = 20.0
_STOP_TIMEOUT_S = 3.0
# For browsers to disconnect.
_GRACE_S = 0.4
# Limits what the system buffers for a slow viewer; more would only be older pictures.
_SEND_BUFFER_BYTES = 256 * 1024

_one_at_a_time = threading.Lock()


class Dashboard:
    """Serves the page of a graph.

    NiceGUI keeps its state per process, so a process serves one page at a time.

    Args:
        steering: Drives when a viewer steers on the page.
        config: Address and options of the page.
        cmd_vel: The topic of the displayed commands.
        graph: What pages can change in addition to topics; nothing by default.
        file: The YAML file that the graph's parameters were read from, which settings are saved to; by default
            :data:`~handsteer.config.DEFAULT_FILE`.

    Raises:
        ConfigError: The file can no longer be read.
        StudyError: The results of the study cannot be used.

    Attributes:
        node: Subscribes and steers for the browsers that show the page.
        pictures: Encodes the camera's pictures for the browsers that show them.
        context: What all pages share.
        webcam: Receives the frames of a browser's own camera.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        steering: SteeringNode,
        config: DashboardConfig,
        *,
        cmd_vel: Topic[Any] = CMD_VEL,
        graph: RemoteGraph | None = None,
        file: Path | None = None,
    ) -> None:
        history = VelocityHistory()  # outlives the node, so that a reloaded page shows it
        audit = PageAudit(transport, clock) if graph is None else graph.audit
        self.node = OnDemandNode(lambda: DashboardNode(transport, clock, steering, cmd_vel, history, audit=audit))
        self.pictures = Pictures(transport, clock)
        privacy = self.pictures.privacy
        self.context = PageContext(self.node, audit, privacy=privacy)
        if graph is not None:
            settings_file = SettingsFile(file or DEFAULT_FILE, is_read=file is not None)
            settings = Settings(
                lambda: graph.config,
                graph.reconfigure,
                settings_file,
                lambda done: audit.say_of_driver("settings_saved", done, settings_file.path.name),
            )
            study = Session(graph.study) if graph.study is not None else None
            recordings = Recordings(graph.config.recording.folder, lambda: graph.state.recording)
            lessons, calibrations = Lessons(graph), Calibrations(graph)
            parts = (settings, lessons, study, recordings, calibrations)
            self.context = PageContext(self.node, audit, graph, *parts, privacy=privacy)
        self.webcam = FrameSocket(graph, self._drives, privacy)
        self._config = config
        self._steering = steering
        self._server: uvicorn.Server | None = None
        self._pages: PagesLoop | None = None
        self._thread: threading.Thread | None = None

    @classmethod
    def of(cls, graph: RemoteGraph, file: Path | None = None) -> "Dashboard":
        """Return the page of a whole graph.

        Raises:
            ConfigError: The file can no longer be read.
        """
        config, topic = graph.config.dashboard, cmd_vel_topic(graph.config)
        return cls(graph.transport, graph.clock, graph.steering, config, cmd_vel=topic, graph=graph, file=file)

    def start(self) -> str:
        """Serve the page and return its address once it answers; it contains the token if one is needed.

        Raises:
            DashboardError: The address, the port or the certificate cannot be used, or this process serves another
                page.
        """
        if not _one_at_a_time.acquire(blocking=False):
            raise DashboardError("this process serves a page already: stop that one first")
        config = self._config
        try:
            certificate = load_certificate(config)
            listener = listen(
                config.host, config.port, _SEND_BUFFER_BYTES, options=("--host", "--port"), error=DashboardError
            )
        except DashboardError:
            _one_at_a_time.release()
            raise
        access = Access.to(config.host, config.token)
        application = _application()
        application.state.dashboard = self
        application.state.access = access
        application.state.connections = Connections(certificate)
        self._pages = PagesLoop(application)
        front = StopPath(self._pages, self.halt, self.context.presses)
        self._server = uvicorn.Server(_settings(front, application.state))
        self._thread = threading.Thread(target=self._server.run, args=([listener],), name=FRONT_THREAD, daemon=True)
        self._pages.start()
        self._thread.start()
        self._wait_until_served()
        scheme = "https" if certificate else "http"
        address = f"{scheme}://{host_for_others(config.host)}:{listener.getsockname()[1]}"
        path = "" if self.context.study is None else "/study"
        return f"{address}{path or '/'}?token={access.token}" if access.token else f"{address}{path}"

    def stop(self) -> None:
        """Close the page and all connections; may be called more than once."""
        self.node.close()
        self.pictures.close()
        if self.context.lessons is not None:
            self.context.lessons.close()
        if self.context.calibrations is not None:
            self.context.calibrations.close()
        if self.context.recordings is not None:
            self.context.recordings.close()
        if self._server is not None and self._thread is not None:
            self._server.should_exit = True
            self._thread.join(_STOP_TIMEOUT_S)
            self._server = None
            if self._pages is not None:
                self._pages.stop()
            _one_at_a_time.release()

    def halt(self, viewer: str) -> None:
        """Stop the robot for a page, whether or not its websocket is connected; may be called on any thread."""
        node = self.node.join(viewer) if self.node.is_watched_by(viewer) else None
        if node is not None:
            node.halt(viewer)
        else:
            self._steering.halt()
            self.context.audit.say("stop_pressed", viewer, "pressed Stop", level=WARN)

    @property
    def robot_stands(self) -> bool:
        """Whether the robot is not commanded to move, as far as viewers are shown; true without viewers."""
        node = self.node.running
        return node is None or node.state().commanded.is_zero

    def _drives(self, viewer: str) -> bool:
        if not self.node.is_watched_by(viewer):
            return False
        node = self.node.join(viewer)
        return node is not None and node.lease.take(viewer, node.clock.now())

    def _wait_until_served(self) -> None:
        server, thread = self._server, self._thread
        deadline_s = time.monotonic() + _START_TIMEOUT_S
        while server is not None and thread is not None and not server.started:
            if not thread.is_alive() or time.monotonic() > deadline_s:
                self.stop()
                raise DashboardError("the page's server did not start; its log says why")
            time.sleep(0.01)


def _settings(front: ASGIApp, state: State) -> uvicorn.Config:
    settings = uvicorn.Config(
        # Outermost, so that it covers everything, errors included.
        AccessMiddleware(front, state),
        http=state.connections.protocol,
        headers=list(HEADERS),
        server_header=False,
        proxy_headers=False,  # other users of this machine could forge the header
        # uvloop keeps reading for a protocol that has paused it before TLS begins.
        loop="asyncio" if state.connections.is_secure else "auto",
        log_config=None,
        access_log=False,
        lifespan="on",
        ws_max_size=2 * LARGEST_BYTES,
    )
    settings.timeout_graceful_shutdown = _GRACE_S  # type: ignore[assignment]  # fractions work as well
    return settings


@functools.cache
def _application() -> FastAPI:
    """Return the web application, one per process, as NiceGUI requires; it serves ``state.dashboard``."""
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    application.mount(ASSETS_PATH, StaticFiles(directory=STATIC))

    @application.get(PICTURE_PATH)
    async def picture(request: Request) -> Response:
        return PictureResponse(application.state.dashboard.pictures, session_of(request.scope))

    @application.get(MANIFEST_PATH)
    def manifest() -> Response:
        return JSONResponse(MANIFEST, media_type="application/manifest+json")

    @application.websocket(WEBCAM_PATH)
    async def webcam(socket: WebSocket) -> None:
        await application.state.dashboard.webcam.serve(socket)

    serve_sign_pictures(application)
    serve_recordings(application, lambda: application.state.dashboard.context.recordings)
    serve_lesson_files(application, lambda: application.state.dashboard.context.lessons)
    unconnected = UnconnectedPages()

    def serve(path: str, page: Callable[[PageContext], Page]) -> None:
        @ui.page(path)
        def shown() -> None:
            shown_page = page(application.state.dashboard.context)
            free_when_closed(shown_page)
            unconnected.add(shown_page.client)

    # A participant has no other page.
    serve("/", lambda context: DrivePage(context) if context.study is None else StudyPage(context))
    for path, added in added_pages().items():
        serve(path, added)
    ui.run_with(
        application,
        title="handsteer",
        favicon=ICON,
        language="en-US",
        dark=None,
        tailwind=False,
        binding_refresh_interval=None,
        gzip_middleware_factory=None,
        show_welcome_message=False,
        # A browser busy with drawing answers late. If it counted as gone, it would reload the page and lose its lease.
        # A missing driver is detected much sooner, because the page repeats its commands.
        reconnect_timeout=10.0,
    )
    # Otherwise state of each tab is kept for 30 days; no page here stores anything in it.
    app.storage.max_tab_storage_age = 0.0
    SocketEvents(core.sio)
    limit_log()
    return application
