"""Detects and reports that more than one node publishes a command topic."""

import logging
from collections.abc import Callable, Sequence
from typing import Any

from handsteer.messages import Topic
from handsteer.nodes.node import Node
from handsteer.transports.base import UNNAMED, many_publishers

log = logging.getLogger(__name__)

_PERIOD_S = 1.0
# A restarting node appears twice for a moment, and names arrive up to three seconds late.
_LOOKS, _LOOKS_FOR_NAMES = 2, 4

Look = Callable[[], Sequence[str]]


class Rivals:
    """Checks the publishers of command topics once a second.

    Args:
        node: The node that runs the check, on its thread and transport.
        topics: Topics that must have only one publisher.
        elsewhere: Further topics by name, of another graph; each value returns the nodes that publish there.

    Attributes:
        warning: The problem in one sentence; empty if there is none.
    """

    def __init__(self, node: Node, topics: Sequence[Topic[Any]], elsewhere: dict[str, Look] | None = None) -> None:
        self.warning = ""
        self._node = node
        self._looks: dict[str, Look] = {node.transport.topic_name(topic): self._look_at(topic) for topic in topics}
        self._looks |= elsewhere or {}
        self._seen: dict[str, int] = {}
        self._said: set[str] = set()
        node.every(_PERIOD_S, self._look)

    def _look_at(self, topic: Topic[Any]) -> Look:
        return lambda: self._node.transport.publishers_of(topic)

    def _look(self) -> None:
        warnings = [warning for name, look in self._looks.items() if (warning := self._amiss(name, look()))]
        for warning in warnings:
            if warning not in self._said:
                log.warning("%s: %s", self._node.name, warning)
        self._said = set(warnings)
        self.warning = "; ".join(warnings)

    def _amiss(self, topic: str, publishers: Sequence[str]) -> str:
        if len(publishers) < 2:
            self._seen.pop(topic, None)
            return ""
        self._seen[topic] = self._seen.get(topic, 0) + 1
        is_sure = self._seen[topic] >= (_LOOKS_FOR_NAMES if UNNAMED in publishers else _LOOKS)
        return many_publishers(topic, publishers) if is_sure else ""
