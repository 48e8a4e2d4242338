"""This process as a node of a ROS 2 graph over Zenoh."""

import os
from collections.abc import Sequence

from handsteer.clock import Clock
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.session import Ros2Session
from handsteer.transports.zenoh.member import Member
from handsteer.transports.zenoh.network import network
from handsteer.transports.zenoh.transport import ZenohTransport


class ZenohSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over Zenoh.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own, as :class:`~handsteer.transports.ros2.session.Ros2Session` has them.

    Raises:
        TransportError: The network cannot be joined, or an argument or one of the environment variables is wrong.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        super().__init__(node, arguments, self._connect)

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether this session has been closed."""
        self._member.watch_router()
        return super().wait(timeout_s)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        super().close()
        self._member.close()

    def _connect(self, name: NodeName, clock: Clock) -> ZenohTransport:
        self._member = Member(network(os.environ), name)
        return ZenohTransport(self._member, clock)
