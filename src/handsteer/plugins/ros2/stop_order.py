"""The order in which a Stop and a reset were sent, whenever they arrive."""

import math

from handsteer.transports.timing import StaleMessageFilter


class StopOrder:
    """Detects a reset that was sent before the Stop that it would end: a cut link has held it back.

    The times of sending are compared by when messages without delay would have arrived.
    """

    def __init__(self) -> None:
        self._delays = StaleMessageFilter(0.0)
        self._stopped_by, self._stopped_s = b"", -math.inf

    def is_overtaken(self, sender: bytes, sent_s: float, arrived_s: float, *, stops: bool) -> bool:
        """Return whether a message must not end the Stop; False for one that stops.

        Args:
            sender: Identifies the sender, whose own messages arrive in order.
            sent_s: Time of sending, in seconds of any clock of the sender.
            arrived_s: Time of arrival, in seconds of a local monotonic clock.
            stops: Whether the message stops the robot.
        """
        prompt_s = arrived_s - (self._delays.delay_s(sender, sent_s, arrived_s) or 0.0)
        if stops and prompt_s > self._stopped_s:
            self._stopped_by, self._stopped_s = sender, prompt_s
        return not stops and sender != self._stopped_by and prompt_s < self._stopped_s
