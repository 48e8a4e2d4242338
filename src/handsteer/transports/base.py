"""The interfaces of transports, which publish and subscribe to topics, and of sessions, which join a graph."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

from handsteer.clock import Clock
from handsteer.messages import Topic
from handsteer.parameters import NodeParameters

M = TypeVar("M")
M_contra = TypeVar("M_contra", contravariant=True)

UNNAMED = "a node without a name"
"""Name of a node that was not announced, for its publishers and subscribers."""


def many_publishers(topic: str, publishers: Sequence[str]) -> str:
    """Return a warning about a command topic that has several ``publishers``."""
    return (
        f"{topic} has {len(publishers)} publishers ({', '.join(publishers)}), and a robot "
        "obeys all of them in turn: end all but one, or give each a topic of its own by remapping"
    )


@dataclass(frozen=True)
class Received(Generic[M]):
    """A message as a subscriber gets it.

    Attributes:
        message: The message; it is shared with other subscribers and must not be changed.
        captured_s: Capture time of the frame that led to it, in seconds of the graph's clock; None if there was no
            frame, or if the transport cannot carry it.
        is_late: Whether it was delayed by more than its topic's lifespan. Only late messages that stop the robot
            (``Topic.stops``) are delivered.
        by_player: Whether a player of recordings sent it; False if the transport does not know.
        number: Its number among the topic's messages, from 1; 0 if the transport does not count them.
    """

    message: M
    captured_s: float | None = None
    is_late: bool = False
    by_player: bool = False
    number: int = field(default=0, compare=False)


Deliver = Callable[[Received[M]], None]
Call = Callable[[], str]
"""A service call: returns a sentence at once, on any thread, or raises a HandsteerError with the reason."""


class Publisher(Protocol[M_contra]):
    """Publisher of a topic."""

    @property
    def has_subscribers(self) -> bool:
        """Whether there are subscribers; messages on demand are computed only then."""
        ...

    def publish(self, message: M_contra, captured_s: float | None = None) -> None:
        """Send ``message`` to all subscribers; never waits for them.

        Raises:
            TransportError: The message is of another type than the topic.
        """
        ...


class Subscription(Protocol):
    """A subscription to a topic."""

    def close(self) -> None:
        """End the subscription; may be called twice."""
        ...


class Transport(Protocol):
    """Carries messages between nodes.

    ``deliver`` is called on a thread of the transport's choice and must return at once: nodes put the message into an
    inbox that keeps the newest only (:class:`handsteer.nodes.base.Node`).
    """

    @property
    def crosses_network(self) -> bool:
        """Whether it may carry messages to other machines, so that compressed images are preferable."""
        ...

    @property
    def is_one_machine(self) -> bool:
        """Whether all nodes are certainly on this machine, so that they share a clock."""
        ...

    def advertise(self, node: str, topic: Topic[M]) -> Publisher[M]:
        """Return a publisher of ``topic`` for the node named ``node``.

        Raises:
            TransportError: The topic is in use with another type.
        """
        ...

    def subscribe(self, node: str, topic: Topic[M], deliver: Deliver[M]) -> Subscription:
        """Call ``deliver`` for each message on ``topic`` from now on; a latched topic delivers its last one at once.

        Raises:
            TransportError: The topic is in use with another type.
        """
        ...

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        """Return the name of the node of each publisher of ``topic``, as far as they are known; returns at once.

        Nodes of other processes may appear late, and may remain for some seconds after they were killed.
        """
        ...

    def topic_name(self, topic: Topic[Any]) -> str:
        """Return the full name of ``topic`` in the graph, with namespace and remapping."""
        ...

    def full_name(self, node: str) -> str:
        """Return the full name of the node ``node`` in the graph: ``process: node`` if it has a process of its own."""
        ...

    def close(self) -> None:
        """End all publishing and receiving; may be called twice."""
        ...


@runtime_checkable
class KnowsTypes(Protocol):
    """Additional methods of a transport that knows the types of other processes' subscribers."""

    def subscribed_types(self, topic: Topic[Any]) -> set[str]:
        """Return the types of other processes' subscribers of ``topic``, as ``geometry_msgs/msg/Twist``, at once.

        Empty while this process uses the topic elsewhere too, so that its type cannot change.
        """
        ...

    def withdraw(self, publisher: Any) -> None:
        """Close a publisher of this transport once its messages have arrived; the topic may then have another type."""
        ...


class Managed(Protocol):
    """A node that a graph with managed nodes activates and deactivates."""

    is_active: bool

    def set_active(self, is_active: bool) -> bool:
        """Activate or deactivate it, before this returns; return whether that has happened."""
        ...


class Session(ABC):
    """A process's membership in a graph of several processes.

    Attributes:
        name: Full name of the process in the graph, with namespace, such as ``/r1/my_camera``.
        parameters: Parameters of this process from the graph's own parameter service, as of the start.
        clock: The graph's time.
        transport: Carries the graph's messages.
    """

    name: str
    parameters: Mapping[str, Any]
    clock: Clock
    transport: Transport

    def serve(self, parameters: NodeParameters) -> None:  # noqa: B027 - ROS 1 does not
        """Let others get and set the parameters of this process's node, if the graph supports it."""

    def manage(self, node: Managed) -> None:  # noqa: B027 - only rclpy does
        """Let others activate and deactivate this process's node, which has not started, if the graph supports it."""

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:  # noqa: B027 - only ROS's own libraries do
        """Offer the services ``~/name`` of this process's node, if the graph supports it.

        Args:
            services: Returns the services by name; not called if the graph does not support services.
        """

    @abstractmethod
    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether the graph has asked this process to end.

        Raises:
            TransportError: The graph is gone.
        """

    @abstractmethod
    def close(self) -> None:
        """Deliver what was published, then leave; may be called twice."""
