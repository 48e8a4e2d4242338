"""Messages within one process, passed by reference on the publisher's thread."""

import threading
import weakref
from typing import Any, Generic, TypeVar

from handsteer.messages import Topic
from handsteer.transports.channels import Deliver, Fanout, FanoutSubscription, TopicTypes, check_type
from handsteer.transports.protocol import Received

M = TypeVar("M")


class InProcessTransport:
    """A :class:`~handsteer.transports.protocol.Transport` for the nodes of one process."""

    crosses_network = False

    def __init__(self) -> None:
        self._types = TopicTypes()
        self._lock = threading.Lock()
        self._fanouts: dict[str, Fanout[Any]] = {}
        self._publishers: weakref.WeakSet[InProcessPublisher[Any]] = weakref.WeakSet()

    def advertise(self, node: str, topic: Topic[M]) -> "InProcessPublisher[M]":
        """Return a publisher of ``topic`` for the node named ``node``."""
        publisher = InProcessPublisher(topic, self._fanout(topic), node)
        with self._lock:
            self._publishers.add(publisher)
        return publisher

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> FanoutSubscription[M]:
        """Call ``deliver`` for each message on ``topic`` from now on, on the publisher's thread."""
        return self._fanout(topic).add(deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the names of the nodes that have a publisher of ``topic``."""
        with self._lock:
            return sorted(publisher.node for publisher in self._publishers if publisher.topic == topic.name)

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return its name."""
        return topic.name

    def full_name(self, node: str) -> str:
        """Return ``node``."""
        return node

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        with self._lock:
            fanouts, self._fanouts = self._fanouts, {}
            self._publishers.clear()
        for fanout in fanouts.values():
            fanout.close()

    def _fanout(self, topic: Topic[M]) -> Fanout[M]:
        self._types.claim(topic.name, topic)
        with self._lock:
            return self._fanouts.setdefault(topic.name, Fanout(latched=topic.latched))


class InProcessPublisher(Generic[M]):
    """Publisher of a topic.

    Attributes:
        node: Name of its node.
        topic: Name of the topic.
    """

    def __init__(self, topic: Topic[M], fanout: Fanout[M], node: str) -> None:
        self.node = node
        self.topic = topic.name
        self._topic = topic
        self._fanout = fanout

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers."""
        return self._fanout.has_subscribers

    def publish(self, message: M, captured_s: float | None = None) -> None:
        """Deliver ``message`` to every subscriber's inbox."""
        check_type(self._topic, message)
        self._fanout.send(Received(message, captured_s))
