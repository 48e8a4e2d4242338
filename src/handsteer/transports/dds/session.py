"""This process as a node of a ROS 2 graph over DDS."""

import os
from collections.abc import Callable
from typing import Any

from handsteer.clock import Clock
from handsteer.transports.dds.network import network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.services import ServiceServer
from handsteer.transports.dds.transport import DdsTransport
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.service_types import Service
from handsteer.transports.ros2.session import Ros2Session


class DdsSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over DDS."""

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        super().close()
        self._participant.close()

    def _connect(self, name: NodeName, clock: Clock) -> DdsTransport:
        self._participant = Participant(network(os.environ), name)
        return DdsTransport(self._participant, clock)

    def _answer(self, name: str, service: Service, answer: Callable[[Any], Any]) -> ServiceServer:
        return ServiceServer(self._participant, name, service, answer)
