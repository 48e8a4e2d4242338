"""What every transport offers: topics to publish to and to subscribe to."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

from handsteer.clock import Clock
from handsteer.messages import Topic
from handsteer.parameters import NodeParameters

M = TypeVar("M")
M_contra = TypeVar("M_contra", contravariant=True)


@dataclass(frozen=True)
class Received(Generic[M]):
    """A message as a subscriber gets it.

    Attributes:
        message: The message; it is shared with other subscribers, so it is not to be changed.
        captured_s: When the frame that led to this message was captured, in seconds of the graph's clock; None when
            there was no frame, or when the transport cannot carry it.
        is_late: Whether it was held up on its way for longer than messages of its topic live: of these only those
            come that stop the robot (``Topic.stops``), and they show nothing of what is wanted now.
        by_player: Whether a player of recordings sent it; False when the transport cannot tell.
    """

    message: M
    captured_s: float | None = None
    is_late: bool = False
    by_player: bool = False


Call = Callable[[], str]
"""What a service does, at once, on any thread: it returns a sentence, or raises a HandsteerError that says why not."""


class Publisher(Protocol[M_contra]):
    """The sending end of a topic."""

    @property
    def has_subscribers(self) -> bool:
        """Whether anybody listens: what is made on demand is made only then."""
        ...

    def publish(self, message: M_contra, captured_s: float | None = None) -> None:
        """Send ``message`` to whoever listens; returns at once, whatever they do.

        Raises:
            TransportError: The message is of another type than the topic.
        """
        ...


class Subscription(Protocol):
    """The receiving end of a topic."""

    def close(self) -> None:
        """Receive no more; may be called twice."""
        ...


class Transport(Protocol):
    """Carries messages between nodes.

    ``deliver`` is called on a thread of the transport's choice and must return at once: nodes put the message into
    an inbox that keeps the newest only (:class:`handsteer.nodes.node.Node`).
    """

    @property
    def crosses_network(self) -> bool:
        """Whether it may carry messages to other machines, so that large ones had better be small."""
        ...

    def advertise(self, node: str, topic: Topic[M]) -> Publisher[M]:
        """Return the sending end of ``topic`` for the node named ``node``.

        Raises:
            TransportError: The topic is in use with another type.
        """
        ...

    def subscribe(self, node: str, topic: Topic[M], deliver: Callable[[Received[M]], None]) -> Subscription:
        """Call ``deliver`` for each message on ``topic`` from now on; a latched topic gives its last one at once.

        Raises:
            TransportError: The topic is in use with another type.
        """
        ...

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the names of the nodes that publish ``topic`` now, as far as they are known; returns at once.

        Each publisher counts: a node that has two is there twice, and so are two nodes of one name. Those of other
        processes may be known late, and are missed for some seconds when they were killed.
        """
        ...

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return what others know ``topic`` by: its full name, with namespace and remapping."""
        ...

    def full_name(self, node: str) -> str:
        """Return what others know the node named ``node`` by: ``process: node`` where it has a process of its own."""
        ...

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        ...


@runtime_checkable
class TellsTypes(Protocol):
    """What a transport has, beside the rest, whose graph tells the types of others' subscribers."""

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``, as ``geometry_msgs/msg/Twist``, at once.

        There is none that could be followed while something else in this process has the topic, too.
        """
        ...

    def withdraw(self, publisher: Any) -> None:
        """End a sending end of this transport, once what it sent has arrived: its topic may have another type then."""
        ...


class Session(Protocol):
    """A process's membership in a graph of several processes.

    Attributes:
        name: Full name of the process in the graph, namespaces included, as ``/r1/my_camera``.
        parameters: What the graph's own parameter service has set for this process, as it was at the start.
        clock: The graph's time.
        transport: Carries the graph's messages.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def parameters(self) -> Mapping[str, Any]: ...  # noqa: D102

    @property
    def clock(self) -> Clock: ...  # noqa: D102

    @property
    def transport(self) -> Transport: ...  # noqa: D102

    def serve(self, parameters: NodeParameters) -> None:
        """Let others see and set the parameters of this process's node, where the graph has a way to do so."""
        ...

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:
        """Let others call the services ``~/name`` of this process's node, where the graph can have them so.

        Args:
            services: Returns the services by name; not asked where the graph has none.
        """
        ...

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether the graph has asked this process to end.

        Raises:
            TransportError: The graph is gone.
        """
        ...

    def close(self) -> None:
        """Deliver what was published, then leave; may be called twice."""
        ...
