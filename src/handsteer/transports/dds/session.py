"""This process as a node of a ROS 2 graph over DDS: name, parameters and time."""

import logging
import os
import threading
from collections.abc import Sequence
from typing import Any

from handsteer.clock import Clock, SimulatedClock, WallClock, to_seconds
from handsteer.errors import TransportError
from handsteer.messages import CLOCK, Time
from handsteer.parameters import NodeParameters
from handsteer.transports.dds.network import network
from handsteer.transports.dds.participant import Participant
from handsteer.transports.dds.services import ServiceServer
from handsteer.transports.dds.transport import DdsTransport
from handsteer.transports.ros2.arguments import parse_arguments
from handsteer.transports.ros2.names import identify
from handsteer.transports.ros2.parameter_services import PARAMETER_EVENTS, ParameterServices
from handsteer.transports.ros2.rosout import ROSOUT, RosoutHandler

_CLOCK_SILENCE_S = 2.0
_DELIVER_S = 0.2
_LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}

log = logging.getLogger(__name__)


class DdsSession:
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2, over DDS.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own: ``--ros-args -r topic:=other -r __node:=name -r __ns:=/r1 -p parameter:=value
            --params-file file.yaml``.

    Raises:
        TransportError: The domain cannot be joined, or an argument or one of ROS 2's environment variables is wrong.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        said = parse_arguments(arguments)
        name = identify(node, said.remaps)
        self.name = name.full
        self.parameters: dict[str, Any] = said.parameters(self.name)
        simulated = self._switch("use_sim_time", default=False)
        self._answers = self._switch("start_parameter_services", default=True)
        if said.log_level:
            logging.getLogger("handsteer").setLevel(_LEVELS[said.log_level])
        self._participant = Participant(network(os.environ), name)
        self.clock: Clock = SimulatedClock() if simulated else WallClock()
        self.transport = DdsTransport(self._participant, self.clock)
        self._servers: list[ServiceServer] = []
        self._rosout = RosoutHandler(self.name, self._stamp)
        if said.rosout:
            self._publish_logs()
        if isinstance(self.clock, SimulatedClock):
            self._follow(self.clock)
        self._was_silent = False
        self._left = threading.Event()

    def serve(self, parameters: NodeParameters) -> None:
        """Answer ``ros2 param``, unless the parameter ``start_parameter_services`` is false."""
        if not self._answers:
            return
        simulated = isinstance(self.clock, SimulatedClock)
        parameters.add_fixed("use_sim_time", simulated, "Whether the node's time is that of /clock")
        parameters.add_fixed("start_parameter_services", True, "Whether others may see and set the parameters")
        events = self.transport.advertise(self.name, PARAMETER_EVENTS)
        answering = ParameterServices(self.name, parameters, self._stamp, events.publish)
        self._servers += [ServiceServer(self._participant, *service) for service in answering.services]

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether this session has been closed.

        ROS 2 itself asks no node to end.
        """
        silent = isinstance(self.clock, SimulatedClock) and self.clock.silence_s > _CLOCK_SILENCE_S
        if silent and not self._was_silent:
            log.warning("use_sim_time is set, but /clock stands still: frames count as old, the robot stands")
        self._was_silent = silent
        return self._left.wait(timeout_s)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        if self._left.is_set():
            return
        self._left.set()
        logging.getLogger("handsteer").removeHandler(self._rosout)
        for server in self._servers:
            server.close()
        self.transport.flush(_DELIVER_S)
        self.transport.close()
        self._participant.close()

    def _switch(self, name: str, *, default: bool) -> bool:
        value = self.parameters.pop(name, default)
        if not isinstance(value, bool):
            raise TransportError(f"parameter {name} is {value!r}: it should be true or false")
        return value

    def _stamp(self) -> Time:
        return self.clock.stamp(self.clock.now())

    def _publish_logs(self) -> None:
        publisher = self.transport.advertise(self.name, ROSOUT)
        self._participant.tick(lambda: self._rosout.send(publisher.publish))
        logging.getLogger("handsteer").addHandler(self._rosout)

    def _follow(self, clock: SimulatedClock) -> None:
        self.transport.subscribe("clock", CLOCK, lambda received: clock.tell(to_seconds(received.message.clock)))
