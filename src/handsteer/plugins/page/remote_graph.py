"""A graph for a page in another process: both ends of the pipe between them.

Topics pass through it as well (:mod:`handsteer.transports.piped`).
"""

import contextlib
import datetime
import itertools
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handsteer.audit import AuditCode
from handsteer.cameras import VIRTUAL_HAND
from handsteer.cameras.browser import check_frame
from handsteer.cameras.choice import BROWSER, OWN, CameraChoice, Size
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.errors import ConfigError, FrameError, HandsteerError, TransportError, quoted
from handsteer.graph import Graph
from handsteer.making import make_steering
from handsteer.nodes.run_recording import RecordingState
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.recording_folder import RecordingFolder
from handsteer.plugins.page.viewers import PageAudit
from handsteer.plugins.study.session import Task
from handsteer.robots.world import World
from handsteer.transports.piped import Gateway, Pipe, PipedTransport

_ANSWER_TIMEOUT_S = 5.0
_LOOK_PERIOD_S = 0.2
_FAILED = "the robot's process failed to do it; its log says why"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class GraphState:
    """What the page's process receives from the graph in addition to topics.

    Attributes:
        config: The nodes' configuration.
        world: The robot's world with all things at their start positions; None for a real robot.
        camera_source: The selected camera, :data:`~handsteer.cameras.choice.OWN`,
            :data:`~handsteer.cameras.choice.BROWSER`, or the source of one of ``cameras``.
        camera_size: The resolution that webcams of the graph's machine are asked for, in pixels.
        cameras: The cameras of the graph's machine that can be chosen, as last found.
        has_browser: Whether a browser has sent frames since the last one was forgotten.
        recording: The recording that is being made, or the last one; None if there was none.
    """

    config: Config
    world: World | None
    camera_source: str
    camera_size: Size
    cameras: tuple[CameraChoice, ...]
    has_browser: bool
    recording: RecordingState | None = None


class GraphServer:
    """The graph's end: offers a graph of this process to a :class:`RemoteGraph`.

    Args:
        pipe: Not started yet; connected to a :class:`RemoteGraph`.
        file: The YAML file that its parameters were read from, which settings are saved to.
        study: What the page leads a participant through, if anything.
    """

    def __init__(self, pipe: Pipe, graph: Graph, file: Path | None = None, study: Task | None = None) -> None:
        self._pipe = pipe
        self._graph = graph
        self._gateway = Gateway(pipe, graph.transport)
        self._sent = self._state()
        self._sending = threading.Lock()
        # Files and devices are opened on threads of their own: the pipe also carries Stop.
        self._recording = ThreadPoolExecutor(1, "recording")
        self._finding = ThreadPoolExecutor(1, "cameras")
        self._setting = ThreadPoolExecutor(1, "settings")
        graph.recording.on_change = self._send_state
        self._actions: dict[str, Callable[..., Future[None] | None]] = {
            "reconfigure": lambda config, by: self._setting.submit(graph.reconfigure, config, by),
            "change_world": graph.robot.surroundings.change,
            "enter_world": graph.robot.surroundings.enter,
            "reset": graph.robot.surroundings.reset,
            "choose_camera": graph.choose_camera,
            "find_cameras": lambda: self._finding.submit(graph.cameras.find),
            "forget_browser": graph.cameras.browser.forget,
            "record": lambda by: self._recording.submit(self._record, by),
            "end_recording": lambda by: self._recording.submit(graph.end_recording, by),
        }
        pipe.on("frame", self._take_frame)
        pipe.on("request", self._execute)
        pipe.say("begin", self._sent, graph.clock, file, study)

    def close(self) -> None:
        """Close the page's publishers and subscriptions."""
        self._gateway.close()
        self._recording.shutdown(wait=False)
        self._finding.shutdown(wait=False)
        self._setting.shutdown(wait=False)

    def _record(self, by: str) -> None:
        folder = RecordingFolder(self._graph.config.recording.folder)
        self._graph.record(folder.new(datetime.datetime.now()), by)

    def _state(self) -> GraphState:
        graph = self._graph
        cameras, recording = graph.cameras, graph.recording.state
        chosen = (cameras.source, cameras.size, cameras.choices)
        return GraphState(graph.config, graph.robot.surroundings.world, *chosen, cameras.browser.is_given, recording)

    def _send_state(self) -> None:
        with self._sending:
            state = self._state()
            if state != self._sent:
                self._sent = state
                self._pipe.say("state", state)

    def _take_frame(self, frame: bytes) -> None:
        with contextlib.suppress(FrameError):  # checked before
            self._graph.cameras.browser.offer(frame)
        self._send_state()

    def _execute(self, number: int, action: str, *arguments: Any) -> None:
        try:
            result = self._actions[action](*arguments)
        except HandsteerError as error:
            self._answer(number, error)
        except Exception:
            self._answer(number, TransportError(_FAILED))
            raise
        else:
            if isinstance(result, Future):
                result.add_done_callback(lambda done: self._answer(number, done.exception()))
            else:
                self._answer(number, None)

    def _answer(self, number: int, error: BaseException | None) -> None:
        if error is not None and not isinstance(error, HandsteerError):
            log.error("a request of the page failed: %s %s", type(error).__name__, quoted(str(error)))
            error = TransportError(_FAILED)  # others may not survive the way
        self._send_state()
        self._pipe.say("answer", number, error)


class RemoteGraph:
    """The page's end: a graph that runs in another process. Use it only after :meth:`join` has returned.

    Args:
        pipe: Not started yet; connected to a :class:`GraphServer`.

    Attributes:
        state: What the graph has reported last.
        steering: Runs in this process; not started.
        study: What the page leads a participant through, if anything.
        audit: Publishes what viewers do.
        saved_world: The world when it was loaded or saved.
    """

    clock: Clock
    state: GraphState
    steering: SteeringNode
    study: Task | None
    audit: PageAudit
    saved_world: World | None

    def __init__(self, pipe: Pipe) -> None:
        self.transport = PipedTransport(pipe)
        self._pipe = pipe
        self._begun: Future[tuple[GraphState, Clock, Path | None, Task | None]] = Future()
        self._numbers = itertools.count()
        self._requests: dict[int, Future[None]] = {}
        pipe.on("begin", lambda *what: self._begun.set_result(what))
        pipe.on("state", self._take_state)
        pipe.on("answer", self._take_answer)

    def join(self) -> Path | None:
        """Wait until the other process describes its graph; return the file that settings are saved to.

        Raises:
            TransportError: The other process has ended first.
        """
        while not self._pipe.ended.is_set():
            try:
                self.state, self.clock, file, self.study = self._begun.result(_LOOK_PERIOD_S)
            except TimeoutError:
                continue
            self.saved_world = self.state.world
            self.audit = PageAudit(self.transport, self.clock)
            self.steering = make_steering(self.config, self.transport, self.clock)
            return file
        raise TransportError("the graph's process has ended")

    @property
    def config(self) -> Config:
        """The nodes' configuration."""
        return self.state.config

    def reconfigure(self, config: Config) -> None:
        """Apply the live parameters of ``config`` to the nodes, in both processes.

        Raises:
            ConfigError: A node rejects them, or the other process does not answer; nothing has changed.
        """
        try:
            self._request("reconfigure", config, self.audit.driver).result(_ANSWER_TIMEOUT_S)
        except TimeoutError:
            raise ConfigError("the robot's process does not answer: try again") from None
        self.steering.reconfigure(config)

    def change_world(self, change: Callable[[World], World]) -> Future[None]:
        """Change the robot's world; ``change`` must be picklable."""
        return self._told(self._request("change_world", change), "changed the world")

    def enter_world(self, world: World) -> Future[None]:
        """Move the robot to the start of another world."""
        return self._told(self._request("enter_world", world), f"loaded the world {world.name}", about=world.name)

    def reset(self) -> Future[None]:
        """Move the robot and all things to their start positions."""
        return self._told(self._request("reset"), "put the robot and all things back to the start")

    def choose_camera(self, source: str, size: Size | None = None, *, is_far: bool = False) -> Future[None]:
        """Read frames from ``source`` from now on; see :meth:`~handsteer.graph.Graph.choose_camera`."""
        name = self.camera_name(source)
        future = self._request("choose_camera", source, size, is_far)
        return self._told(future, f"chose {name}", "camera_chosen", source if source in (OWN, BROWSER) else name)

    @property
    def lacks_browser(self) -> bool:
        """Whether the camera of a browser is in use, and no browser gives one."""
        return self.state.camera_source == BROWSER and not self.state.has_browser

    def camera_name(self, source: str) -> str:
        """Return the name of a camera for people, as it is used in a sentence."""
        if source == BROWSER:
            return "the camera of a browser"
        names = {each.source: each.name for each in self.state.cameras}
        name = names.get(source, "the robot's camera")
        return f"the {name}" if name == VIRTUAL_HAND else name

    def find_cameras(self) -> Future[None]:
        """Look again for the cameras of the graph's machine."""
        return self._request("find_cameras")

    def offer_frame(self, data: bytes) -> None:
        """Send a frame of a browser's camera, see :class:`~handsteer.cameras.browser.BrowserCamera`.

        Raises:
            FrameError: It is not such a frame, or too large.
        """
        check_frame(data)
        self._pipe.say("frame", data, key="browser's frame", keep=1)

    def forget_browser(self) -> None:
        """Forget the browser that sends frames; another may follow."""
        self._request("forget_browser")

    def record(self) -> Future[None]:
        """Start a recording in the folder of recordings."""
        return self._request("record", self.audit.driver)

    def end_recording(self) -> Future[None]:
        """End the recording, if there is one."""
        return self._request("end_recording", self.audit.driver)

    def _told(
        self, future: Future[None], sentence: str, code: AuditCode = "world_changed", about: str = ""
    ) -> Future[None]:
        """Return ``future``, whose success is published on the audit as the driver's change."""

        def tell(done: Future[None]) -> None:
            if not done.cancelled() and done.exception() is None:
                self.audit.say_of_driver(code, sentence, about)

        future.add_done_callback(tell)
        return future

    def _request(self, action: str, *arguments: object) -> Future[None]:
        """Request an action of the other process; return a future of its result."""
        number, future = next(self._numbers), Future[None]()
        self._requests[number] = future
        self._pipe.say("request", number, action, *arguments)
        return future

    def _take_state(self, state: GraphState) -> None:
        self.state = state

    def _take_answer(self, number: int, error: BaseException | None) -> None:
        future = self._requests.pop(number)
        if not future.set_running_or_notify_cancel():
            return  # nothing waits for it any more
        if error is None:
            future.set_result(None)
        else:
            future.set_exception(error)
