"""Limits the log output of the page's server: one line per kind of message, and not too often."""

import functools
import logging
import time
from typing import Final

SAID_EVERY_S: Final = 10.0

_LONGEST: Final = 300
_THREAD: Final = "dashboard"
# Loggers of the server's libraries; a filter applies to its own logger only.
_LOGGERS: Final = (
    "asyncio",
    "engineio.server",
    "handsteer.dashboard.socket_events",
    "nicegui",
    "socketio.server",
    "uvicorn.asgi",
    "uvicorn.error",
)


class OneLineAKind(logging.Filter):
    """Passes one record per kind every :data:`SAID_EVERY_S`, as one line, with the number of suppressed ones.

    An exception is reduced to its last line. With ``logging.DEBUG``, all records pass unchanged.
    """

    def __init__(self) -> None:
        super().__init__()
        self._said: dict[tuple[object, ...], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to log ``record``; shortens it."""
        if record.threadName != _THREAD or logging.getLogger(record.name).isEnabledFor(logging.DEBUG):
            return True
        error = record.exc_info[1] if record.exc_info else None
        kind = (record.name, record.pathname, record.lineno, record.levelno, type(error))
        said_s, left_out = self._said.get(kind, (-float("inf"), 0))
        now_s = time.monotonic()
        if now_s - said_s < SAID_EVERY_S:
            self._said[kind] = (said_s, left_out + 1)
            return False
        self._said[kind] = (now_s, 0)
        _shorten(record, error, left_out)
        return True


def _shorten(record: logging.LogRecord, error: BaseException | None, left_out: int) -> None:
    words = record.getMessage()
    if error is not None:
        words = f"{words}: {type(error).__name__}: {error}"
    printable = "".join(each if each.isprintable() else " " for each in words[:_LONGEST])
    record.msg = printable + (f" (and {left_out} times before)" if left_out else "")
    record.args = ()
    record.exc_info = record.exc_text = record.stack_info = None


@functools.cache
def keep_short() -> None:
    """Shorten the logs of the server's libraries that come from the page's thread."""
    one_line = OneLineAKind()
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(one_line)
