"""What becomes of signals: they end the program in order, whatever it is just doing.

It loads next to nothing itself, for a signal may come while the rest is loaded.
"""

import math
import os
import signal
import sys
import time
from collections.abc import Callable
from types import FrameType

# Another signal so soon after one means the same; it must not interrupt the orderly end that the first one began.
_SAME_WISH_S = 1.0

_ENDING = (
    *("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGABRT", "SIGTSTP", "SIGTTIN", "SIGTTOU", "SIGUSR1", "SIGUSR2"),
    *("SIGALRM", "SIGVTALRM", "SIGPROF", "SIGXCPU", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGSYS", "SIGBREAK"),
)
"""Signals whose default is to end a program, or to hold it, as Ctrl-Z does; the robot would hear nothing of it."""

_raised: list[int] = []

Handler = Callable[[int, FrameType | None], None]


def were_raised() -> bool:
    """Return whether a signal has asked the program to end in order; a library in between may swallow the exception."""
    return bool(_raised)


def end_at_once(code: int) -> None:
    """Let signals end the program with exit code ``code``, while there is nothing yet to be left in order.

    An exception would surface in the midst of whatever is being loaded, which prints it or swallows it.
    """

    def end(_signal: int, _frame: FrameType | None) -> None:
        os._exit(code)

    _handle(end)


def end_in_order() -> None:
    """Let each signal that would end or hold the program raise KeyboardInterrupt, which leaves the robot standing.

    SIGKILL and SIGSTOP cannot be caught, and after a crash (SIGSEGV and its like) nothing can be said any more.
    """
    raised_s = -math.inf
    _raised.clear()

    def interrupt(number: int, _frame: FrameType | None) -> None:
        nonlocal raised_s
        _raised.append(number)
        now_s = time.monotonic()
        if now_s - raised_s >= _SAME_WISH_S:
            raised_s = now_s
            raise KeyboardInterrupt

    _handle(interrupt)


def _handle(handler: Handler) -> None:
    numbers = []
    for name in _ENDING:
        number = getattr(signal, name, None)
        if number is None:
            continue  # not on this system
        # A program started by nohup is to outlive the terminal. SIGINT is taken even so: a shell lets its
        # background jobs ignore it, and a robot must be stopped all the same.
        if name == "SIGHUP" and signal.getsignal(number) == signal.SIG_IGN:
            continue
        signal.signal(number, handler)
        numbers.append(number)
    if sys.platform != "win32":
        # The parent process may have blocked them until now, when they can be handled.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)
