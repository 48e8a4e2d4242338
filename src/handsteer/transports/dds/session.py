"""This process as a node of a ROS 2 graph over DDS."""

import os
from collections.abc import Sequence

from handsteer.clock import Clock
from handsteer.transports.dds.network import network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.transport import DdsTransport
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.session import Ros2Session


class DdsSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over DDS.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own, as :class:`~handsteer.transports.ros2.session.Ros2Session` has them.

    Raises:
        TransportError: The domain cannot be joined, or an argument or one of ROS 2's environment variables is wrong.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        super().__init__(node, arguments, self._connect)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        super().close()
        self._participant.close()

    def _connect(self, name: NodeName, clock: Clock) -> DdsTransport:
        self._participant = Participant(network(os.environ), name)
        return DdsTransport(self._participant, clock)
