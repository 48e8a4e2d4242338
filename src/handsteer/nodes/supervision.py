"""Attached to nodes: keeping the state of Stop, and reporting topics that several nodes publish."""

import logging
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from handsteer.messages import STOP, STOPPED, Bool, Topic
from handsteer.nodes.base import Node
from handsteer.timeouts import HEAR_STOP_S
from handsteer.transports.base import UNNAMED, Received, many_publishers

log = logging.getLogger(__name__)

_PERIOD_S = 1.0
# A restarting node appears twice for a moment, and names arrive up to three seconds late.
_LOOKS, _LOOKS_FOR_NAMES = 2, 4

Look = Callable[[], Sequence[str]]


class StopKeeper:
    """A node's record of ``/stop``; it is published on ``/stopped``, latched, and updated from that of other nodes.

    Every node of the graph has one, so that a Stop survives the restart of any of them. Only false on ``/stop`` ends
    it. A node publishes that there is no Stop once it knows: from another one, or because none was reported for
    :data:`~handsteer.timeouts.HEAR_STOP_S`.

    Args:
        on_stop: Called with true at a Stop, from either topic, and with false at a reset.
    """

    def __init__(self, node: Node, on_stop: Callable[[bool], None] | None = None) -> None:
        self._on_stop = on_stop
        self._node = node
        self._waits_until_s = node.clock.now() + HEAR_STOP_S
        self._is_stopped: bool | None = None
        self._stopped = node.publisher(STOPPED)
        node.every(HEAR_STOP_S, self._settle).delay_until(self._waits_until_s)
        # Several nodes publish at once: one's true must not be replaced by another's false.
        node.subscribe(STOPPED, self._on_word_of_others, key=lambda message: bool(message.data))
        node.subscribe(STOP, lambda received: self._take(bool(received.message.data)))

    @property
    def waits_for_others(self) -> bool:
        """Whether other nodes publish ``/stopped``, and this one may not have received it since its start.

        Its own publisher is one of them: where none is known, the transport has not heard of any yet.
        """
        if self._node.clock.now() >= self._waits_until_s:
            return False
        return len(self._node.transport.publishers_of(STOPPED)) != 1

    def _on_word_of_others(self, received: Received[Bool]) -> None:
        self._waits_until_s = -math.inf
        # A node that missed a reset must not undo a Stop by its false; resets are accepted from /stop only.
        if received.message.data and not self._is_stopped:
            self._take(True)
        elif self._is_stopped is None:
            self._settle()

    def _settle(self) -> None:
        """Publish that there is no Stop, if none was reported since the start."""
        if self._is_stopped is None:
            self._is_stopped = False
            self._stopped.publish(Bool(data=False))

    def _take(self, is_stopped: bool) -> None:
        is_news = is_stopped != self._is_stopped
        self._is_stopped, self._waits_until_s = is_stopped, -math.inf
        if self._on_stop is not None:
            self._on_stop(is_stopped)
        if is_news:
            self._stopped.publish(Bool(data=is_stopped))


class Rivals:
    """Checks once a second that each of some topics has one publisher only.

    Args:
        node: The node that runs the check, on its thread and transport.
        topics: Topics that must have only one publisher.
        elsewhere: Further topics by name, of another graph; each value returns the nodes that publish there.
        explain: Returns the warning about a topic and its publishers.

    Attributes:
        warning: The problem in one sentence; empty if there is none.
    """

    def __init__(
        self,
        node: Node,
        topics: Sequence[Topic[Any]],
        elsewhere: dict[str, Look] | None = None,
        explain: Callable[[str, Sequence[str]], str] = many_publishers,
    ) -> None:
        self.warning = ""
        self._explain = explain
        self._node = node
        self._looks: dict[str, Look] = {
            node.transport.topic_name(topic): partial(node.transport.publishers_of, topic) for topic in topics
        }
        self._looks |= elsewhere or {}
        self._seen: dict[str, int] = {}
        self._logged: set[str] = set()
        node.every(_PERIOD_S, self._look)

    def _look(self) -> None:
        warnings = [warning for name, look in self._looks.items() if (warning := self._problem(name, look()))]
        for warning in warnings:
            if warning not in self._logged:
                log.warning("%s: %s", self._node.name, warning)
        self._logged = set(warnings)
        self.warning = "; ".join(warnings)

    def _problem(self, topic: str, publishers: Sequence[str]) -> str:
        if len(publishers) < 2:
            self._seen.pop(topic, None)
            return ""
        self._seen[topic] = self._seen.get(topic, 0) + 1
        is_sure = self._seen[topic] >= (_LOOKS_FOR_NAMES if UNNAMED in publishers else _LOOKS)
        return self._explain(topic, publishers) if is_sure else ""
