"""Signal handlers: each signal ends the program cleanly.

This module imports little, because a signal may arrive while the rest is loaded.
"""

import math
import os
import signal
import sys
import time
from collections.abc import Callable
from types import FrameType

# Another signal this soon is ignored: it must not interrupt the shutdown that the first one started.
_REPEAT_S = 1.0

_ENDING = (
    *("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGABRT", "SIGTSTP", "SIGTTIN", "SIGTTOU", "SIGUSR1", "SIGUSR2"),
    *("SIGALRM", "SIGVTALRM", "SIGPROF", "SIGXCPU", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGSYS", "SIGBREAK"),
)
"""Signals that by default end or suspend a program, as Ctrl-Z does, without a last command to the robot."""

_raised: list[int] = []

Handler = Callable[[int, FrameType | None], None]


def were_raised() -> bool:
    """Return whether a signal was raised since :func:`interrupt_on_signals`; a library may swallow the exception."""
    return bool(_raised)


def exit_on_signals(code: int) -> None:
    """Exit with ``code`` on a signal, while there is nothing to clean up.

    An exception would interrupt an import, which may print or swallow it.
    """

    def end(_signal: int, _frame: FrameType | None) -> None:
        os._exit(code)

    _handle(end)


def ignore() -> None:
    """Ignore signals from now on, which Python's last steps would otherwise be killed by."""
    _handle(signal.SIG_IGN)


def interrupt_on_signals() -> None:
    """Raise KeyboardInterrupt on each signal that would end or suspend the program, so that the robot is stopped.

    SIGKILL and SIGSTOP cannot be caught; after a crash, such as SIGSEGV, no command can be sent.
    """
    raised_s = -math.inf
    _raised.clear()

    def interrupt(number: int, _frame: FrameType | None) -> None:
        nonlocal raised_s
        _raised.append(number)
        now_s = time.monotonic()
        if now_s - raised_s >= _REPEAT_S:
            raised_s = now_s
            raise KeyboardInterrupt

    _handle(interrupt)


def ending() -> list[signal.Signals]:
    """Return the signals of this system that end or suspend the program, and are not to be ignored from its start."""
    numbers = []
    for name in _ENDING:
        number = getattr(signal, name, None)
        if number is None:
            continue  # not on this system
        # A program started with nohup must outlive the terminal. SIGINT is handled even if ignored, as it is in a
        # shell's background jobs, because the robot must be stopped.
        if name == "SIGHUP" and signal.getsignal(number) == signal.SIG_IGN:
            continue
        numbers.append(number)
    return numbers


def _handle(handler: Handler | signal.Handlers) -> None:
    numbers = ending()
    for number in numbers:
        signal.signal(number, handler)
    if sys.platform != "win32":
        # The parent process may have blocked them until they could be handled.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)
