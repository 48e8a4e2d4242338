"""The page in its own process: a stalled page does not delay the robot's nodes."""

import contextlib
import gc
import importlib.util
import logging
import logging.handlers
import os
import subprocess
import sys
import threading
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Final

from handsteer.dashboard.remote_graph import GraphServer, RemoteGraph
from handsteer.errors import DashboardError, HandsteerError, needing
from handsteer.graph import Graph
from handsteer.study.session import Task
from handsteer.transports.piped import Pipe

START_TIMEOUT_S: Final = 60.0
_STOP_TIMEOUT_S: Final = 4.0
_EXIT_TIMEOUT_S: Final = 1.0
_FLUSH_TIMEOUT_S: Final = 2.0
_LOOK_PERIOD_S: Final = 0.2
_ROOT: Final = Path(__file__).parents[2]


class PageProcess:
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
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            # Signals of the terminal go to this process only, which stops the robot before everything ends.
            start_new_session=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        self._pipe = Pipe(self.process.stdout, self.process.stdin)
        self._address: Future[str] = Future()
        self._server: GraphServer | None = None

    @property
    def is_gone(self) -> bool:
        """Whether the process, or its end of the pipe, has ended."""
        return self._pipe.ended.is_set()

    def serve(self, graph: Graph, file: Path | None = None, study: Task | None = None) -> str:
        """Serve the page of ``graph`` and return its address once it answers; it contains the token if one is needed.

        Settings are saved to ``file``, the YAML file that the graph's parameters were read from. With a ``study``, the
        address is that of its page, and the robot is stopped until a lap begins.

        Raises:
            DashboardError: The address, the port or the certificate cannot be used, or the process has ended.
            ConfigError: The file can no longer be read.
        """
        self._pipe.on("served", self._address.set_result)
        self._pipe.on("refused", self._address.set_exception)
        self._pipe.on("log", _log)
        self._server = GraphServer(self._pipe, graph, file, study)
        self._pipe.start()
        # The process may end without a message.
        threading.Thread(target=self._watch, name="page_end", daemon=True).start()
        try:
            return self._address.result(START_TIMEOUT_S)
        except TimeoutError:
            raise DashboardError(f"the page's process did not serve the page within {START_TIMEOUT_S:g} s") from None

    def stop(self) -> None:
        """End the page and its process; may be called more than once."""
        with contextlib.suppress(HandsteerError):
            self._pipe.say("end")
        self._pipe.close()
        if self._server is None:  # not serving yet
            self.process.kill()
        else:
            self._server.close()
        try:
            self.process.wait(_STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def why_gone(self) -> DashboardError:
        """Return the error for a process that has ended unexpectedly."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(_EXIT_TIMEOUT_S)
        code = self.process.poll()
        return DashboardError(f"the page's process has ended (exit code {code}), so the robot was commanded to stop")

    def _watch(self) -> None:
        self._pipe.ended.wait()
        with contextlib.suppress(InvalidStateError):  # served or rejected already
            self._address.set_exception(self.why_gone())


def _log(record: logging.LogRecord) -> None:
    logger = logging.getLogger(record.name)
    if logger.isEnabledFor(record.levelno):
        logger.handle(record)


class _Records:
    """The queue of a :class:`logging.handlers.QueueHandler`: forwards records to the other process's log."""

    def __init__(self, pipe: Pipe) -> None:
        self._pipe = pipe

    def put_nowait(self, record: logging.LogRecord) -> None:
        self._pipe.say("log", record, key="log", keep=100)


def _serve(pipe: Pipe) -> None:
    """In the page's process: serve the page of the graph at the other end of ``pipe`` until that ends.

    Raises:
        HandsteerError: The page cannot be served.
    """
    # The graph's process, which imports this module too, does not load NiceGUI.
    from handsteer.dashboard.server import Dashboard  # noqa: PLC0415

    graph, end = RemoteGraph(pipe), threading.Event()
    pipe.on("end", end.set)
    pipe.start()
    dashboard = Dashboard.of(graph, graph.join())
    pipe.say("served", dashboard.start())
    graph.steering.start()
    if graph.study is not None:
        graph.steering.halt()
    # Objects loaded so far stay. Frozen, they do not slow down collections, which can then run as soon as a few pages
    # have been closed; each takes a megabyte.
    gc.collect()
    gc.freeze()
    while not (end.wait(_LOOK_PERIOD_S) or pipe.ended.is_set()):
        pass
    graph.steering.stop()
    dashboard.stop()


def main() -> None:
    """In the page's process: communicate with the graph's by standard input and output."""
    # Other output must not mix with the messages.
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    pipe = Pipe(sys.stdin.buffer, sink)
    logging.basicConfig(level=logging.INFO, handlers=[logging.handlers.QueueHandler(_Records(pipe))])  # type: ignore[arg-type] # it only puts
    try:
        _serve(pipe)
    except HandsteerError as error:
        pipe.say("refused", error)
    pipe.close(_FLUSH_TIMEOUT_S)


if __name__ == "__main__":
    main()
