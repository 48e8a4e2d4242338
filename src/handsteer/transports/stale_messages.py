"""Which messages were held up on their way: a link that stood still brings old ones when it goes on."""

from collections import OrderedDict

from handsteer.clock import ClockWatch

# A sender's clock that is set back by a second is trusted again after a minute and a half; a delay lasts less.
_LEAK = 0.01
_SENDERS = 32


class StaleMessageFilter:
    """Tells late messages from others, though clocks may not be in step.

    What a sender's clock and ours are apart, with the shortest time on the way, is the least that arrival and sending
    were ever apart; whatever comes later than that allows is late. A clock that was set while messages came is followed
    after a second (:class:`~handsteer.clock.ClockWatch`). It knows the last 32 senders.

    Args:
        limit_s: How late a message may come, in seconds.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._least: OrderedDict[bytes, tuple[float, float, ClockWatch]] = OrderedDict()

    def is_late(self, sender: bytes, sent_s: float, arrived_s: float) -> bool:
        """Return whether a message has been on its way for too long; a sender's first one has not.

        Args:
            sender: Who sent it.
            sent_s: When, in seconds of any clock of the sender's.
            arrived_s: When it came, in seconds of a monotonic clock of ours.
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
