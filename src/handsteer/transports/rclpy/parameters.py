"""The parameters of our nodes in rclpy, which serves ``ros2 param`` and calls back to validate changes."""

from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

from handsteer.errors import ConfigError
from handsteer.parameters import Description, NodeParameters, Value
from handsteer.transports.ros2.arguments import nested

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
        node.add_pre_set_parameters_callback(self._as_meant)
        node.add_on_set_parameters_callback(self._set)
        # Only now, because rclpy would accept values for parameters that are not declared yet.
        self._services = ParameterService(node)

    def _declare(self, name: str, value: Value) -> None:
        description = self._parameters.describe(name)
        assert description is not None
        descriptor = _descriptor(description)
        kind = _TYPES[description.kind]
        if description.removable:  # rclpy does not undeclare parameters of a static type
            descriptor.dynamic_typing = True
            self._node.declare_parameter(name, value, descriptor, ignore_override=True)
            return
        self._node.declare_parameter(name, kind, descriptor, ignore_override=True)
        typed = float(value) if kind is Parameter.Type.DOUBLE else value  # type: ignore[arg-type]
        self._node.set_parameters([Parameter(name, kind, typed)])

    def _as_meant(self, wanted: list[Parameter]) -> list[Parameter]:
        """Return ``wanted`` with declared types: an empty list in YAML has no type, and ``off`` is not a text."""
        return [self._as_declared(one) for one in wanted]

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

    def _set(self, wanted: Sequence[Parameter]) -> SetParametersResult:
        try:
            self._refuse_ros_own(wanted)
            self._parameters.set({one.name: _plain(one) for one in wanted if not _is_of_ros(one.name)})
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _refuse_ros_own(self, wanted: Sequence[Parameter]) -> None:
        for one in wanted:
            is_set = _is_of_ros(one.name) and self._node.has_parameter(one.name)
            if is_set and self._node.get_parameter(one.name).value != one.value:
                raise ConfigError(f"{one.name} cannot be set: it is only read when the node starts")


def _is_of_ros(name: str) -> bool:
    return name in _OF_ROS or name.startswith(_QOS)


def _plain(parameter: Parameter) -> Any:
    return list(parameter.value) if parameter.type_ in _ARRAYS else parameter.value


def _descriptor(description: Description) -> ParameterDescriptor:
    low, high = description.minimum, description.maximum
    # Not read-only for rclpy, which would refuse even the current value, which `ros2 param load` sets.
    constraints = [text for text in (description.constraint, description.why_fixed) if text]
    descriptor = ParameterDescriptor(description=description.text, additional_constraints="; ".join(constraints))
    if description.kind == "double" and low is not None and high is not None:
        descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)]
    elif description.kind == "integer" and low is not None:
        highest = 2**63 - 1 if high is None else int(high)
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=highest, step=1)]
    return descriptor
