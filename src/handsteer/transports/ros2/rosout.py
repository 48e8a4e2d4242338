"""Publishes this process's log on ROS 2's ``/rosout``, for rqt_console and ``ros2 topic echo``."""

import logging
import threading
from collections import deque
from collections.abc import Callable

from handsteer.errors import HandsteerError
from handsteer.messages import Log, Time, Topic

ROSOUT = Topic("/rosout", Log, latched=True, is_global=True, depth=1000, lifespan_s=10.0)
"""The log of all nodes; ``Log.level`` is 10, 20, 30, 40 or 50, as in Python."""

_WAITING = 100
_LEVELS = (10, 20, 30, 40, 50)


class RosoutHandler(logging.Handler):
    """Keeps the newest hundred log records until they are sent, so that logging never waits for the network.

    Args:
        node: Full name of the node, such as ``/r1/my_camera``; its logger is called ``r1.my_camera``.
        now: Returns the current ROS time.
    """

    def __init__(self, node: str, now: Callable[[], Time]) -> None:
        super().__init__()
        self._name = node.strip("/").replace("/", ".")
        self._now = now
        self._messages: deque[Log] = deque(maxlen=_WAITING)
        self._sending: int | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Keep ``record``, unless it is about the sending itself."""
        if self._sending == threading.get_ident():
            return
        try:
            self._messages.append(self._message(record))
        except Exception:
            self.handleError(record)

    def send(self, publish: Callable[[Log], None]) -> None:
        """Call ``publish`` for each record, and drop those it refuses. Must be called on one thread only."""
        self._sending = threading.get_ident()
        try:
            while self._messages:
                publish(self._messages.popleft())
        except HandsteerError:
            self._messages.clear()
        finally:
            self._sending = None

    def _message(self, record: logging.LogRecord) -> Log:
        return Log(
            stamp=self._now(),
            level=max((level for level in _LEVELS if level <= record.levelno), default=_LEVELS[0]),
            name=self._name,
            msg=self.format(record),
            file=record.pathname,
            function=record.funcName or "",
            line=record.lineno,
        )
