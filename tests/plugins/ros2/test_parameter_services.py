from typing import Any

import pytest

from handsteer.config import Config
from handsteer.messages import Time
from handsteer.parameters import NodeParameters
from handsteer.plugins.ros2.parameter_services import ParameterServices, list_names
from handsteer.transports.encoding import decode, encode, reply_type, request_type, types

NODE = "/r1/hand_sign_control"
CONFIG = Config.model_validate({"control": {"max_linear": 0.5, "actions": {"Peace": "turbo"}}})


class Client:
    """Calls the services by what is on the wire, and keeps the events."""

    def __init__(self, section: str = "control") -> None:
        self.applied: list[Config] = []
        self.events: list[Any] = []
        parameters = NodeParameters(CONFIG, section, self.applied.append)
        parameters.add_fixed("use_sim_time", True, "Whether the node follows /clock")
        served = ParameterServices(NODE, parameters, lambda: Time(sec=7, nanosec=0), self.events.append).services
        self._services = {name.removeprefix(f"{NODE}/"): (kind, answer) for name, kind, answer in served}

    def call(self, service: str, **fields: Any) -> Any:
        kind, answer = self._services[service]
        request = types().types[request_type(kind)](**fields)
        reply = answer(decode(encode(request), request_type(kind)))
        return decode(encode(reply), reply_type(kind))

    def get(self, *names: str) -> list[Any]:
        values = self.call("get_parameters", names=list(names)).values
        fields = {1: "bool_value", 2: "integer_value", 3: "double_value", 4: "string_value"}
        return [getattr(value, fields[value.type]) for value in values]

    def set(self, *parameters: Any) -> list[Any]:
        return list(self.call("set_parameters", parameters=list(parameters)).results)

    def set_atomically(self, *parameters: Any) -> Any:
        return self.call("set_parameters_atomically", parameters=list(parameters)).result

    def describe(self, name: str) -> Any:
        return self.call("describe_parameters", names=[name]).descriptors[0]


def parameter(name: str, value: Any) -> Any:
    kinds = {type(None): (0, None), bool: (1, "bool_value"), int: (2, "integer_value")}
    kinds |= {float: (3, "double_value"), str: (4, "string_value"), list: (8, "double_array_value")}
    number, field = kinds[type(value)]
    store = types().types
    # Whatever the node itself says is of the right shape.
    empty = Client().call("get_parameters", names=["max_linear"]).values[0]
    fields = {name: getattr(empty, name) for name in empty.__dataclass_fields__ if not name.startswith("__")}
    fields |= {"type": number, "double_value": 0.0} | ({field: value} if field and number != 8 else {})
    return store["rcl_interfaces/msg/Parameter"](name=name, value=store["rcl_interfaces/msg/ParameterValue"](**fields))


def test_names_are_those_of_the_command_line() -> None:
    names = Client().call("list_parameters", prefixes=[], depth=0).result
    assert names.names[:3] == ["mode", "rule", "ramp"]
    assert {"actions.Peace", "collision_monitor.margin", "use_sim_time"} < set(names.names)
    assert names.prefixes == ["actions", "collision_monitor", "joy"]
    assert "landmarks.model" in Client("signs").call("list_parameters", prefixes=[], depth=0).result.names


@pytest.mark.parametrize(
    ("prefixes", "depth", "found"),
    [
        ([], 0, ["a", "b.c", "b.d.e", "bc"]),
        ([], 1, ["a", "bc"]),
        ([], 2, ["a", "b.c", "bc"]),
        (["b"], 0, ["b.c", "b.d.e"]),
        (["b"], 1, ["b.c"]),
        (["b", "a"], 2, ["a", "b.c", "b.d.e"]),
        (["b.d"], 1, ["b.d.e"]),
        (["x"], 0, []),
    ],
)
def test_prefixes_and_depth_are_those_of_rclcpp(prefixes: list[str], depth: int, found: list[str]) -> None:
    assert list_names(["a", "b.c", "b.d.e", "bc"], prefixes, depth)[0] == found


def test_values_and_types() -> None:
    client = Client()
    assert client.get("max_linear", "ramp", "use_sim_time", "actions.Peace") == [0.5, "per_message", True, "turbo"]
    assert list(client.call("get_parameter_types", names=["max_linear", "ramp", "use_sim_time"]).types) == [3, 4, 1]
    assert Client("signs").get("model", "landmarks.threads") == ["", 1]


def test_one_unknown_name_leaves_the_answer_empty() -> None:
    client = Client()
    assert client.get("max_linear", "max_liner") == []
    assert list(client.call("get_parameter_types", names=["max_linear", "max_liner"]).types) == []
    assert client.call("describe_parameters", names=["max_linear", "actions.Hi"]).descriptors == []


def test_descriptions_have_ranges_and_say_what_is_fixed() -> None:
    speed = Client().describe("max_linear")
    assert (speed.type, speed.read_only, speed.description) == (3, False, "Maximum linear speed [m/s]")
    assert [(one.from_value, one.to_value) for one in speed.floating_point_range] == [(0.0, 10.0)]
    assert speed.additional_constraints == "above 0"
    assert Client().describe("ramp").additional_constraints == "one of per_message, per_second"
    threads = Client("signs").describe("landmarks.threads")
    assert (threads.type, threads.read_only) == (2, True)
    assert [(one.from_value, one.to_value, one.step) for one in threads.integer_range] == [(1, 64, 1)]
    assert threads.additional_constraints == "it is only read when the node starts"


def test_a_set_is_checked_applied_and_told() -> None:
    client = Client()
    (result,) = client.set(parameter("max_linear", 0.2))
    assert (result.successful, result.reason) == (True, "")
    assert client.get("max_linear") == [0.2]
    assert [config.control.max_linear for config in client.applied] == [0.2]
    (event,) = client.events
    assert (event.node, event.stamp.sec) == (NODE, 7)
    assert [(one.name, one.value.double_value) for one in event.changed_parameters] == [("max_linear", 0.2)]
    assert event.new_parameters == event.deleted_parameters == []


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("max_linear", 30.0, "max_linear: 30.0 should be less than or equal to 10"),
        ("max_linear", float("nan"), "max_linear: nan should be a finite number"),
        ("max_linear", "fast", "max_linear: 'fast' should be a number"),
        ("max_linear", True, "max_linear: True should be a number"),
        ("max_linear", [], "max_linear: [] should be a number"),
        ("max_linear", None, "max_linear cannot be removed, only set to another value"),
        ("ramp", "steep", "ramp: 'steep' should be 'per_message' or 'per_second'"),
        ("max_liner", 0.3, "max_liner: there is no such parameter; the parameters are mode, rule"),
        ("use_sim_time", False, "use_sim_time cannot be set: it is only read when the node starts"),
        ("actions.Stop", "forward", "actions: {'Peace': 'turbo', 'Stop': 'forward'} should leave Stop at 'stop'"),
    ],
)
def test_what_is_wrong_changes_nothing_and_is_said(name: str, value: Any, reason: str) -> None:
    client = Client()
    (result,) = client.set(parameter(name, value))
    assert not result.successful
    assert result.reason.startswith(reason)
    assert client.applied == client.events == []
    assert client.get("max_linear", "ramp", "use_sim_time") == [0.5, "per_message", True]


def test_several_are_set_all_or_none() -> None:
    client = Client()
    wrong = client.set_atomically(parameter("max_linear", 0.2), parameter("max_angular", 99.0))
    assert not wrong.successful
    assert client.get("max_linear") == [0.5]
    assert client.set_atomically(parameter("max_linear", 0.2), parameter("max_angular", 1)).successful
    assert client.get("max_linear", "max_angular") == [0.2, 1.0]
    assert len(client.applied) == len(client.events) == 1


def test_set_parameters_sets_each_for_itself() -> None:
    client = Client()
    results = client.set(parameter("max_linear", 99.0), parameter("max_angular", 1.5))
    assert [result.successful for result in results] == [False, True]
    assert client.get("max_linear", "max_angular") == [0.5, 1.5]


def test_actions_come_and_go() -> None:
    client = Client()
    assert client.set(parameter("actions.Hi", "stop"))[0].successful
    assert client.applied[-1].control.actions == {"Peace": "turbo", "Hi": "stop"}
    assert [one.name for one in client.events[-1].new_parameters] == ["actions.Hi"]
    assert client.set(parameter("actions.Peace", None))[0].successful
    assert client.applied[-1].control.actions == {"Hi": "stop"}
    assert [one.name for one in client.events[-1].deleted_parameters] == ["actions.Peace"]


def test_a_dump_can_be_loaded_again() -> None:
    """``ros2 param load`` sets what cannot change, too, to the value that it has."""
    client = Client("signs")
    values = dict(zip(("image_transport", "use_sim_time"), client.get("image_transport", "use_sim_time"), strict=True))
    assert all(client.set(parameter(name, value))[0].successful for name, value in values.items())
    assert client.applied == []
