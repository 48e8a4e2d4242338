"""Keeps what strangers say to the page's server from filling the terminal: one line a kind, and not too often."""

import functools
import logging
import time
from typing import Final

SAID_EVERY_S: Final = 10.0

_LONGEST: Final = 300
_THREAD: Final = "dashboard"
# What the libraries of the server log on; a filter works for its own logger only.
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
    """Lets one record a kind pass every :data:`SAID_EVERY_S`, as one line, on which later ones are counted.

    Of an exception its last line is said; with ``logging.DEBUG``, all of it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._said: dict[tuple[object, ...], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether ``record`` is to be said; shortens it."""
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
    """Keep the logs of the server's libraries short, as far as they come from the page's thread."""
    one_line = OneLineAKind()
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(one_line)
