"""This process as a node of a ROS 2 graph on any middleware: name, parameters and time."""

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from handsteer.clock import Clock, SimulatedClock, WallClock, to_seconds
from handsteer.errors import TransportError
from handsteer.messages import CLOCK, Log, Time
from handsteer.parameters import NodeParameters
from handsteer.transports.protocol import Call, Publisher, Transport
from handsteer.transports.ros2.arguments import parse_arguments
from handsteer.transports.ros2.names import NodeName, identify
from handsteer.transports.ros2.parameter_services import PARAMETER_EVENTS, ParameterServices
from handsteer.transports.ros2.rosout import ROSOUT, RosoutHandler
from handsteer.transports.ros2.service_types import Service

_CLOCK_SILENCE_S = 2.0
_DELIVER_S = 0.2
_LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}

log = logging.getLogger(__name__)


class Ros2Transport(Transport, Protocol):
    """A transport that can be flushed."""

    def flush(self, timeout_s: float) -> None:
        """Wait until what was published is sent, for at most ``timeout_s`` seconds."""
        ...


class ServiceServer(Protocol):
    """Replies to the requests of a service."""

    def close(self) -> None:
        """Stop replying; may be called twice."""
        ...


class Ros2Session(ABC):
    """A :class:`~handsteer.transports.protocol.Session` of ROS 2; each middleware adds the abstract methods.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own: ``--ros-args -r topic:=other -r __node:=name -r __ns:=/r1 -p parameter:=value
            --params-file file.yaml``.

    Raises:
        TransportError: The graph cannot be joined, or an argument or one of ROS 2's environment variables is wrong.
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
        self.clock: Clock = SimulatedClock() if simulated else WallClock()
        self._servers: list[ServiceServer] = []
        self._rosout = RosoutHandler(self.name, self._stamp)
        self._logs: Publisher[Log] | None = None
        self._was_silent = False
        self._left = threading.Event()
        self.transport: Ros2Transport = self._connect(name, self.clock)
        try:
            self._logs = self._publish_logs() if said.rosout else None
            if isinstance(self.clock, SimulatedClock):
                self._follow(self.clock)
        except BaseException:  # including interrupts: open resources would keep the process from ending
            self.close()
            raise

    def serve(self, parameters: NodeParameters) -> None:
        """Serve ``ros2 param``, unless the parameter ``start_parameter_services`` is false."""
        if not self._answers:
            return
        simulated = isinstance(self.clock, SimulatedClock)
        parameters.add_fixed("use_sim_time", simulated, "Whether the node's time is that of /clock")
        parameters.add_fixed("start_parameter_services", True, "Whether others may see and set the parameters")
        events = self.transport.advertise(self.name, PARAMETER_EVENTS)
        answering = ParameterServices(self.name, parameters, self._stamp, events.publish)
        self._servers += [self._answer(*service) for service in answering.services]

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:  # noqa: B027 # one for all that lack them
        """Do nothing: only rclpy has services of any type."""

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether this session has been closed.

        ROS 2 has no request to end a node.
        """
        silent = isinstance(self.clock, SimulatedClock) and self.clock.silence_s > _CLOCK_SILENCE_S
        if silent and not self._was_silent:
            log.warning("use_sim_time is set, but /clock stands still: frames count as old, the robot stands")
        self._was_silent = silent
        self._send_logs()
        return self._left.wait(timeout_s)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        if self._left.is_set():
            return
        self._left.set()
        logging.getLogger("handsteer").removeHandler(self._rosout)
        for server in self._servers:
            server.close()
        self._send_logs()
        self.transport.flush(_DELIVER_S)
        self.transport.close()

    @abstractmethod
    def _connect(self, name: NodeName, clock: Clock) -> Ros2Transport:
        """Join the graph as the node of this name, on the graph's clock."""

    @abstractmethod
    def _answer(self, name: str, service: Service, answer: Callable[[Any], Any]) -> ServiceServer:
        """Serve the service of this full name; ``answer`` converts a request to a reply."""

    def _switch(self, name: str, *, default: bool) -> bool:
        value = self.parameters.pop(name, default)
        if not isinstance(value, bool):
            raise TransportError(f"parameter {name} is {value!r}: it should be true or false")
        return value

    def _stamp(self) -> Time:
        return self.clock.stamp(self.clock.now())

    def _publish_logs(self) -> Publisher[Log]:
        publisher = self.transport.advertise(self.name, ROSOUT)
        logging.getLogger("handsteer").addHandler(self._rosout)
        return publisher

    def _send_logs(self) -> None:
        if self._logs is not None:
            self._rosout.send(self._logs.publish)

    def _follow(self, clock: SimulatedClock) -> None:
        self.transport.subscribe("clock", CLOCK, lambda received: clock.tell(to_seconds(received.message.clock)))
