"""Which messages were held up on their way: a link that stood still brings old ones when it goes on."""

from collections import OrderedDict

# A sender's clock that is set back by a second is trusted again after a minute and a half; a delay lasts less.
_LEAK = 0.01
_SENDERS = 32


class Lateness:
    """Tells late messages from others, though clocks may not be in step.

    What a sender's clock and ours are apart, with the shortest time on the way, is the least that arrival and sending
    were ever apart; whatever comes later than that allows is late. It knows the last 32 senders.

    Args:
        limit_s: How late a message may come, in seconds.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._least: OrderedDict[bytes, tuple[float, float]] = OrderedDict()

    def is_late(self, sender: bytes, sent_s: float, arrived_s: float) -> bool:
        """Return whether a message has been on its way for too long; a sender's first one has not.

        Args:
            sender: Who sent it.
            sent_s: When, in seconds of any clock of the sender's.
            arrived_s: When it came, in seconds of a monotonic clock of ours.
        """
        apart_s = arrived_s - sent_s
        least_s, noted_s = self._least.pop(sender, (apart_s, arrived_s))
        least_s = min(apart_s, least_s + _LEAK * (arrived_s - noted_s))
        self._least[sender] = (least_s, arrived_s)
        if len(self._least) > _SENDERS:
            self._least.popitem(last=False)
        return apart_s - least_s > self._limit_s
