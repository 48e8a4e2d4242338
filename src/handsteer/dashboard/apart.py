"""The page in a process of its own, as the graph sees it: whatever holds that process up, the robot's nodes go on.

:mod:`handsteer.dashboard.alone` is the other end.
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
    """What the page's process knows of the graph beside its topics.

    Attributes:
        config: What the nodes run with.
        world: The world of the robot; None for a real one's.
        source: Which camera is chosen.
        browser_is_given: Whether a browser gives its camera.
    """

    config: Config
    world: World | None
    source: Source
    browser_is_given: bool


class NearGraph:
    """Lets the page in another process do with a graph of this one what :class:`JoinedGraph` has beside the topics.

    Args:
        pipe: To the page's process, not started yet: to a :class:`~handsteer.dashboard.alone.FarGraph`.
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
        """End what was published and subscribed for the page."""
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
            with contextlib.suppress(FrameError):  # which was looked at already
                cameras.browser.offer(with_what)
        elif what == "forget":
            cameras.browser.forget()
        else:
            cameras.choose(with_what)
        self._tell()

    def _answer(self, number: int, what: str, *with_what: Any) -> None:
        """Do what the page asks of the graph; it hears what came of it."""
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
    """Serves the page of a graph from a process of its own, which begins to load its libraries at once.

    The graph needs no node ``steering``: the page's process has it.

    Raises:
        PackageMissing: NiceGUI is not installed.
    """

    def __init__(self) -> None:
        with needing("the page (a run with --headless does without)", "page", "nicegui"):
            if importlib.util.find_spec("nicegui") is None:  # loading it takes a second, which the other process does
                raise ModuleNotFoundError(name="nicegui")
        path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH")]))
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "handsteer.dashboard.alone"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            # What the terminal sends is for this process, which sees to it that the robot stands before all ends.
            start_new_session=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        self._pipe = Pipe(self.process.stdout, self.process.stdin)
        self._served: Future[str] = Future()
        self._near: NearGraph | None = None

    @property
    def is_gone(self) -> bool:
        """Whether the process has ended, or its end of the pipe has."""
        return self._pipe.ended.is_set()

    def serve(self, graph: Graph, file: Path | None = None) -> str:
        """Serve the page of ``graph`` and return its address once it answers; it holds the token where one is needed.

        Args:
            graph: What the page is of.
            file: The YAML file that its parameters were read from, which settings are saved to.

        Raises:
            DashboardError: The address, the port or the certificate cannot be used, or the process has ended.
            ConfigError: The file cannot be read any more.
        """
        self._pipe.on("served", self._served.set_result)
        self._pipe.on("refused", self._served.set_exception)
        self._pipe.on("log", _log)
        self._near = NearGraph(self._pipe, graph, file)
        self._pipe.start()
        # The process may end without a word.
        threading.Thread(target=self._give_up, name="page_end", daemon=True).start()
        try:
            return self._served.result(START_TIMEOUT_S)
        except TimeoutError:
            raise DashboardError(f"the page's process did not serve the page within {START_TIMEOUT_S:g} s") from None

    def stop(self) -> None:
        """End the page and its process; may be called twice."""
        with contextlib.suppress(HandsteerError):
            self._pipe.say("end")
        self._pipe.close()
        if self._near is None:  # it serves nothing yet
            self.process.kill()
        else:
            self._near.close()
        try:
            self.process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def why_gone(self) -> DashboardError:
        """Return what to say when the process has ended by itself."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(_FAREWELL_S)
        code = self.process.poll()
        return DashboardError(f"the page's process has ended (exit code {code}), so the robot was told to stand")

    def _give_up(self) -> None:
        self._pipe.ended.wait()
        with contextlib.suppress(InvalidStateError):  # it was served, or refused
            self._served.set_exception(self.why_gone())


def _log(record: logging.LogRecord) -> None:
    logger = logging.getLogger(record.name)
    if logger.isEnabledFor(record.levelno):
        logger.handle(record)
