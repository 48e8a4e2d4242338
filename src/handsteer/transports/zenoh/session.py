"""This process as a node of a ROS 2 graph over Zenoh."""

import os
from collections.abc import Callable
from typing import Any

from handsteer.clock import Clock
from handsteer.transports.ros2.names import NodeName
from handsteer.transports.ros2.service_types import Service
from handsteer.transports.ros2.session import Ros2Session
from handsteer.transports.zenoh.member import Member
from handsteer.transports.zenoh.network import network
from handsteer.transports.zenoh.services import ServiceServer
from handsteer.transports.zenoh.transport import ZenohTransport


class ZenohSession(Ros2Session):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over Zenoh."""

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

    def _answer(self, name: str, service: Service, answer: Callable[[Any], Any]) -> ServiceServer:
        return ServiceServer(self._member, name, service, answer)
