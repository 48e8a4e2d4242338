"""Processes that a test starts, talks to and ends."""

import contextlib
import json
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self, TypeVar

from tests.preloaded import Preloaded

NODES = (
    "handsteer.cli.app",
    "handsteer.cli.one_node",
    "handsteer.making",
    "handsteer.nodes.control",
    "handsteer.plugins.virtual_hand.camera",
    "handsteer.recognition.recognizer",
    "handsteer.plugins.sim.simulated",
)
"""What handsteer's nodes import, but for their transport."""
START_S = 60.0
"""Long, for a machine that is busy with other tests; everything waits for conditions, not for this."""
_END_S = 5.0


def free_port() -> int:
    """Return a TCP port on which nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def eventually(condition: Callable[[], Any], timeout_s: float = START_S, what: str = "") -> Any:
    """Return what ``condition`` returns once that is true; fail after ``timeout_s`` seconds."""
    deadline_s = time.monotonic() + timeout_s
    while not (result := condition()):
        assert time.monotonic() < deadline_s, f"{what or condition} has not come true within {timeout_s:g} s"
        time.sleep(0.02)
    return result


class Process:
    """A process, and what it says.

    Args:
        command: What to start.
        env: Its environment.
        log: What it prints goes to this file.
        modules: What to have imported before it starts, if it is a Python program: see :mod:`tests.preloaded`.
        pipes: Other arguments of ``subprocess.Popen``.
    """

    def __init__(
        self, command: list[str], env: dict[str, str], log: Path, modules: Sequence[str] = (), **pipes: Any
    ) -> None:
        self._log = log
        with log.open("wb") as file:
            files = {"stdout": file, "stderr": file, **pipes}
            self.popen: subprocess.Popen[Any] | Preloaded
            if modules and sys.platform == "linux" and "LD_PRELOAD" not in env:
                self.popen = Preloaded(command, env, modules, **files)
            else:
                self.popen = subprocess.Popen(command, env=env, **files)

    @property
    def text(self) -> str:
        """All that it has printed."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    @property
    def running(self) -> bool:
        """Whether it runs."""
        return self.popen.poll() is None

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.popen.send_signal(number)

    def freeze(self) -> None:
        """Stop it where it is, and wait until all its threads stand."""
        self.signal(signal.SIGSTOP)
        eventually(lambda: set(self._thread_states()) == {"T"}, what="a process that stands")

    def _thread_states(self) -> list[str]:
        tasks = Path(f"/proc/{self.popen.pid}/task").iterdir()
        return [(task / "stat").read_text().rpartition(") ")[2][0] for task in tasks]

    def code(self, timeout_s: float = START_S) -> int:
        """Wait until it has ended; return its exit code."""
        return self.popen.wait(timeout_s)

    def ask_to_end(self) -> None:
        """Send it SIGTERM, also where it is frozen."""
        if self.running:
            self.signal(signal.SIGTERM)
            self.signal(signal.SIGCONT)

    def kill(self) -> None:
        """End it at once, whatever it does."""
        if self.running:
            self.popen.send_signal(signal.SIGCONT)
            self.popen.kill()
        self.popen.wait(START_S)


class Peer(Process):
    """A plain program that knows nothing of handsteer: it takes orders as lines of JSON and tells what it gets."""

    def __init__(self, command: list[str], env: dict[str, str], log: Path, modules: Sequence[str] = ()) -> None:
        super().__init__(command, env, log, modules, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._line() == "ready", self.text

    def ask(self, order: str, **details: Any) -> Any:
        """Give an order; return its answer."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps({"order": order, **details}) + "\n")
        self.popen.stdin.flush()
        return json.loads(self._line())

    def ask_to_end(self) -> None:
        """Give no more orders, after which it ends."""
        assert self.popen.stdin is not None
        self.popen.stdin.close()

    def _line(self) -> str:
        assert self.popen.stdout is not None
        # One answer an order, so that nothing is left in Python's own buffer, which select does not see.
        assert select.select([self.popen.stdout], [], [], START_S)[0], f"the peer says nothing: {self.text}"
        line = str(self.popen.stdout.readline())
        assert line, f"the peer has ended: {self.text}"
        return line.strip()


P = TypeVar("P", bound=Process)


class Processes:
    """The processes that tests start in one graph, and which end with it.

    Args:
        home: Folder for what they print.
    """

    def __init__(self, home: Path) -> None:
        self._home = home
        self._processes: list[Process] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def adopt(self, process: P) -> P:
        """End ``process`` with the others."""
        self._processes.append(process)
        return process

    def log(self, kind: str = "process") -> Path:
        """Return where the next process prints to."""
        return self._home / f"{kind}_{len(self._processes)}.log"

    def stop(self) -> None:
        """End all processes."""
        for process in self._processes:
            process.kill()

    @contextlib.contextmanager
    def test(self) -> Iterator[Self]:
        """End what is started within this block, as else all nodes of a module's tests would run side by side."""
        before = len(self._processes)
        yield self
        mine = self._processes[before:]
        for process in mine:
            process.ask_to_end()
        for process in mine:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.code(_END_S)
            process.kill()


def as_tests_drive(verb: str, options: tuple[str, ...]) -> tuple[str, ...]:
    """Return the options of one of handsteer's nodes; a control follows the first sign, unless they say otherwise."""
    for switch in ("arming", "engage", "renew") if verb == "control" else ():
        if not any(switch in option for option in options):
            options = (f"--control.{switch}", "off", *options)
    return options
