"""The parameter services of a ROS 2 node, for ``ros2 param``: functions from a request to a reply.

The rules are those of rclcpp's and rclpy's own parameter services: a request for several values with an unknown one
gets an empty list; ``set_parameters`` sets one at a time, ``set_parameters_atomically`` all or none. Types are strict,
but an integer is accepted for a double, as on the command line.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from handsteer.errors import ConfigError
from handsteer.messages import ParameterEvent, Time, Topic
from handsteer.parameters import Description, NodeParameters, Value
from handsteer.transports.encoding import reply_type, types

PARAMETER_EVENTS = Topic("/parameter_events", ParameterEvent, is_global=True, depth=1000)
"""Changes of all nodes' parameters."""

NOT_SET = 0
TYPES = {"bool": 1, "integer": 2, "double": 3, "string": 4, "strings": 9}
"""Numbers of ``rcl_interfaces/msg/ParameterType``, by our names of types."""
_FIELDS = {1: "bool_value", 2: "integer_value", 3: "double_value", 4: "string_value", 9: "string_array_value"}
_ARRAYS = ("byte_array_value", "bool_array_value", "integer_array_value", "double_array_value", "string_array_value")
_EMPTY = dict(zip((5, 6, 7, 8, 9), _ARRAYS, strict=True))
_MESSAGES, _SERVICES = "rcl_interfaces/msg", "rcl_interfaces/srv"


class ParameterServices:
    """The services of one node.

    Args:
        node: Full name of the node, such as ``/r1/hand_sign_control``.
        parameters: Its parameters.
        now: Returns the current ROS time.
        publish: Publishes an event on :data:`PARAMETER_EVENTS` after each change.
    """

    def __init__(
        self,
        node: str,
        parameters: NodeParameters,
        now: Callable[[], Time],
        publish: Callable[[ParameterEvent], None],
    ) -> None:
        self._node = node
        self._parameters = parameters
        self._now = now
        self._publish = publish

    @property
    def services(self) -> list[tuple[str, str, Callable[[Any], Any]]]:
        """Full name, type, and the function from a request to a reply, of each service."""
        return [
            (f"{self._node}/list_parameters", f"{_SERVICES}/ListParameters", self._list),
            (f"{self._node}/get_parameters", f"{_SERVICES}/GetParameters", self._get),
            (f"{self._node}/get_parameter_types", f"{_SERVICES}/GetParameterTypes", self._get_types),
            (f"{self._node}/describe_parameters", f"{_SERVICES}/DescribeParameters", self._describe),
            (f"{self._node}/set_parameters", f"{_SERVICES}/SetParameters", self._set),
            (f"{self._node}/set_parameters_atomically", f"{_SERVICES}/SetParametersAtomically", self._set_atomically),
        ]

    def _list(self, request: Any) -> Any:
        names, prefixes = list_names(self._parameters.values(), request.prefixes, request.depth)
        return _reply("ListParameters", result=_message("ListParametersResult", names=names, prefixes=prefixes))

    def _get(self, request: Any) -> Any:
        values = self._parameters.values()
        known = all(name in values for name in request.names)
        found = [_value(self._kind(name), values[name]) for name in request.names] if known else []
        return _reply("GetParameters", values=found)

    def _get_types(self, request: Any) -> Any:
        descriptions = self._descriptions(request.names)
        return _reply("GetParameterTypes", types=np.array([TYPES[each.kind] for each in descriptions], np.uint8))

    def _describe(self, request: Any) -> Any:
        descriptions = self._descriptions(request.names)
        descriptors = [descriptor(name, each) for name, each in zip(request.names, descriptions, strict=False)]
        return _reply("DescribeParameters", descriptors=descriptors)

    def _set(self, request: Any) -> Any:
        return _reply("SetParameters", results=[self._change([one]) for one in request.parameters])

    def _set_atomically(self, request: Any) -> Any:
        return _reply("SetParametersAtomically", result=self._change(request.parameters))

    def _change(self, parameters: Sequence[Any]) -> Any:
        before = self._parameters.values()
        try:
            self._parameters.set({one.name: _read(one) for one in parameters})
        except ConfigError as error:
            return _message("SetParametersResult", successful=False, reason=str(error))
        self._publish(self._event(before, parameters))
        return _message("SetParametersResult", successful=True, reason="")

    def _event(self, before: dict[str, Value], parameters: Sequence[Any]) -> ParameterEvent:
        after = self._parameters.values()
        kept = [self._parameter(one.name, after[one.name]) for one in parameters if one.name in after]
        return ParameterEvent(
            stamp=self._now(),
            node=self._node,
            new_parameters=[one for one in kept if one.name not in before],
            changed_parameters=[one for one in kept if one.name in before],
            deleted_parameters=[one for one in parameters if one.name in before and one.name not in after],
        )

    def _parameter(self, name: str, value: Value) -> Any:
        return _message("Parameter", name=name, value=_value(self._kind(name), value))

    def _kind(self, name: str) -> str:
        description = self._parameters.describe(name)
        return "string" if description is None else description.kind

    def _descriptions(self, names: Iterable[str]) -> list[Description]:
        found = [self._parameters.describe(name) for name in names]
        known = [description for description in found if description is not None]
        return known if len(known) == len(found) else []


def list_names(names: Iterable[str], prefixes: Sequence[str], depth: int) -> tuple[list[str], list[str]]:
    """Return the names for a ``list_parameters`` request, and their prefixes.

    Args:
        names: All names, in parts separated by dots.
        prefixes: Return only names below these, or equal to one; empty for all.
        depth: Maximum number of parts of a name below its prefix; 0 for no limit.
    """

    def shallow(name: str) -> bool:
        return depth == 0 or name.count(".") < depth

    def below(name: str, prefix: str) -> bool:
        return name == prefix or (name.startswith(f"{prefix}.") and shallow(name[len(prefix) + 1 :]))

    found = [name for name in names if (any(below(name, prefix) for prefix in prefixes) if prefixes else shallow(name))]
    return found, list(dict.fromkeys(name.rpartition(".")[0] for name in found if "." in name))


def _read(parameter: Any) -> Any:
    """Return the value of a ``Parameter``; None if it is not set.

    Raises:
        ConfigError: It is an array of numbers, which no parameter has.
    """
    kind = parameter.value.type
    if kind == NOT_SET:
        return None
    if kind in _EMPTY and not len(getattr(parameter.value, _EMPTY[kind])):
        return []  # an empty list in a file has no known element type
    if kind not in _FIELDS:
        raise ConfigError(f"{parameter.name}: a list of numbers should be a single value")
    value = getattr(parameter.value, _FIELDS[kind])
    return list(value) if kind == TYPES["strings"] else value


def _value(kind: str, value: Value) -> Any:
    fields: dict[str, Any] = {"bool_value": False, "integer_value": 0, "double_value": 0.0, "string_value": ""}
    fields |= {name: [] for name in _ARRAYS}
    fields |= {"byte_array_value": np.zeros(0, np.uint8), "bool_array_value": np.zeros(0, np.bool_)}
    fields |= {"integer_array_value": np.zeros(0, np.int64), "double_array_value": np.zeros(0, np.float64)}
    number = TYPES[kind]
    fields[_FIELDS[number]] = float(value) if isinstance(value, int | float) and kind == "double" else value
    return _message("ParameterValue", type=number, **fields)


def descriptor(name: str, description: Description) -> Any:
    """Return the ``ParameterDescriptor`` of the parameter ``name``."""
    low, high = description.minimum, description.maximum
    ranges: dict[str, list[Any]] = {"floating_point_range": [], "integer_range": []}
    if description.kind == "double" and low is not None and high is not None:
        span = _message("FloatingPointRange", from_value=float(low), to_value=float(high), step=0.0)
        ranges["floating_point_range"] = [span]
    elif description.kind == "integer" and low is not None:
        highest = 2**63 - 1 if high is None else int(high)
        ranges["integer_range"] = [_message("IntegerRange", from_value=int(low), to_value=highest, step=1)]
    constraints = [text for text in (description.constraint, description.why_fixed) if text]
    return _message(
        "ParameterDescriptor",
        name=name,
        type=TYPES[description.kind],
        description=description.text,
        additional_constraints="; ".join(constraints),
        read_only=description.why_fixed is not None,
        dynamic_typing=False,
        **ranges,
    )


def _message(kind: str, /, **fields: Any) -> Any:
    return types().types[f"{_MESSAGES}/{kind}"](**fields)


def _reply(service: str, /, **fields: Any) -> Any:
    return types().types[reply_type(f"{_SERVICES}/{service}")](**fields)
