"""The page in its own process, seen from the graph: a stalled page does not delay the robot's nodes.

:mod:`handsteer.dashboard.remote_graph` is the other end.
"""

import contextlib
import importlib.util
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from handsteer.cameras.browser import Source
from handsteer.config import Config
from handsteer.errors import DashboardError, FrameError, HandsteerError, needing
from handsteer.graph import Graph
from handsteer.robots.world import World
from handsteer.transports.piped import Gateway, Pipe

START_TIMEOUT_S: Final = 60.0
_STOP_TIMEOUT_S: Final = 4.0
_FAREWELL_S: Final = 1.0
_ROOT: Final = Path(__file__).parents[2]


@dataclass(frozen=True)
class Facts:
    """What the page's process receives from the graph in addition to topics.

    Attributes:
        config: The nodes' configuration.
        world: The robot's world; None for a real robot.
        source: The selected camera.
        browser_is_given: Whether a browser provides its camera.
    """

    config: Config
    world: World | None
    source: Source
    browser_is_given: bool


class NearGraph:
    """Offers a graph of this process to the page in another process, as :class:`JoinedGraph` beyond the topics.

    Args:
        pipe: Not started yet; connected to a :class:`~handsteer.dashboard.remote_graph.FarGraph`.
        graph: The graph.
        file: The YAML file that its parameters were read from, which settings are saved to.
    """

    def __init__(self, pipe: Pipe, graph: Graph, file: Path | None = None) -> None:
        self._pipe = pipe
        self._graph = graph
        self._gateway = Gateway(pipe, graph.transport)
        self._told = self._facts()
        pipe.on("camera", self._use_camera)
        pipe.on("ask", self._answer)
        pipe.say("begin", self._told, graph.clock, file)

    def close(self) -> None:
        """Close the page's publishers and subscriptions."""
        self._gateway.close()

    def _facts(self) -> Facts:
        graph = self._graph
        return Facts(graph.config, graph.robot.world, graph.cameras.source, graph.cameras.browser.is_given)

    def _tell(self) -> None:
        facts = self._facts()
        if facts != self._told:
            self._told = facts
            self._pipe.say("facts", facts)

    def _use_camera(self, what: str, with_what: Any) -> None:
        cameras = self._graph.cameras
        if what == "offer":
            with contextlib.suppress(FrameError):  # checked before
                cameras.browser.offer(with_what)
        elif what == "forget":
            cameras.browser.forget()
        else:
            cameras.choose(with_what)
        self._tell()

    def _answer(self, number: int, what: str, *with_what: Any) -> None:
        """Execute a request of the page and send it the result."""
        asked: dict[str, Callable[..., Future[None]]] = {
            "reconfigure": self._reconfigure,
            "change_world": self._graph.robot.change_world,
            "enter_world": self._graph.robot.enter_world,
            "reset": self._graph.robot.reset,
        }
        asked[what](*with_what).add_done_callback(lambda done: self._done(number, done))

    def _reconfigure(self, config: Config) -> Future[None]:
        done: Future[None] = Future()
        try:
            self._graph.reconfigure(config)
        except HandsteerError as error:
            done.set_exception(error)
        else:
            done.set_result(None)
        return done

    def _done(self, number: int, done: Future[None]) -> None:
        self._tell()
        self._pipe.say("answer", number, done.exception())


class PageApart:
    """Serves the page of a graph from a separate process, which starts to load its libraries immediately.

    The graph needs no node ``steering``: it runs in the page's process.

    Raises:
        PackageMissing: NiceGUI is not installed.
    """

    def __init__(self) -> None:
        with needing("the page (a run with --headless does without)", "page", "nicegui"):
            if importlib.util.find_spec("nicegui") is None:  # importing takes a second; the other process does it
                raise ModuleNotFoundError(name="nicegui")
        path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH")]))
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "handsteer.dashboard.remote_graph"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            # Signals of the terminal go to this process only, which stops the robot before everything ends.
            start_new_session=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        self._pipe = Pipe(self.process.stdout, self.process.stdin)
        self._served: Future[str] = Future()
        self._near: NearGraph | None = None

    @property
    def is_gone(self) -> bool:
        """Whether the process, or its end of the pipe, has ended."""
        return self._pipe.ended.is_set()

    def serve(self, graph: Graph, file: Path | None = None) -> str:
        """Serve the page of ``graph`` and return its address once it answers; it contains the token if one is needed.

        Settings are saved to ``file``, the YAML file that the graph's parameters were read from.

        Raises:
            DashboardError: The address, the port or the certificate cannot be used, or the process has ended.
            ConfigError: The file can no longer be read.
        """
        self._pipe.on("served", self._served.set_result)
        self._pipe.on("refused", self._served.set_exception)
        self._pipe.on("log", _log)
        self._near = NearGraph(self._pipe, graph, file)
        self._pipe.start()
        # The process may end without a message.
        threading.Thread(target=self._give_up, name="page_end", daemon=True).start()
        try:
            return self._served.result(START_TIMEOUT_S)
        except TimeoutError:
            raise DashboardError(f"the page's process did not serve the page within {START_TIMEOUT_S:g} s") from None

    def stop(self) -> None:
        """End the page and its process; may be called more than once."""
        with contextlib.suppress(HandsteerError):
            self._pipe.say("end")
        self._pipe.close()
        if self._near is None:  # not serving yet
            self.process.kill()
        else:
            self._near.close()
        try:
            self.process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def why_gone(self) -> DashboardError:
        """Return the error for a process that has ended unexpectedly."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(_FAREWELL_S)
        code = self.process.poll()
        return DashboardError(f"the page's process has ended (exit code {code}), so the robot was told to stand")

    def _give_up(self) -> None:
        self._pipe.ended.wait()
        with contextlib.suppress(InvalidStateError):  # served or rejected already
            self._served.set_exception(self.why_gone())


def _log(record: logging.LogRecord) -> None:
    logger = logging.getLogger(record.name)
    if logger.isEnabledFor(record.levelno):
        logger.handle(record)
