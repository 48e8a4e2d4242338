"""The process that serves the page of another process's graph; started by :mod:`handsteer.dashboard.page_process`."""

import gc
import itertools
import logging
import logging.handlers
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from handsteer.cameras.browser import Source, check_frame
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.dashboard.page_process import Facts
from handsteer.dashboard.server import Dashboard
from handsteer.errors import ConfigError, HandsteerError, TransportError
from handsteer.making import make_steering
from handsteer.nodes.steering import SteeringNode
from handsteer.robots.world import World
from handsteer.transports.piped import Pipe, PipedTransport

_PATIENCE_S = 5.0
_FAREWELL_S = 2.0
_LOOK_PERIOD_S = 0.2


class FarGraph:
    """A :class:`~handsteer.dashboard.joined.JoinedGraph` that runs in the process at the other end of a pipe.

    Use it only after :meth:`join` has returned.

    Args:
        pipe: Not started yet; connected to a :class:`~handsteer.dashboard.page_process.NearGraph`.

    Attributes:
        transport: Carries the graph's messages.
        clock: The graph's clock.
        cameras: Selects the camera in the other process.
        robot: The robot's world.
        steering: Runs in this process; not started.
    """

    clock: Clock
    steering: SteeringNode

    def __init__(self, pipe: Pipe) -> None:
        self.transport = PipedTransport(pipe)
        self.cameras = _FarCameras(pipe, lambda: self._facts)
        self.robot = _FarRobot(self._ask, lambda: self._facts)
        self._facts: Facts
        self._pipe = pipe
        self._begun: Future[tuple[Facts, Clock, Path | None]] = Future()
        self._numbers = itertools.count()
        self._asked: dict[int, Future[None]] = {}
        pipe.on("begin", lambda *what: self._begun.set_result(what))
        pipe.on("facts", self._take_facts)
        pipe.on("answer", self._take_answer)

    def join(self) -> Path | None:
        """Wait until the other process describes its graph; return the file that settings are saved to.

        Raises:
            TransportError: The other process has ended first.
        """
        while not self._pipe.ended.is_set():
            try:
                self._facts, self.clock, file = self._begun.result(_LOOK_PERIOD_S)
            except TimeoutError:
                continue
            self.steering = make_steering(self.config, self.transport, self.clock)
            return file
        raise TransportError("the graph's process has ended")

    @property
    def config(self) -> Config:
        """The nodes' configuration."""
        return self._facts.config

    def reconfigure(self, config: Config) -> None:
        """Apply the live parameters of ``config`` to the nodes, in both processes.

        Raises:
            ConfigError: A node rejects them, or the other process does not answer; nothing has changed.
        """
        try:
            self._ask("reconfigure", config).result(_PATIENCE_S)
        except TimeoutError:
            raise ConfigError("the robot's process does not answer: try again") from None
        self.steering.reconfigure(config)

    def _ask(self, what: str, *with_what: object) -> Future[None]:
        """Request an action of the other process; return a future of its result."""
        number, future = next(self._numbers), Future[None]()
        self._asked[number] = future
        self._pipe.say("ask", number, what, *with_what)
        return future

    def _take_facts(self, facts: Facts) -> None:
        self._facts = facts

    def _take_answer(self, number: int, error: BaseException | None) -> None:
        future = self._asked.pop(number)
        if not future.set_running_or_notify_cancel():
            return  # nothing waits for it any more
        if error is None:
            future.set_result(None)
        else:
            future.set_exception(error)


class _FarCameras:
    def __init__(self, pipe: Pipe, facts: Callable[[], Facts]) -> None:
        self._pipe = pipe
        self._facts = facts
        self.browser = _FarBrowserFrames(pipe, facts)

    @property
    def source(self) -> Source:
        return self._facts().source

    def choose(self, source: Source) -> None:
        self._pipe.say("camera", "choose", source)


class _FarBrowserFrames:
    def __init__(self, pipe: Pipe, facts: Callable[[], Facts]) -> None:
        self._pipe = pipe
        self._facts = facts

    @property
    def is_given(self) -> bool:
        return self._facts().browser_is_given

    def offer(self, data: bytes) -> None:
        check_frame(data)
        self._pipe.say("camera", "offer", data, key="browser's frame", keep=1)

    def forget(self) -> None:
        self._pipe.say("camera", "forget", None)


class _FarRobot:
    def __init__(self, ask: Callable[..., Future[None]], facts: Callable[[], Facts]) -> None:
        self._ask = ask
        self._facts = facts

    @property
    def world(self) -> World | None:
        return self._facts().world

    def change_world(self, change: Callable[[World], World]) -> Future[None]:
        return self._ask("change_world", change)

    def enter_world(self, world: World) -> Future[None]:
        return self._ask("enter_world", world)

    def reset(self) -> Future[None]:
        return self._ask("reset")


def serve(pipe: Pipe) -> None:
    """Serve the page of the graph at the other end of ``pipe``, not started yet, until it asks to end or is gone.

    Raises:
        HandsteerError: The page cannot be served.
    """
    graph, end = FarGraph(pipe), threading.Event()
    pipe.on("end", end.set)
    pipe.start()
    dashboard = Dashboard.of(graph, graph.join())
    pipe.say("served", dashboard.start())
    graph.steering.start()
    # Objects loaded so far stay. Frozen, they do not slow down collections, which can then run as soon as a few pages
    # have been closed; each takes a megabyte.
    gc.collect()
    gc.freeze()
    while not (end.wait(_LOOK_PERIOD_S) or pipe.ended.is_set()):
        pass
    graph.steering.stop()
    dashboard.stop()


class _Records:
    """The queue of a :class:`logging.handlers.QueueHandler`: forwards records to the other process's log."""

    def __init__(self, pipe: Pipe) -> None:
        self._pipe = pipe

    def put_nowait(self, record: logging.LogRecord) -> None:
        self._pipe.say("log", record, key="log", keep=100)


def main() -> None:
    """Communicate with the other process by standard input and output."""
    # Other output must not mix with the messages.
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    pipe = Pipe(sys.stdin.buffer, sink)
    logging.basicConfig(level=logging.INFO, handlers=[logging.handlers.QueueHandler(_Records(pipe))])  # type: ignore[arg-type] # it only puts
    try:
        serve(pipe)
    except HandsteerError as error:
        pipe.say("refused", error)
    pipe.close(_FAREWELL_S)


if __name__ == "__main__":
    main()
