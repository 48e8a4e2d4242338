"""Keeps the state of Stop for a control that restarts."""

from collections.abc import Callable

from handsteer.messages import STOP, STOPPED, Bool
from handsteer.nodes.node import Node
from handsteer.transports.base import Received


class StopKeeper:
    """A node's record of ``/stop``; it is published on ``/stopped``, latched, and updated from that of other nodes.

    Every node of the graph has one, so that a Stop survives the restart of any of them. Only false on ``/stop`` ends
    it.

    Args:
        on_stop: Called with true at a Stop, from either topic, and with false at a reset.
    """

    def __init__(self, node: Node, on_stop: Callable[[bool], None] | None = None) -> None:
        self._on_stop = on_stop
        self._is_stopped: bool | None = None
        self._stopped = node.publisher(STOPPED)
        # Several nodes publish at once: one's true must not be replaced by another's false.
        node.subscribe(STOPPED, self._on_word_of_others, key=lambda message: bool(message.data))
        node.subscribe(STOP, self._on_stop_or_reset)

    def _on_stop_or_reset(self, received: Received[Bool]) -> None:
        self._take(bool(received.message.data))

    def _on_word_of_others(self, received: Received[Bool]) -> None:
        # A node that missed a reset must not undo a Stop by its false; resets are accepted from /stop only.
        if received.message.data and not self._is_stopped:
            self._take(True)

    def _take(self, is_stopped: bool) -> None:
        is_news = is_stopped != self._is_stopped
        self._is_stopped = is_stopped
        if self._on_stop is not None:
            self._on_stop(is_stopped)
        if is_news:
            self._stopped.publish(Bool(data=is_stopped))
