"""A transport within one process in which nodes can die as processes do."""

from collections.abc import Callable
from functools import partial
from typing import Any

from handsteer.messages import Topic
from handsteer.transports.base import Received
from handsteer.transports.in_process import TopicTypes, check_type

Deliver = Callable[[Received[Any]], None]


class Domain:
    """Carries messages among nodes; whoever is killed hears nothing more, and its latched messages go with it.

    So it is with ROS 2's transient local topics, which a writer keeps for late readers. The transport within one
    process keeps them for ever.
    """

    crosses_network = False
    is_one_machine = True

    def __init__(self) -> None:
        self._types = TopicTypes()
        self._readers: list[tuple[str, str, Deliver]] = []
        self._writers: list[_Writer] = []

    def advertise(self, node: str, topic: Topic[Any]) -> "_Writer":
        self._types.claim(topic.name, topic)
        writer = _Writer(self, node, topic)
        self._writers.append(writer)
        return writer

    def subscribe(self, node: str, topic: Topic[Any], deliver: Deliver) -> "_Reader":
        self._types.claim(topic.name, topic)
        entry = (node, topic.name, deliver)
        self._readers.append(entry)
        for writer in self._writers:
            if writer.topic.name == topic.name and writer.last is not None:
                deliver(writer.last)
        return _Reader(partial(self._forget, entry))

    def kill(self, node: str) -> None:
        """Let the node of this name be gone at once."""
        self._readers = [entry for entry in self._readers if entry[0] != node]
        for writer in self._writers:
            writer.is_dead = writer.is_dead or writer.node == node
        self._writers = [writer for writer in self._writers if not writer.is_dead]

    def readers(self, topic: str) -> list[Deliver]:
        return [deliver for _, name, deliver in self._readers if name == topic]

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        return [writer.node for writer in self._writers if writer.topic.name == topic.name]

    def topic_name(self, topic: Topic[Any]) -> str:
        return topic.name

    def full_name(self, node: str) -> str:
        return node

    def close(self) -> None:
        self._readers, self._writers = [], []

    def _forget(self, entry: tuple[str, str, Deliver]) -> None:
        self._readers = [known for known in self._readers if known is not entry]


class _Reader:
    def __init__(self, close: Callable[[], None]) -> None:
        self.close = close


class _Writer:
    def __init__(self, domain: Domain, node: str, topic: Topic[Any]) -> None:
        self.node = node
        self.topic = topic
        self.last: Received[Any] | None = None
        self.is_dead = False
        self._domain = domain

    @property
    def has_subscribers(self) -> bool:
        return bool(self._domain.readers(self.topic.name))

    def publish(self, message: Any, captured_s: float | None = None) -> None:
        check_type(self.topic, message)
        if self.is_dead:
            return
        received = Received(message, captured_s)
        if self.topic.latched:
            self.last = received
        for deliver in self._domain.readers(self.topic.name):
            deliver(received)
