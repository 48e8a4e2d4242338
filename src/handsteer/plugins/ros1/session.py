"""This process as a node of a ROS 1 graph: name, parameters, time, and detection of a lost master."""

import logging
import math
import re
import sys
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import yaml

from handsteer.clock import Clock, SimulatedClock, WallClock
from handsteer.errors import HandsteerError, TransportError, quoted
from handsteer.transports.base import Call, Session

try:
    import rosgraph
    import rospy
    from rosgraph_msgs.msg import Clock as ClockMessage
except ImportError as problem:
    raise TransportError(
        f"ROS 1 is not installed for this Python ({problem}): on Debian and Ubuntu, `make ros1` installs it"
    ) from None

from handsteer.plugins.ros1 import course
from handsteer.plugins.ros1.last_stop import LastStop
from handsteer.plugins.ros1.master import Lifeline, Master, MasterGone
from handsteer.plugins.ros1.topics import Ros1Transport
from handsteer.transports.timing import ClockMonitor, ClockTimes

log = logging.getLogger(__name__)

# The end of the master is detected at once; this finds a lost machine, and costs as much as a hundred signs a minute.
_PING_PERIOD_S = 2.0
_PING_IN_DOUBT_S = 0.5
_PING_AGAIN_S = 0.02
# A master that replies slowly is busy, which is not a reason to stop a robot.
_PINGS_UNTIL_LOST = 3
_SILENT_UNTIL_LOST_S = 1.5
# rospy sends on its own threads and does not report when they are done.
_DELIVER_S = 0.1
_LEAVE_TIMEOUT_S = 2.0
_NAMES = {"__name": re.compile(r"[A-Za-z]\w*", re.ASCII), "__ns": re.compile(r"/?|/?[A-Za-z]\w*(/\w+)*/?", re.ASCII)}


class Ros1Session(Session):
    """A session of ROS 1, where nodes read their parameters at the start. rospy allows one name per process.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: rospy's own: ``topic:=other``, ``__name:=``, ``__ns:=``, ``_parameter:=value``, ``__log:=``. rospy
            takes ``__ns:=`` from the arguments of the program itself.

    Raises:
        TransportError: No master replies, an argument is not one of rospy's, or this process has another name already.
        ConfigError: One of the course's parameters has a wrong value.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        _refuse_what_rospy_would_ignore(arguments)
        uri = rosgraph.get_master_uri()
        self._master = Master(uri)
        self._master_pid = self._master.ping()
        self._lifeline = Lifeline(uri)
        self._failures, self._failing_since_s = 0, math.inf
        self._asked_to_end = threading.Event()
        self._lost: str | None = None
        self._left = threading.Event()
        _initialise(node, arguments)
        self.name: str = rospy.get_name()
        translated = course.translate(
            node, self.name, rospy.get_param("~", {}), lambda name: rospy.get_param(name, None)
        )
        self.parameters: dict[str, Any] = translated.parameters
        rospy.on_shutdown(self._on_shutdown)
        self.clock = self._make_clock()
        self._last_stop = LastStop(uri, self.name)
        was_stopped = self._last_stop.take()
        if was_stopped:
            log.warning("the robot was stopped when this node lost its master: it stays stopped until it is reset")
        self.transport: Ros1Transport = Ros1Transport(self.clock, translated.topics, was_stopped=was_stopped)
        self._watcher = threading.Thread(target=self._watch, name="ros1_session", daemon=True)
        self._watcher.start()

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:
        """Offer the node's services, as std_srvs/Trigger, if this ROS has that package."""
        try:
            from std_srvs.srv import Trigger  # noqa: PLC0415 - it may be missing
        except ImportError:
            log.info("the node's services are left out: this ROS lacks the package std_srvs")
            return
        for name, call in services().items():
            rospy.Service(f"~{name}", Trigger, partial(_answer, call))

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether ROS has asked this process to end (`rosnode kill`).

        Raises:
            TransportError: The master no longer replies.
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
        if self._lost and self.transport.is_stopped:
            self._last_stop.keep()
        self.transport.close()
        self._left.set()
        rospy.signal_shutdown("the node has ended")

    def _make_clock(self) -> Clock:
        if not rospy.get_param("/use_sim_time", False):
            return WallClock()
        clock, times = SimulatedClock(), ClockTimes()

        def tell(message: Any) -> None:
            if times.has(message.clock.secs, message.clock.nsecs):
                clock.tell(message.clock.to_sec())

        rospy.Subscriber("/clock", ClockMessage, tell, queue_size=1)
        return clock

    def _watch(self) -> None:
        clock_monitor = ClockMonitor(self.clock)
        while not self._left.is_set():
            if not self._lifeline.wait(_PING_IN_DOUBT_S if self._failures else _PING_PERIOD_S):
                self._left.wait(_PING_AGAIN_S)  # no continuous requests if the master drops the connection
            self._lost = self._why_lost()
            if self._lost is not None:
                self._asked_to_end.set()
                return
            clock_monitor.check()

    def _why_lost(self) -> str | None:
        """Return why the master is lost; None while it replies, or may only be busy."""
        try:
            if self._master.ping() == self._master_pid:
                self._failures, self._failing_since_s = 0, math.inf
                return None
        except MasterGone as error:
            return f"{error}: it has gone away, so this node ends"
        except TransportError as error:
            now_s = time.monotonic()
            self._failures, self._failing_since_s = self._failures + 1, min(self._failing_since_s, now_s)
            lasted = now_s - self._failing_since_s >= _SILENT_UNTIL_LOST_S
            return f"{error}: this node ends" if lasted and self._failures >= _PINGS_UNTIL_LOST else None
        return "another ROS master has taken the place of the one that this node joined, and does not know it: it ends"

    def _on_shutdown(self) -> None:
        """Delay rospy's shutdown, by `rosnode kill` or a node of this name, until the nodes have sent their last."""
        self._asked_to_end.set()
        self._left.wait(_LEAVE_TIMEOUT_S)


def _refuse_what_rospy_would_ignore(arguments: Sequence[str]) -> None:
    for argument in arguments:
        if ":=" not in argument[1:]:
            raise TransportError(
                f"{argument!r} is not a valid argument of ROS: it should be as name:=value, __ns:=r1, _fps:=15"
            )
        name, _, value = argument.partition(":=")
        pattern = _NAMES.get(name, course.TOPIC_NAME if not name.startswith("_") else None)
        if pattern is not None and not pattern.fullmatch(value):
            raise TransportError(
                f"{quoted(value)}, for {quoted(name)}, is not a valid name of ROS: use letters, digits and _"
            )
        if name.startswith("_") and not name.startswith("__"):
            _check_parameter(name, value)


def _check_parameter(name: str, value: str) -> None:
    """Refuse a value that the master cannot keep, as XML-RPC has no such: null, a date, a large whole number."""
    try:
        xmlrpc.client.dumps((yaml.safe_load(value),))
    except (TypeError, OverflowError) as error:
        raise TransportError(f"{quoted(value)}, for {quoted(name)}, is not a valid value of ROS 1: {error}") from None
    except (yaml.YAMLError, ValueError):
        return  # rospy names it


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
    # As with any ROS node, the log goes to the screen, to the log file and to /rosout.
    ours = logging.getLogger("handsteer")
    ours.handlers = list(logging.getLogger("rosout").handlers)


def _answer(call: Call, _request: Any) -> tuple[bool, str]:
    """Return ``success`` and ``message`` of the response."""
    try:
        return True, call()
    except HandsteerError as error:
        return False, str(error)
