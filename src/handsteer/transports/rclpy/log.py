"""What handsteer logs, as any node of ROS 2 does it: on the screen, in the log file and on ``/rosout``, by rclpy."""

import logging
from typing import Any

_OURS = "handsteer"


class RosLog:
    """Hands what handsteer logs to the logger of a node of rclpy, until it is closed.

    Args:
        logger: The node's logger; it says how much is logged, as ``--log-level`` has set it.
    """

    def __init__(self, logger: Any) -> None:
        ours = logging.getLogger(_OURS)
        self._before = (ours.handlers, ours.level, ours.propagate)
        ours.handlers = [_Handler(logger)]
        ours.setLevel(int(logger.get_effective_level()))
        # What rclpy has shown on the screen need not be there twice.
        ours.propagate = False

    def close(self) -> None:
        """Log as before; may be called twice."""
        ours = logging.getLogger(_OURS)
        ours.handlers, level, ours.propagate = self._before
        ours.setLevel(level)


class _Handler(logging.Handler):
    def __init__(self, logger: Any) -> None:
        super().__init__()
        self._logger = logger

    def emit(self, record: logging.LogRecord) -> None:
        try:
            _log(self._logger, record.levelno, self.format(record))
        except Exception:
            self.handleError(record)


def _log(logger: Any, level: int, text: str) -> None:
    # rclpy takes each line of a program for a statement that has always the same level.
    if level >= logging.CRITICAL:
        logger.fatal(text)
    elif level >= logging.ERROR:
        logger.error(text)
    elif level >= logging.WARNING:
        logger.warning(text)
    elif level >= logging.INFO:
        logger.info(text)
    else:
        logger.debug(text)
