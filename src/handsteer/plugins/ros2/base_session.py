"""This process as a node of a ROS 2 graph on any middleware: name, parameters, time and log."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from handsteer.clock import Clock, SimulatedClock, WallClock, to_seconds
from handsteer.errors import HandsteerError, TransportError
from handsteer.messages import CLOCK, ClockMessage, Log, Time, Topic
from handsteer.parameters import NodeParameters
from handsteer.plugins.ros2.arguments import parse_arguments
from handsteer.plugins.ros2.base_transport import WireTransport
from handsteer.plugins.ros2.names import NodeName, identify
from handsteer.plugins.ros2.parameter_services import PARAMETER_EVENTS, ParameterServices
from handsteer.transports.base import Publisher, Received, Session
from handsteer.transports.encoding import decode, encode, request_type
from handsteer.transports.timing import ClockMonitor, ClockTimes

_DELIVER_S = 0.2
_LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}
_WAITING = 100

log = logging.getLogger(__name__)

ROSOUT = Topic("/rosout", Log, latched=True, is_global=True, depth=1000, lifespan_s=10.0)
"""The log of all nodes; ``Log.level`` is 10, 20, 30, 40 or 50, as in Python."""


class RosoutHandler(logging.Handler):
    """Keeps the newest hundred log records until they are sent, so that logging never waits for the network.

    Args:
        node: Full name of the node, such as ``/r1/my_camera``; its logger is called ``r1.my_camera``.
        now: Returns the current ROS time.
    """

    def __init__(self, node: str, now: Callable[[], Time]) -> None:
        super().__init__()
        self._name = node.strip("/").replace("/", ".")
        self._now = now
        self._messages: deque[Log] = deque(maxlen=_WAITING)
        self._sending: int | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Keep ``record``, unless it is about the sending itself."""
        if self._sending == threading.get_ident():
            return
        try:
            self._messages.append(self._message(record))
        except Exception:
            self.handleError(record)

    def send(self, publish: Callable[[Log], None]) -> None:
        """Call ``publish`` for each record, and drop those it refuses. Must be called on one thread only."""
        self._sending = threading.get_ident()
        try:
            while self._messages:
                publish(self._messages.popleft())
        except HandsteerError:
            self._messages.clear()
        finally:
            self._sending = None

    def _message(self, record: logging.LogRecord) -> Log:
        return Log(
            stamp=self._now(),
            level=max((level for level in _LEVELS.values() if level <= record.levelno), default=_LEVELS["debug"]),
            name=self._name,
            msg=self.format(record),
            file=record.pathname,
            function=record.funcName or "",
            line=record.lineno,
        )


Connect = Callable[[NodeName, Clock], WireTransport]


class Ros2Session(Session):
    """A session of ROS 2, on any middleware but rclpy; only that has services of any type.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own: ``--ros-args -r topic:=other -r __node:=name -r __ns:=/r1 -p parameter:=value
            --params-file file.yaml``.
        connect: Joins the graph as the node of a name, on the graph's clock.

    Raises:
        TransportError: The graph cannot be joined, or an argument or one of ROS 2's environment variables is wrong.
    """

    def __init__(self, node: str, arguments: Sequence[str], connect: Connect) -> None:
        given = parse_arguments(arguments)
        name = identify(node, given.remaps)
        self.name = name.full
        self.parameters: dict[str, Any] = given.parameters(self.name)
        simulated = self._switch("use_sim_time", default=False)
        self._serves_parameters = self._switch("start_parameter_services", default=True)
        if given.log_level:
            logging.getLogger("handsteer").setLevel(_LEVELS[given.log_level])
        self.clock: Clock = SimulatedClock() if simulated else WallClock()
        self._rosout = RosoutHandler(self.name, self._stamp)
        self._logs: Publisher[Log] | None = None
        self._clock_monitor = ClockMonitor(self.clock)
        self._left = threading.Event()
        self.transport: WireTransport = connect(name, self.clock)
        try:
            self._logs = self._publish_logs() if given.rosout else None
            if isinstance(self.clock, SimulatedClock):
                self._follow(self.clock)
        except BaseException:  # including interrupts: open resources would keep the process from ending
            self.close()
            raise

    def serve(self, parameters: NodeParameters) -> None:
        """Serve ``ros2 param``, unless the parameter ``start_parameter_services`` is false."""
        if not self._serves_parameters:
            return
        simulated = isinstance(self.clock, SimulatedClock)
        parameters.add_fixed("use_sim_time", simulated, "Whether the node's time is that of /clock")
        parameters.add_fixed("start_parameter_services", True, "Whether others may see and set the parameters")
        events = self.transport.advertise(self.name, PARAMETER_EVENTS)
        for name, kind, answer in ParameterServices(self.name, parameters, self._stamp, events.publish).services:
            self.transport.serve(name, kind, partial(_respond, kind, answer))

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether this session has been closed.

        ROS 2 has no request to end a node.

        Raises:
            TransportError: The connection to the graph is lost for good.
        """
        self._clock_monitor.check()
        self.transport.check()
        self._send_logs()
        return self._left.wait(timeout_s)

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        if self._left.is_set():
            return
        self._left.set()
        logging.getLogger("handsteer").removeHandler(self._rosout)
        self._send_logs()
        self.transport.flush(_DELIVER_S)
        self.transport.close()

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
        times = ClockTimes()

        def tell(received: Received[ClockMessage]) -> None:
            stamp = received.message.clock
            if times.has(stamp.sec, stamp.nanosec):
                clock.tell(to_seconds(stamp))

        self.transport.subscribe("clock", CLOCK, tell)


def _respond(kind: str, answer: Callable[[Any], Any], request: bytes) -> bytes:
    return encode(answer(decode(request, request_type(kind))))
