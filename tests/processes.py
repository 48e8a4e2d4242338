"""Processes that a test starts, talks to and ends."""

import json
import select
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

START_S = 60.0
"""Long, for a machine that is busy with other tests; everything waits for conditions, not for this."""


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
    """A process, and what it says."""

    def __init__(self, command: list[str], env: dict[str, str], log: Path, **pipes: Any) -> None:
        self._log = log
        with log.open("wb") as file:
            self.popen = subprocess.Popen(command, env=env, **{"stdout": file, "stderr": file, **pipes})

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

    def kill(self) -> None:
        """End it at once, whatever it does."""
        if self.running:
            self.popen.send_signal(signal.SIGCONT)
            self.popen.kill()
        self.popen.wait()


class Peer(Process):
    """A plain program that knows nothing of handsteer: it takes orders as lines of JSON and tells what it gets."""

    def __init__(self, command: list[str], env: dict[str, str], log: Path) -> None:
        super().__init__(command, env, log, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._line() == "ready", self.text

    def ask(self, order: str, **details: Any) -> Any:
        """Give an order; return its answer."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps({"order": order, **details}) + "\n")
        self.popen.stdin.flush()
        return json.loads(self._line())

    def _line(self) -> str:
        assert self.popen.stdout is not None
        # One answer an order, so that nothing is left in Python's own buffer, which select does not see.
        assert select.select([self.popen.stdout], [], [], START_S)[0], f"the peer says nothing: {self.text}"
        line = str(self.popen.stdout.readline())
        assert line, f"the peer has ended: {self.text}"
        return line.strip()


def as_tests_drive(verb: str, options: tuple[str, ...]) -> tuple[str, ...]:
    """Return the options of one of handsteer's nodes; a control follows the first sign, unless they say otherwise."""
    for switch in ("arming", "engage") if verb == "control" else ():
        if not any(switch in option for option in options):
            options = (f"--control.{switch}", "off", *options)
    return options
