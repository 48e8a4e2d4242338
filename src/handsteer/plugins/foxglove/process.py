"""The server of topics in its own process: whatever clients ask for and send, the graph is not delayed."""

import contextlib
import importlib.util
import logging
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, InvalidStateError
from typing import Any, Final

from handsteer.clock import Clock
from handsteer.config import FoxgloveConfig
from handsteer.errors import LiveError, needing
from handsteer.messages import Topic
from handsteer.transports.base import Transport
from handsteer.transports.child import Child, serve_parent
from handsteer.transports.piped import Gateway, Pipe, PipedTransport

_START_TIMEOUT_S: Final = 60.0
_LOOK_PERIOD_S: Final = 0.2
_NICENESS: Final = 5

log = logging.getLogger(__name__)


class LiveProcess:
    """Serves the topics of a graph from a separate process, which starts to load its libraries immediately.

    Raises:
        PackageMissing: The package websockets is not installed.
    """

    def __init__(self) -> None:
        with needing("--foxglove", "foxglove", "websockets"):
            if importlib.util.find_spec("websockets") is None:
                raise ModuleNotFoundError(name="websockets")
        self._child = Child(__name__)
        self.process = self._child.process
        self._address: Future[str] = Future()
        self._gateway: Gateway | None = None
        self._is_stopped = False
        self._shares: Callable[[str, str], None] | None = None

    def share_seat(self, say: Callable[[str, str], None]) -> None:
        """Let clients ask the page for the seat, and not take it themselves; call it before :meth:`serve`.

        Args:
            say: Called with ``ask`` or ``leave``, and the name of the client. The answer is :meth:`note_driver`.
        """
        self._shares = say

    def note_driver(self, driver: str | None) -> None:
        """Note who has the seat now, a client or a viewer of the page."""
        self._child.pipe.say("driver", driver, key="driver", keep=1)

    def serve(self, transport: Transport, clock: Clock, topics: Sequence[Topic[Any]], config: FoxgloveConfig) -> str:
        """Serve ``topics`` and return the address, with the token if one is needed.

        If the process ends later, a warning is logged, and driving goes on.

        Args:
            transport: The graph's.
            clock: The graph's.
            topics: What to offer.
            config: Address and token, and whether clients may drive.

        Raises:
            LiveError: The address or the port cannot be used, or the process has ended.
        """
        pipe = self._child.pipe
        pipe.on("served", self._address.set_result)
        pipe.on("refused", self._address.set_exception)
        if self._shares is not None:
            pipe.on("seat", self._shares)
        self._gateway = Gateway(pipe, transport)
        pipe.say("begin", clock, tuple(topics), config, self._shares is not None)
        pipe.start()
        threading.Thread(target=self._watch, name="foxglove_end", daemon=True).start()
        try:
            return self._address.result(_START_TIMEOUT_S)
        except TimeoutError:
            raise LiveError(f"the process for Foxglove did not start within {_START_TIMEOUT_S:g} s") from None

    def stop(self) -> None:
        """End the process; may be called more than once."""
        self._is_stopped = True
        if self._gateway is not None:
            self._gateway.close()
        self._child.stop(at_once=self._gateway is None)

    def _watch(self) -> None:
        self._child.pipe.ended.wait()
        if self._is_stopped or (self._address.done() and self._address.exception() is not None):
            return
        problem = f"the process for Foxglove has ended (exit code {self._child.exit_code()})"
        with contextlib.suppress(InvalidStateError):
            self._address.set_exception(LiveError(problem))
            return
        log.warning("%s; driving goes on", problem)
        if self._gateway is not None:
            self._gateway.close()


def _serve(pipe: Pipe) -> None:
    """In the child: serve the topics of the graph at the other end of ``pipe`` until that ends.

    Raises:
        LiveError: They cannot be served.
    """
    # The graph's process, which imports this module too, needs no server.
    from handsteer.nodes.steering import SteeringNode  # noqa: PLC0415
    from handsteer.plugins.foxglove.driving import Driving, Seat, SharedSeat  # noqa: PLC0415
    from handsteer.plugins.foxglove.server import LiveServer  # noqa: PLC0415

    if hasattr(os, "nice"):
        os.nice(_NICENESS)  # where processors are scarce, driving comes first
    begun: Future[tuple[Clock, tuple[Topic[Any], ...], FoxgloveConfig, bool]] = Future()
    end = threading.Event()
    shared = SharedSeat(lambda request, program: pipe.say("seat", request, program, key=f"seat of {program}", keep=1))
    pipe.on("driver", shared.note)
    pipe.on("begin", lambda *what: begun.set_result(what))
    pipe.on("end", end.set)
    transport = PipedTransport(pipe)
    pipe.start()
    while not begun.done():
        if end.wait(_LOOK_PERIOD_S) or pipe.ended.is_set():
            return
    clock, topics, config, is_shared = begun.result()
    steering = SteeringNode(transport, clock, name="foxglove") if config.drive else None
    driving = Driving(steering, shared if is_shared else Seat()) if steering is not None else None
    server = LiveServer(transport, clock, topics, config, driving)
    pipe.say("served", server.start())
    if steering is not None:
        steering.start()
    while not (end.wait(_LOOK_PERIOD_S) or pipe.ended.is_set()):
        pass
    server.stop()
    if steering is not None:
        steering.stop()


if __name__ == "__main__":
    serve_parent(_serve)
