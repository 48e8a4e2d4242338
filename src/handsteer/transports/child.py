"""A process for what must not delay the graph, such as a page: it is started here, and talks to us by a pipe."""

import contextlib
import logging
import logging.handlers
import os
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from subprocess import PIPE, Popen, TimeoutExpired
from typing import Final

from handsteer.errors import HandsteerError
from handsteer.transports.piped import Pipe

_ROOT: Final = Path(__file__).parents[2]
_STOP_TIMEOUT_S: Final = 4.0
_EXIT_TIMEOUT_S: Final = 1.0
_FLUSH_TIMEOUT_S: Final = 2.0


class Child:
    """A child process that runs a module, whose main function calls :func:`serve_parent`; it starts immediately.

    Its log appears in ours. Signals of the terminal do not reach it, so that it outlives the stop of the robot.

    Args:
        module: Full name of the module.
        pure_modules: Those whose functions it may send; see :class:`~handsteer.transports.piped.Pipe`.

    Attributes:
        process: The process.
        pipe: Our end of the pipe, not started yet.
    """

    def __init__(self, module: str, pure_modules: Collection[str] = ()) -> None:
        path = os.pathsep.join(filter(None, [str(_ROOT), os.environ.get("PYTHONPATH")]))
        self.process = Popen(
            [sys.executable, "-P", "-m", module],
            stdin=PIPE,
            stdout=PIPE,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        # It may serve a network, which must not reach this process.
        self.pipe = Pipe(self.process.stdout, self.process.stdin, trusts=False, pure_modules=pure_modules)
        self.pipe.on("log", _log)

    @property
    def is_gone(self) -> bool:
        """Whether the process, or its end of the pipe, has ended."""
        return self.pipe.ended.is_set()

    def stop(self, *, at_once: bool = False) -> None:
        """End the process; may be called more than once.

        Args:
            at_once: Kill it, as it has nothing to finish.
        """
        with contextlib.suppress(HandsteerError):
            self.pipe.say("end")
        self.pipe.close()
        if at_once:
            self.process.kill()
        try:
            self.process.wait(_STOP_TIMEOUT_S)
        except TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def exit_code(self) -> int | None:
        """Return the exit code of a process that has ended; None if it does not end within a second."""
        with contextlib.suppress(TimeoutExpired):
            self.process.wait(_EXIT_TIMEOUT_S)
        return self.process.poll()


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


def serve_parent(serve: Callable[[Pipe], None]) -> None:
    """In the child: run ``serve`` with our end of the pipe, which it starts, and report its HandsteerError, if any.

    The parent gets the error as the message ``refused``.
    """
    # Other output must not mix with the messages.
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    # Python closes its own standard input at the end, and aborts if a thread is reading it.
    source = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    pipe = Pipe(source, sink, trusts=True)
    to_parent = logging.handlers.QueueHandler(_Records(pipe))  # type: ignore[arg-type] # it only puts
    logging.basicConfig(level=logging.INFO, format="%(message)s", handlers=[to_parent])
    try:
        serve(pipe)
    except HandsteerError as error:
        pipe.say("refused", error)
    pipe.close(_FLUSH_TIMEOUT_S)
