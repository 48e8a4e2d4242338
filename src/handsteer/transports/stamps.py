"""The capture time of the frame behind a message, from its header."""

from typing import Any

from handsteer.clock import Clock
from handsteer.messages import Time

_NO_STAMP = Time(sec=0, nanosec=0)


def capture_time(message: Any, clock: Clock) -> float | None:
    """Return the stamp of ``message``, in seconds of ``clock``; None if it has no header or no stamp.

    It is in the future if another machine's clock is ahead of ours.
    """
    header = getattr(message, "header", None)
    if header is None or header.stamp == _NO_STAMP:
        return None
    return clock.time_of(header.stamp)
