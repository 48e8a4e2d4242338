"""The parameters of our nodes in rclpy, which serves ``ros2 param`` and calls back to validate changes."""

from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService
from rclpy.serialization import deserialize_message

from handsteer.errors import ConfigError
from handsteer.parameters import Description, NodeParameters, Value
from handsteer.transports.ros2.arguments import nested
from handsteer.transports.ros2.encoding import encode
from handsteer.transports.ros2.parameter_services import descriptor

_QOS = "qos_overrides."
_OF_ROS = ("use_sim_time", "start_type_description_service")
_TYPES = {
    "bool": Parameter.Type.BOOL,
    "integer": Parameter.Type.INTEGER,
    "double": Parameter.Type.DOUBLE,
    "string": Parameter.Type.STRING,
    "strings": Parameter.Type.STRING_ARRAY,
}
_SCALARS = (Parameter.Type.BOOL, Parameter.Type.INTEGER, Parameter.Type.DOUBLE)
_SWITCH = {True: "on", False: "off"}
_ARRAYS = tuple(kind for kind in Parameter.Type if kind.name.endswith("_ARRAY"))


def take_given(node: Node) -> dict[str, Any]:
    """Return the parameters given to a node at its start, nested at dots, without ROS 2's own.

    They are removed from the node, which declares its parameters later.
    """
    found = {name: given for name, given in node.get_parameters_by_prefix("").items() if not _is_of_ros(name)}
    for name in found:
        node.undeclare_parameter(name)
    return nested({name: _plain(given) for name, given in found.items()})


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
        self._services = ParameterService(node)

    def _declare(self, name: str, value: Value) -> None:
        description = self._parameters.describe(name)
        assert description is not None
        kind, theirs = _TYPES[description.kind], _descriptor(name, description)
        if description.removable:
            self._node.declare_parameter(name, value, theirs, ignore_override=True)
            return
        self._node.declare_parameter(name, kind, theirs, ignore_override=True)
        typed = float(value) if kind is Parameter.Type.DOUBLE else value  # type: ignore[arg-type]
        self._node.set_parameters([Parameter(name, kind, typed)])

    def _as_all_declared(self, given: list[Parameter]) -> list[Parameter]:
        """Return ``given`` with declared types: an empty list in YAML has no type, and ``off`` is not a text."""
        return [self._as_declared(one) for one in given]

    def _as_declared(self, one: Parameter) -> Parameter:
        description = self._parameters.describe(one.name)
        kind = None if description is None else _TYPES[description.kind]
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
            is_set = _is_of_ros(one.name) and self._node.has_parameter(one.name)
            if is_set and self._node.get_parameter(one.name).value != one.value:
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
