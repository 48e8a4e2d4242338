"""Python programs that start at once: forked from a process that has imported what they need.

Imports take most of a node's start, half a second of a processor, and tests start hundreds of nodes. As a program, this
is the process that forks; see :class:`Preloaded` for the tests' side.
"""

import atexit
import contextlib
import ctypes
import importlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

_SET_CHILD_SUBREAPER = 36  # of prctl(2)
_LARGEST_REQUEST = 1 << 20
_LONGEST_FORK_S = 60.0
"""Imports included. What takes longer never comes, and its caller would wait while it holds the lock of all others."""
_END_S = 10.0
_LIBRARIES = ("PYTHONPATH", "LD_LIBRARY_PATH")  # read when an interpreter starts


class _Forks:
    """The process that forks, for one interpreter and one set of libraries."""

    def __init__(self, python: str, env: dict[str, str]) -> None:
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            # rospy sets a timeout for all sockets of a process.
            self._channel.settimeout(_LONGEST_FORK_S)
            theirs.setblocking(True)
            command = [python, __file__, str(theirs.fileno())]
            self._process = subprocess.Popen(command, env=env, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL)
        atexit.register(self._end)

    def _end(self) -> None:
        self._channel.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:  # a process that was forked, and not ended, has the channel too
            self._process.kill()
            self._process.wait()

    @property
    def runs(self) -> bool:
        """Whether it can fork."""
        return self._process.poll() is None

    def fork(self, request: dict[str, Any], files: Sequence[int]) -> int:
        """Start a program as a child of this process; return its process ID."""
        prctl = ctypes.CDLL(None).prctl
        # The process between the two ends at once, which makes its child ours; orphans of other processes stay init's.
        prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        try:
            socket.send_fds(self._channel, [json.dumps(request).encode()], files)
            answer = self._channel.recv(64)
        except TimeoutError:
            self._process.kill()
            answer = b""
        finally:
            prctl(_SET_CHILD_SUBREAPER, 0, 0, 0, 0)
        assert answer, "the process that forks has ended, or does not answer"
        return int(answer)


_forks: dict[tuple[str | None, ...], _Forks] = {}
_lock = threading.Lock()


class Preloaded:
    """What tests use of :class:`subprocess.Popen`, of a Python program that starts at once.

    Args:
        command: An interpreter, ``-P`` or not, then ``-m`` and a module, or a script, then its arguments.
        env: The whole environment.
        modules: What to import before the program starts; those that are not installed are left out.
        stdin: A file, or ``subprocess.PIPE``; as ours, if none is given.
        stdout: A file, or ``subprocess.PIPE``; as ours, if none is given.
        stderr: A file; as ours, if none is given.
        text: Whether pipes are of text.
        start_new_session: Whether signals of the terminal do not reach it.

    Attributes:
        pid: Its process ID.
        returncode: Its exit code, or minus the signal that ended it; none while it runs.
        stdin: Where to write what it reads, if that is a pipe.
        stdout: Where to read what it writes, if that is a pipe.
    """

    def __init__(
        self,
        command: Sequence[str],
        env: dict[str, str],
        modules: Sequence[str],
        *,
        stdin: int | IO[bytes] = 0,
        stdout: int | IO[bytes] = 1,
        stderr: int | IO[bytes] = 2,
        text: bool = False,
        start_new_session: bool = False,
    ) -> None:
        self.returncode: int | None = None
        self.stdin: IO[Any] | None = None
        self.stdout: IO[Any] | None = None
        self._waiting = threading.Lock()
        python, *words = command
        request = {
            "words": words,
            "env": env,
            "cwd": str(Path.cwd()),
            "modules": list(modules),
            "start_new_session": start_new_session,
        }
        key = (python, *(env.get(name) for name in _LIBRARIES))
        with contextlib.ExitStack() as theirs:
            if stdin == subprocess.PIPE:
                reading, writing = os.pipe()
                stdin = theirs.enter_context(os.fdopen(reading, "rb"))
                self.stdin = os.fdopen(writing, "w" if text else "wb")
            if stdout == subprocess.PIPE:
                reading, writing = os.pipe()
                stdout = theirs.enter_context(os.fdopen(writing, "wb"))
                self.stdout = os.fdopen(reading, "r" if text else "rb")
            files = [file if isinstance(file, int) else file.fileno() for file in (stdin, stdout, stderr)]
            with _lock:
                if key not in _forks or not _forks[key].runs:
                    _forks[key] = _Forks(python, env)
                self.pid = _forks[key].fork(request, files)

    def poll(self) -> int | None:
        """Return the exit code, or none while it runs."""
        with self._waiting:
            if self.returncode is None:
                pid, status = os.waitpid(self.pid, os.WNOHANG)
                if pid:
                    self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code once it has ended.

        Raises:
            subprocess.TimeoutExpired: It runs for longer than ``timeout``, in seconds.
        """
        deadline_s = time.monotonic() + (float("inf") if timeout is None else timeout)
        while (code := self.poll()) is None:
            if timeout is not None and time.monotonic() > deadline_s:
                raise subprocess.TimeoutExpired(str(self.pid), timeout)
            time.sleep(0.005)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal, if it runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


def _serve(channel: socket.socket) -> list[str]:
    """Fork at each request; return in the new process, with its arguments."""
    while True:
        data, files, _, _ = socket.recv_fds(channel, _LARGEST_REQUEST, 3)
        if not data:
            sys.exit()
        request = json.loads(data)
        for module in request["modules"]:
            with contextlib.suppress(ImportError):
                importlib.import_module(module)
        mine, theirs = os.pipe()
        between = os.fork()
        if between == 0:
            child = os.fork()
            if child == 0:
                for file in (channel.detach(), mine, theirs):
                    os.close(file)
                return _become(request, files)
            os.write(theirs, str(child).encode())
            os._exit(0)
        os.close(theirs)  # so that the end of the process between is seen, where it could not fork
        os.waitpid(between, 0)
        channel.send(os.read(mine, 64))
        for file in (mine, *files):
            os.close(file)


def _become(request: dict[str, Any], files: list[int]) -> list[str]:
    if request["start_new_session"]:
        os.setsid()
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(request["env"])
    os.chdir(request["cwd"])
    if os.environ.get("PYTHONUNBUFFERED"):
        for text in (sys.stdout, sys.stderr):
            text.reconfigure(write_through=True)  # type: ignore[union-attr]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    words: list[str] = request["words"]
    return words


def _run(words: list[str]) -> None:
    """Run the module or the script of ``words``, with its own arguments and folder in place."""
    keeps_path = words[0] == "-P"
    words = words[keeps_path:]
    if words[0] == "-m":
        module = words[1]
        sys.argv = [module, *words[2:]]
        if not keeps_path:
            sys.path.insert(0, str(Path.cwd()))
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    else:
        sys.argv = words
        sys.path.insert(0, str(Path(words[0]).resolve().parent))
        runpy.run_path(words[0], run_name="__main__")


if __name__ == "__main__":
    del sys.path[0]  # the tests' folders are named as what they test
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C of who runs the tests; it ends when its channel does
    _run(_serve(socket.socket(fileno=int(sys.argv[1]))))
