"""What this process logs, as ROS 2's ``/rosout`` has it, so that rqt_console and ``ros2 topic echo`` show it."""

import logging
import threading
from collections import deque
from collections.abc import Callable

from handsteer.errors import HandsteerError
from handsteer.messages import Log, Time, Topic

ROSOUT = Topic("/rosout", Log, latched=True, is_global=True, depth=1000, lifespan_s=10.0)
"""What all nodes log; ``Log.level`` is 10, 20, 30, 40 or 50, as in Python."""

_WAITING = 100
_LEVELS = (10, 20, 30, 40, 50)


class RosoutHandler(logging.Handler):
    """Keeps what is logged, the newest hundred records, until it is sent: logging never waits for the network.

    Args:
        node: Full name of the node, as ``/r1/my_camera``; its logger is called ``r1.my_camera``.
        now: Returns the time as ROS has it.
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
        """Give ``publish`` what was kept; what it refuses is dropped. To be called on one thread only."""
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
