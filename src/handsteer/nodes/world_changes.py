"""Changes of a robot's world, asked for on any thread and made on the robot's own."""

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future

from handsteer.errors import WorldError

_MOST_WAITING = 16


class WorldChanges:
    """What is asked of a robot's world until the robot has time for it; :meth:`ask` may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: deque[tuple[Callable[[], None], Future[None]]] = deque()

    def ask(self, change: Callable[[], None]) -> Future[None]:
        """Return what becomes of ``change``: done, or the :class:`WorldError` that refuses it."""
        future: Future[None] = Future()
        with self._lock:
            if len(self._waiting) >= _MOST_WAITING:
                future.set_exception(WorldError("too many changes wait already: the robot is busy or has ended"))
            else:
                self._waiting.append((change, future))
        return future

    def make(self) -> bool:
        """Make all that wait, in their order, on this thread; return whether there were any."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for change, future in waiting:
            if future.set_running_or_notify_cancel():
                try:
                    change()
                except WorldError as error:
                    future.set_exception(error)
                except Exception as error:
                    future.set_exception(error)
                    raise
                else:
                    future.set_result(None)
        return bool(waiting)
