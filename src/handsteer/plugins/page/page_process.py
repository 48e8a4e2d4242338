"""The page in its own process: a stalled page does not delay the robot's nodes."""

import contextlib
import functools
import gc
import importlib.util
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import TYPE_CHECKING, Final

from handsteer.errors import DashboardError, needing
from handsteer.graph import Graph
from handsteer.plugins.page import editing
from handsteer.plugins.page.remote_graph import GraphServer, RemoteGraph
from handsteer.plugins.page.viewers import PageAudit
from handsteer.plugins.study.session import Task
from handsteer.transports.child import Child, serve_parent
from handsteer.transports.piped import Pipe

if TYPE_CHECKING:
    from handsteer.plugins.page.server import Dashboard

START_TIMEOUT_S: Final = 60.0
_LOOK_PERIOD_S: Final = 0.2


class PageProcess:
    """Serves the page of a graph from a separate process, which starts to load its libraries immediately.

    The graph needs no node ``steering``: it runs in the page's process.

    Attributes:
        on_driver: Called with the viewer or program that has got the seat, or None if it is free; set it before
            :meth:`serve`.

    Raises:
        PackageMissing: NiceGUI is not installed.
    """

    def __init__(self) -> None:
        with needing("the page (a run with --headless does without)", "page", "nicegui"):
            if importlib.util.find_spec("nicegui") is None:  # importing takes a second; the other process does it
                raise ModuleNotFoundError(name="nicegui")
        self._child = Child(__name__, pure_modules=[editing.__name__])
        self.process = self._child.process
        self._address: Future[str] = Future()
        self._server: GraphServer | None = None
        self.on_driver: Callable[[str | None], None] = lambda _: None

    @property
    def is_gone(self) -> bool:
        """Whether the process, or its end of the pipe, has ended."""
        return self._child.is_gone

    def serve(self, graph: Graph, file: Path | None = None, study: Task | None = None) -> str:
        """Serve the page of ``graph`` and return its address once it answers; it contains the token if one is needed.

        Settings are saved to ``file``, the YAML file that the graph's parameters were read from. With a ``study``, the
        address is that of its page, and the robot is stopped until a lap begins.

        Raises:
            DashboardError: The address, the port or the certificate cannot be used, or the process has ended.
            ConfigError: The file can no longer be read.
        """
        pipe = self._child.pipe
        pipe.on("served", self._address.set_result)
        pipe.on("refused", self._address.set_exception)
        pipe.on("driver", self.on_driver)
        self._server = GraphServer(pipe, graph, file, study)
        pipe.start()
        # The process may end without a message.
        threading.Thread(target=self._watch, name="page_end", daemon=True).start()
        try:
            return self._address.result(START_TIMEOUT_S)
        except TimeoutError:
            raise DashboardError(f"the page's process did not serve the page within {START_TIMEOUT_S:g} s") from None

    def seat(self, request: str, program: str) -> None:
        """Ask for the seat (``ask``) for a program that is not a page, or give it back (``leave``).

        Ignored before :meth:`serve`.
        """
        if self._server is not None:
            self._child.pipe.say("seat", request, program, key=f"seat of {program}", keep=1)

    def stop(self) -> None:
        """End the page and its process; may be called more than once."""
        self._child.stop(at_once=self._server is None)
        if self._server is not None:
            self._server.close()

    def why_gone(self) -> DashboardError:
        """Return the error for a process that has ended unexpectedly."""
        code = self._child.exit_code()
        return DashboardError(f"the page's process has ended (exit code {code}), so the robot was commanded to stop")

    def _watch(self) -> None:
        self._child.pipe.ended.wait()
        with contextlib.suppress(InvalidStateError):  # served or rejected already
            self._address.set_exception(self.why_gone())


def _serve(pipe: Pipe) -> None:
    """In the page's process: serve the page of the graph at the other end of ``pipe`` until that ends.

    Raises:
        HandsteerError: The page cannot be served.
    """
    gc.disable()  # imports leave no garbage, and searching for it takes a fifth of their time
    # The graph's process, which imports this module too, does not load NiceGUI.
    from nicegui import Client  # noqa: PLC0415

    from handsteer.plugins.page.closed_pages import Garbage  # noqa: PLC0415
    from handsteer.plugins.page.server import Dashboard  # noqa: PLC0415

    graph, end = RemoteGraph(pipe), threading.Event()
    pages: Future[Dashboard] = Future()
    pipe.on("end", end.set)
    pipe.on("seat", lambda *request: _request_seat(pages.result(), graph.audit, *request) if pages.done() else None)
    pipe.start()
    dashboard = Dashboard.of(graph, graph.join())
    graph.audit.on_driver = functools.partial(pipe.say, "driver", key="driver", keep=1)
    pages.set_result(dashboard)
    pipe.say("served", dashboard.start())
    graph.steering.start()
    if graph.study is not None:
        graph.steering.halt()
    garbage = Garbage()
    garbage.start(time.monotonic())
    while not (end.wait(_LOOK_PERIOD_S) or pipe.ended.is_set()):
        garbage.look(time.monotonic(), stands=dashboard.robot_stands, pages=len(Client.instances))
    graph.steering.stop()
    dashboard.stop()


def _request_seat(dashboard: "Dashboard", audit: PageAudit, request: str, program: str) -> None:
    node = dashboard.node
    if request == "ask":
        audit.introduce_program(program)
        if joined := node.join(program):
            joined.lease.ask(program, joined.clock.now())
    elif node.is_watched_by(program) and (joined := node.join(program)):
        joined.leave(program)
        node.leave(program)
        audit.forget(program)


if __name__ == "__main__":
    serve_parent(_serve)
