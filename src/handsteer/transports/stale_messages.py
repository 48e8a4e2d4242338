"""Detects messages that were delayed: a link that was interrupted delivers old ones when it recovers."""

from collections import OrderedDict

from handsteer.clock import ClockWatch

# A sender's clock that is set back by a second is trusted again after a minute and a half; delays are shorter.
_LEAK = 0.01
_SENDERS = 32


class StaleMessageFilter:
    """Detects late messages from clocks that may not be synchronized.

    The smallest difference of arrival and sending times so far is the offset of the clocks plus the shortest delay; a
    message that exceeds it by more than the limit is late. If a clock was set, the new offset is used after a second
    (:class:`~handsteer.clock.ClockWatch`). It remembers the last 32 senders.

    Args:
        limit_s: Maximum additional delay of a message, in seconds.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._least: OrderedDict[bytes, tuple[float, float, ClockWatch]] = OrderedDict()

    def is_late(self, sender: bytes, sent_s: float, arrived_s: float) -> bool:
        """Return whether a message was delayed for too long; a sender's first one never was.

        Args:
            sender: Identifies the sender.
            sent_s: Time of sending, in seconds of any clock of the sender.
            arrived_s: Time of arrival, in seconds of a local monotonic clock.
        """
        by_stamp_s = arrived_s - sent_s
        least_s, noted_s, watch = self._least.pop(sender, (by_stamp_s, arrived_s, ClockWatch(in_step=False)))
        apart_s = watch.corrected(by_stamp_s, arrived_s)
        if apart_s is not None:
            least_s = min(apart_s, least_s + _LEAK * (arrived_s - noted_s))
        self._least[sender] = (least_s, arrived_s, watch)
        if len(self._least) > _SENDERS:
            self._least.popitem(last=False)
        return apart_s is None or apart_s - least_s > self._limit_s
