"""This process as a node of rclpy: name, parameters, time, and the thread that spins it."""

import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.exceptions import NameValidationException
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleNodeMixin
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from handsteer.clock import Clock, SimulatedClock, WallClock
from handsteer.errors import ConfigError, HandsteerError, TransportError, as_name
from handsteer.messages import CLOCK
from handsteer.nodes.callbacks import FailureLog
from handsteer.parameters import Description, NodeParameters, Value
from handsteer.plugins.ros2.arguments import nested
from handsteer.plugins.ros2.parameter_services import TYPES, descriptor
from handsteer.plugins.ros2.topics import RclpyTransport, is_opening, ros_class
from handsteer.transports.base import Call, Managed, Session
from handsteer.transports.encoding import encode
from handsteer.transports.timing import ClockMonitor, ClockTimes

_DELIVER_S = 0.2
_LEAVE_S = 2.0
_AFTER_FAILURE_S = 0.05
_ANY_JUMP = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1))
_TRIGGER = "std_srvs/srv/Trigger"
_QOS = "qos_overrides."
_AUTOSTART = "autostart"
_OF_ROS = ("use_sim_time", "start_type_description_service", _AUTOSTART)
_SCALARS = (Parameter.Type.BOOL, Parameter.Type.INTEGER, Parameter.Type.DOUBLE)
_SWITCH = {True: "on", False: "off"}
_NUMBERS = frozenset(kind.value for kind in Parameter.Type)
_ARRAYS = tuple(kind for kind in Parameter.Type if kind.name.endswith("_ARRAY"))
# One function per level, because rclpy requires that a line of code always logs at the same level.
_LOG_AS: dict[int, Callable[[Any, str], None]] = {
    logging.CRITICAL: lambda logger, text: logger.fatal(text),
    logging.ERROR: lambda logger, text: logger.error(text),
    logging.WARNING: lambda logger, text: logger.warning(text),
    logging.INFO: lambda logger, text: logger.info(text),
    logging.NOTSET: lambda logger, text: logger.debug(text),
}

log = logging.getLogger(__name__)


class _RclpyHandler(logging.Handler):
    """Forwards log records to the logger of an rclpy node."""

    def __init__(self, logger: Any) -> None:
        super().__init__()
        self._logger = logger

    def emit(self, record: logging.LogRecord) -> None:
        try:
            level = next(level for level in _LOG_AS if record.levelno >= level)
            _LOG_AS[level](self._logger, self.format(record))
        except Exception:
            self.handleError(record)


@contextmanager
def _logging_by(logger: Any) -> Iterator[None]:
    """Forward log records of handsteer to a logger of rclpy, whose level is set by ``--log-level``."""
    ours = logging.getLogger("handsteer")
    before = (ours.handlers, ours.level, ours.propagate)
    ours.handlers = [_RclpyHandler(logger)]
    ours.setLevel(int(logger.get_effective_level()))
    ours.propagate = False  # rclpy shows them on the screen already
    try:
        yield
    finally:
        ours.handlers, level, ours.propagate = before
        ours.setLevel(level)


class RclpySession(Session):
    """A session of ROS 2, by a node of rclpy.

    rclpy itself provides ROS 2's common features of nodes: arguments and remapping, parameters and ``qos_overrides``,
    ``use_sim_time``, the log, ``get_type_description``.

    Args:
        node: Name of the node, unless ``arguments`` rename it.
        arguments: ROS 2's own, after ``--ros-args``.

    Raises:
        TransportError: An argument is wrong, or the middleware cannot be started.
    """

    def __init__(self, node: str, arguments: Sequence[str]) -> None:
        self._left = threading.Event()
        self._context = rclpy.Context()
        self._executor: SingleThreadedExecutor | None = None
        self._log = ExitStack()
        self._node = _make_node(self._context, node, arguments)
        try:
            self._log.enter_context(_logging_by(self._node.get_logger()))
            self.name: str = self._node.get_fully_qualified_name()
            self.parameters: dict[str, Any] = take_given(self._node)
            self.clock = self._make_clock()
            self._clock_monitor = ClockMonitor(self.clock)
            self.transport: RclpyTransport = RclpyTransport(self._node, self.clock)
            self._executor = SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self._node)
            self._thread = threading.Thread(target=self._spin, name="rclpy", daemon=True)
            self._thread.start()
        except BaseException:  # including interrupts: open resources would keep the process from ending
            self.close()
            raise

    def serve(self, parameters: NodeParameters) -> None:
        """Let rclpy serve ``ros2 param``."""
        self._parameters = ParameterLink(self._node, parameters)

    def manage(self, node: Managed) -> None:
        """Make this a managed node of ROS 2; it activates itself, unless the parameter ``autostart`` is false.

        Raises:
            TransportError: The parameter is not a boolean.
        """
        if not self._node.has_parameter(_AUTOSTART):
            self._node.declare_parameter(_AUTOSTART, True)
        starts = _switch(self._node, _AUTOSTART)
        node.is_active = starts
        self._node.manage(node)
        if starts:
            self._node.trigger_configure()
            self._node.trigger_activate()

    def offer(self, services: Callable[[], Mapping[str, Call]]) -> None:
        """Offer the node's services, as std_srvs/Trigger, if this ROS 2 has that package."""
        trigger = ros_class(_TRIGGER)
        if trigger is None:
            log.info("the node's services are left out: this ROS 2 lacks the package std_srvs")
            return
        for name, call in services().items():
            self._node.create_service(trigger, f"~/{name}", partial(_answer, call))

    def wait(self, timeout_s: float) -> bool:
        """Wait for at most ``timeout_s`` seconds; return whether rclpy has been shut down, or this session closed."""
        self._clock_monitor.check()
        if not self._left.is_set() and self._context.ok():
            self.transport.check()
        return self._left.wait(timeout_s) or not self._context.ok()

    def close(self) -> None:
        """Deliver what was published, then leave the graph; may be called twice."""
        if self._left.is_set():
            return
        self._left.set()
        if self._executor is not None:
            self.transport.flush(_DELIVER_S)
            self.transport.close()
            self._executor.shutdown()
            self._thread.join(_LEAVE_S)
        self._log.close()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def _make_clock(self) -> Clock:
        if not _switch(self._node, "use_sim_time"):
            return WallClock()
        simulated, theirs = SimulatedClock(), self._node.get_clock()
        # Referenced, because rclpy does not keep it.
        self._jumps = theirs.create_jump_callback(
            _ANY_JUMP, post_callback=lambda _: simulated.tell(theirs.now().nanoseconds / 1e9)
        )
        return simulated

    def _spin(self) -> None:
        executor = self._executor
        assert executor is not None
        failures = FailureLog(self.name)
        while not self._left.is_set():
            try:
                executor.spin_once()
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:
                if not self._left.is_set():
                    failures.add("ROS 2", error, time.monotonic())  # others may cause it, as often as they like
                    self._left.wait(_AFTER_FAILURE_S)  # repeated failures must not use up the processor


def _switch(node: Node, name: str) -> bool:
    value = node.get_parameter(name).value
    if not isinstance(value, bool):
        raise TransportError(f"ROS parameter {name}: {value!r} should be true or false")
    return value


def _answer(call: Call, _request: Any, reply: Any) -> Any:
    try:
        reply.message, reply.success = call(), True
    except HandsteerError as error:
        reply.message, reply.success = str(error), False
    return reply


def _tell(times: ClockTimes, tell: Callable[[Any], None], message: Any) -> None:
    if times.has(message.clock.sec, message.clock.nanosec):
        tell(message)


class LateManagedNode(LifecycleNodeMixin, Node):  # type: ignore[misc]
    """A node of rclpy that becomes a managed one only by :meth:`manage`, after its parameters are known."""

    emptied: frozenset[str] = frozenset()
    """Parameters that were given as an empty list at the start, for which rclpy knows no type."""

    def __init__(self, name: str, **options: Any) -> None:
        Node.__init__(self, name, **options)
        self._managed: Managed | None = None

    def declare_parameters(self, namespace: str, parameters: Any, ignore_override: bool = False) -> Any:
        """Declare all but empty lists, at which rclpy would not start, and remember these."""
        self.emptied |= {each[0] for each in parameters if len(each) > 1 and each[1] is None}
        known = [each for each in parameters if each[0] not in self.emptied]
        return super().declare_parameters(namespace, known, ignore_override)

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[[Any], None], *args: Any, **options: Any
    ) -> Any:
        """Subscribe to ``topic``; rclpy's own clock, which takes the times of ``/clock``, raises for what is none."""
        if topic == CLOCK.name:
            callback = partial(_tell, ClockTimes(), callback)
        return super().create_subscription(kind, topic, callback, *args, **options)

    def manage(self, node: Managed) -> None:
        """Offer the services of ``ros2 lifecycle``, which activate and deactivate ``node``."""
        self._managed = node
        LifecycleNodeMixin.__init__(self)
        self._wake_executor()

    def destroy_node(self) -> None:
        """Destroy the node, of which its state machine, which rclpy keeps, would hold a part in the graph."""
        super().destroy_node()
        if self._managed is not None:
            self._state_machine.destroy_when_not_in_use()

    # rclpy calls it by this name; without it, its own is called.
    def _LifecycleNodeMixin__on_change_state(self, request: Any, reply: Any) -> Any:  # noqa: N802
        """Answer also where the state has no such transition: rclpy raises then, and its client waits without end."""
        try:
            return LifecycleNodeMixin._LifecycleNodeMixin__on_change_state(self, request, reply)
        except RCLError as error:
            log.warning("a transition is refused: %s", " ".join(str(error).split()))
            reply.success = False
            return reply

    def on_activate(self, state: Any) -> Any:
        """Activate the node."""
        return self._set_active(True)

    def on_deactivate(self, state: Any) -> Any:
        """Deactivate the node, which has sent its last when this returns."""
        return self._set_active(False)

    def on_shutdown(self, state: Any) -> Any:
        """Deactivate the node for good; its process goes on until it is ended."""
        return self._set_active(False)

    def _set_active(self, is_active: bool) -> Any:
        assert self._managed is not None
        done = self._managed.set_active(is_active)
        return TransitionCallbackReturn.SUCCESS if done else TransitionCallbackReturn.FAILURE


def _make_node(context: Any, node: str, arguments: Sequence[str]) -> LateManagedNode:
    try:
        # Our handlers process the signals: the robot must be stopped before the middleware shuts down.
        rclpy.init(args=list(arguments), context=context, signal_handler_options=SignalHandlerOptions.NO)
        left_over = remove_ros_args(list(arguments))
        if left_over:
            raise TransportError(
                f"{left_over[0]!r} is not a valid argument of ROS 2: it should be as --ros-args "
                "-r image_raw:=camera/image -p fps:=15"
            )
        return LateManagedNode(
            node,
            context=context,
            start_parameter_services=False,
            allow_undeclared_parameters=True,
            automatically_declare_parameters_from_overrides=True,
        )
    except (RuntimeError, ValueError, NameValidationException) as error:
        context.try_shutdown()
        raise TransportError(f"cannot join ROS 2 as {node}: {' '.join(str(error).split())}") from None


def take_given(node: Node) -> dict[str, Any]:
    """Return the parameters given to a node at its start, nested at dots, without ROS 2's own.

    They are removed from the node, which declares its parameters later.
    """
    found = {name: given for name, given in node.get_parameters_by_prefix("").items() if not _is_of_ros(name)}
    for name in found:
        node.undeclare_parameter(name)
    values: dict[str, Any] = {name: _plain(given) for name, given in found.items()}
    if isinstance(node, LateManagedNode):
        values |= {name: [] for name in node.emptied}
        node.emptied = frozenset()  # they can be declared now, with a type
    return nested(values)


class _AnsweringParameterService(ParameterService):  # type: ignore[misc]
    """rclpy's services, which also answer a value of an unknown type: rclpy raises, and its client waits without end.

    rclpy calls both methods by these names; without them, its own are called.
    """

    def _set_parameters_callback(self, request: Any, reply: Any) -> Any:
        reply.results = [self._set(one) for one in request.parameters]
        return reply

    def _set_parameters_atomically_callback(self, request: Any, reply: Any) -> Any:
        refused = [one for one in request.parameters if one.value.type not in _NUMBERS]
        if refused:
            reply.result = _refusal(refused[0])
            return reply
        return super()._set_parameters_atomically_callback(request, reply)

    def _set(self, one: Any) -> Any:
        if one.value.type not in _NUMBERS:
            return _refusal(one)
        theirs = super()._set_parameters_callback(SetParameters.Request(parameters=[one]), SetParameters.Response())
        return theirs.results[0]


def _refusal(one: Any) -> SetParametersResult:
    reason = f"{as_name(one.name)}: {one.value.type} is not the number of a type of parameters"
    return SetParametersResult(successful=False, reason=reason)


class ParameterLink:
    """Declares parameters to rclpy, and applies changes by others.

    Args:
        node: The node, without parameters of its own.
    """

    def __init__(self, node: Node, parameters: NodeParameters) -> None:
        self._node = node
        self._parameters = parameters
        for name, value in parameters.values().items():
            self._declare(name, value)
        node.add_pre_set_parameters_callback(self._as_all_declared)
        node.add_on_set_parameters_callback(self._set)
        # Only now, because rclpy would accept values for parameters that are not declared yet.
        self._services = _AnsweringParameterService(node)

    def _declare(self, name: str, value: Value) -> None:
        description = self._parameters.describe(name)
        assert description is not None
        kind, theirs = Parameter.Type(TYPES[description.kind]), _descriptor(name, description)
        if description.removable:
            self._node.declare_parameter(name, value, theirs, ignore_override=True)
            return
        self._node.declare_parameter(name, kind, theirs, ignore_override=True)
        typed = float(value) if kind is Parameter.Type.DOUBLE else value  # type: ignore[arg-type]
        self._node.set_parameters([Parameter(name, kind, typed)])

    def _as_all_declared(self, given: list[Parameter]) -> list[Parameter]:
        """Return ``given`` with declared names and types.

        A value set by an old name would not be reported by the new one; an empty list in YAML has no type, and ``off``
        is not a text.
        """
        named = [Parameter(self._parameters.new_name(one.name), one.type_, one.value) for one in given]
        return [self._as_declared(one) for one in named]

    def _as_declared(self, one: Parameter) -> Parameter:
        description = self._parameters.describe(one.name)
        kind = None if description is None else Parameter.Type(TYPES[description.kind])
        if kind is Parameter.Type.DOUBLE and one.type_ is Parameter.Type.INTEGER:
            return Parameter(one.name, kind, float(one.value))
        if kind is Parameter.Type.STRING_ARRAY and one.type_ in _ARRAYS and len(one.value) == 0:
            return Parameter(one.name, kind, [])
        if kind is Parameter.Type.STRING and one.type_ in _SCALARS:
            text = _SWITCH[one.value] if one.type_ is Parameter.Type.BOOL else str(one.value)
            return Parameter(one.name, kind, text)
        return one

    def _set(self, given: Sequence[Parameter]) -> SetParametersResult:
        try:
            self._refuse_ros_own(given)
            self._parameters.set({one.name: _plain(one) for one in given if not _is_of_ros(one.name)})
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _refuse_ros_own(self, given: Sequence[Parameter]) -> None:
        for one in given:
            if not _is_of_ros(one.name):
                continue
            is_set = self._node.has_parameter(one.name)
            is_late = one.name.startswith(_QOS) and not is_opening()
            if self._node.get_parameter(one.name).value != one.value if is_set else is_late:
                raise ConfigError(f"{one.name} cannot be set: it is only read when the node starts")


def _is_of_ros(name: str) -> bool:
    return name in _OF_ROS or name.startswith(_QOS)


def _plain(parameter: Parameter) -> Any:
    return list(parameter.value) if parameter.type_ in _ARRAYS else parameter.value


def _descriptor(name: str, description: Description) -> ParameterDescriptor:
    theirs = deserialize_message(encode(descriptor(name, description)), ParameterDescriptor)
    # rclpy would refuse even the current value, which `ros2 param load` sets.
    theirs.read_only = False
    theirs.dynamic_typing = description.removable  # rclpy does not undeclare parameters of a static type
    return theirs
