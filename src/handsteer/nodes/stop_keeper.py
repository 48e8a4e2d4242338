"""Remembers, for a control that starts anew, that the robot was stopped."""

from collections.abc import Callable

from handsteer.messages import STOP, STOPPED, Bool
from handsteer.nodes.node import Node
from handsteer.transports.protocol import Received


class StopKeeper:
    """What a node knows of ``/stop``; it says so on ``/stopped``, latched, and believes others who were stopped.

    Every node of the graph has one, so that a Stop outlives each of them. Only false on ``/stop`` ends it.

    Args:
        node: The node.
        on_stop: Is called with true at a Stop, however it was heard, and with false at a reset.
    """

    def __init__(self, node: Node, on_stop: Callable[[bool], None] | None = None) -> None:
        self._on_stop = on_stop
        self._is_stopped: bool | None = None
        self._stopped = node.publisher(STOPPED)
        # Several say so at once: that one of them was stopped must not be lost behind another's that was not.
        node.subscribe(STOPPED, self._on_word_of_others, key=lambda message: bool(message.data))
        node.subscribe(STOP, self._on_stop_or_reset)

    def _on_stop_or_reset(self, received: Received[Bool]) -> None:
        self._take(bool(received.message.data))

    def _on_word_of_others(self, received: Received[Bool]) -> None:
        # A reset that somebody has missed must not undo a Stop; one that we have missed is heard as /stop alone.
        if received.message.data and not self._is_stopped:
            self._take(True)

    def _take(self, is_stopped: bool) -> None:
        is_news = is_stopped != self._is_stopped
        self._is_stopped = is_stopped
        if self._on_stop is not None:
            self._on_stop(is_stopped)
        if is_news:
            self._stopped.publish(Bool(data=is_stopped))
