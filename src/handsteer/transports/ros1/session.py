"""This process as a node of a ROS 1 graph: name, parameters, time, and what becomes of it when the master is gone."""

import logging
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from handsteer.clock import Clock, SimulatedClock, WallClock
from handsteer.errors import TransportError
from handsteer.parameters import NodeParameters
from handsteer.transports.protocol import Call

try:
    import rosgraph
    import rospy
    from rosgraph_msgs.msg import Clock as ClockMessage
except ImportError as problem:
    raise TransportError(
        f"ROS 1 is not installed for this Python ({problem}): on Debian and Ubuntu, `make ros1` installs it"
    ) from None

from handsteer.transports.ros1.master import Master
from handsteer.transports.ros1.transport import Ros1Transport

_PING_PERIOD_S = 0.5
_PINGS_UNTIL_LOST = 3
_CLOCK_SILENCE_S = 2.0
# rospy sends on threads of its own and does not tell when they are done.
_DELIVER_S = 0.1
_LEAVE_TIMEOUT_S = 2.0

log = logging.getLogger(__name__)


class Ros1Session:
    """A :class:`~handsteer.transports.protocol.Session` of ROS 1. rospy allows one name a process.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: rospy's own: ``topic:=other``, ``__name:=``, ``__ns:=``, ``_parameter:=value``, ``__log:=``. rospy
            looks for ``__ns:=`` in the arguments of the program itself.

    Raises:
        TransportError: No master answers, an argument is none of rospy's, or this process has another name already.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        _refuse_what_rospy_would_ignore(arguments)
        self._master = Master(rosgraph.get_master_uri())
        self._master.ping()
        self._asked_to_end = threading.Event()
        self._lost: str | None = None
        self._left = threading.Event()
        _initialise(node, arguments)
        rospy.on_shutdown(self._on_shutdown)
        self.name: str = rospy.get_name()
        self.parameters: dict[str, Any] = rospy.get_param("~", {})
        self.clock = self._make_clock()
        self.transport = Ros1Transport(self.clock)
        self._watcher = threading.Thread(target=self._watch, name="ros1_session", daemon=True)
        self._watcher.start()

    def serve(self, parameters: NodeParameters) -> None:
        """Do nothing: ROS 1 has its parameters on the master, and nodes read them when they start."""

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:
        """Do nothing: the nodes of the course have no services."""

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether ROS has asked this process to end (`rosnode kill`).

        Raises:
            TransportError: The master does not answer any more.
        """
        ended = self._asked_to_end.wait(timeout_s)
        if self._lost:
            raise TransportError(self._lost)
        return ended

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        if self._left.is_set():
            return
        self._left.wait(_DELIVER_S)
        self.transport.close()
        self._left.set()
        rospy.signal_shutdown("the node has ended")

    def _make_clock(self) -> Clock:
        if not rospy.get_param("/use_sim_time", False):
            return WallClock()
        clock = SimulatedClock()
        rospy.Subscriber("/clock", ClockMessage, lambda message: clock.tell(message.clock.to_sec()), queue_size=1)
        return clock

    def _watch(self) -> None:
        failures, was_silent = 0, False
        while not self._left.wait(_PING_PERIOD_S):
            try:
                self._master.ping()
                failures = 0
            except TransportError as error:
                failures += 1
                if failures == _PINGS_UNTIL_LOST:
                    self._lost = f"{error}: it has gone away, so this node ends"
                    self._asked_to_end.set()
            silent = isinstance(self.clock, SimulatedClock) and self.clock.silence_s > _CLOCK_SILENCE_S
            if silent and not was_silent:
                log.warning("/use_sim_time is set, but /clock stands still: frames count as old, the robot stands")
            was_silent = silent

    def _on_shutdown(self) -> None:
        """Hold rospy's shutdown up until the nodes have said their last: `rosnode kill`, or another of this name."""
        self._asked_to_end.set()
        self._left.wait(_LEAVE_TIMEOUT_S)


def _refuse_what_rospy_would_ignore(arguments: Sequence[str]) -> None:
    for argument in arguments:
        if ":=" not in argument[1:]:
            raise TransportError(f"{argument!r} is no argument of ROS: it should be as name:=value, __ns:=r1, _fps:=15")


def _initialise(node: str, arguments: Sequence[str]) -> None:
    if rospy.core.is_initialized() and rospy.get_name().rpartition("/")[2] != node:
        raise TransportError(
            f"this process is the ROS node {rospy.get_name()} already, and rospy allows one a process: "
            f"start {node} in a process of its own"
        )
    try:
        rospy.init_node(node, [sys.argv[0], *arguments], disable_signals=True)
    except (rospy.ROSException, ValueError, OSError) as error:
        raise TransportError(f"cannot join ROS 1 as {node}: {error}") from None
    # As with any ROS node: what is logged goes to the screen, to the log file and to /rosout.
    ours = logging.getLogger("handsteer")
    ours.handlers = list(logging.getLogger("rosout").handlers)
