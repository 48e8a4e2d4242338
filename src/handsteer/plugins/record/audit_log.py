"""The audit as a log file, for runs that are not recorded."""

import datetime
import logging
import logging.handlers
import queue
import sys
from contextlib import ExitStack
from io import TextIOWrapper
from pathlib import Path

import platformdirs

from handsteer.clock import to_seconds
from handsteer.messages import AUDIT, Log
from handsteer.transports.base import Received, Transport

_FILE_BYTES = 1 << 20
_OLD_FILES = 4
_MOST_WAITING = 1000

log = logging.getLogger(__name__)


def audit_log_path(choice: str, *, is_simulated_time: bool = False) -> Path | None:
    """Return the file that ``recording.audit_log`` stands for; None if no file is to be written."""
    if choice == "off" or (choice == "auto" and is_simulated_time):
        return None
    if choice == "auto":
        return platformdirs.user_log_path("handsteer", appauthor=False) / "audit.log"
    return Path(choice).expanduser()


class AuditLog:
    """Writes each message on ``/audit`` to a file as a line of text, on a thread of its own.

    A line has the time in UTC, the code of the event, who did it, and the sentence, separated by tabs. A file of a
    megabyte is renamed to ``.1``; older ones up to ``.4`` are kept. If it cannot be written, that is logged once.

    Args:
        transport: Carries the messages.
        path: The file; its folder is created.
    """

    def __init__(self, transport: Transport, path: Path) -> None:
        self._waiting: queue.Queue[logging.LogRecord] = queue.Queue(_MOST_WAITING)
        file = _File(path)
        listener = logging.handlers.QueueListener(self._waiting, file)
        listener.start()
        self._end = ExitStack()
        self._end.callback(file.close)
        self._end.callback(listener.stop)
        self._end.callback(transport.subscribe("audit_log", AUDIT, self._take).close)

    def close(self) -> None:
        """Write what waits, and close the file; may be called twice."""
        self._end.close()

    def _take(self, received: Received[Log]) -> None:
        record = logging.makeLogRecord({"msg": line_of(received.message)})
        try:
            self._waiting.put_nowait(record)
        except queue.Full:  # the disk hangs
            return


def line_of(message: Log) -> str:
    """Return a message of the audit as a line, without a line break at its end."""
    time = datetime.datetime.fromtimestamp(to_seconds(message.stamp), datetime.UTC)
    stamp = time.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    return "\t".join(" ".join(part.split()) for part in (stamp, message.function, message.name, message.msg))


class _File(logging.handlers.RotatingFileHandler):
    def __init__(self, path: Path) -> None:
        self._has_failed = False
        super().__init__(path, maxBytes=_FILE_BYTES, backupCount=_OLD_FILES, encoding="utf-8", delay=True)

    def _open(self) -> TextIOWrapper:
        Path(self.baseFilename).parent.mkdir(parents=True, exist_ok=True)
        return super()._open()

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - called by logging
        """Log the first failure only."""
        if not self._has_failed:
            self._has_failed = True
            log.warning("the audit cannot be written to %s: %s", self.baseFilename, sys.exc_info()[1])
