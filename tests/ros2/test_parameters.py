"""The parameters of our nodes by rclpy, as ``ros2 param`` sees and sets them: by rclpy's own client."""

import signal
from pathlib import Path
from typing import Any

import pytest

from tests.contracts.node_contract import VIRTUAL
from tests.contracts.ros2_node_contract import NODE, DdsDriver
from tests.processes import eventually
from tests.ros2.graph import NEEDS_ROS2, Ros2Graph

pytestmark = NEEDS_ROS2

DOUBLE, STRING = 3, 4
SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}


def ask(ros2: Ros2Graph, node: str, call: str, *arguments: Any) -> Any:
    return ros2.peer.ask("parameters", node=node, call=call, arguments=list(arguments))


def test_the_parameters_of_a_node_are_listed_read_and_described(ros2: Ros2Graph) -> None:
    node = f"/seen/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/seen", "-p", "max_linear:=0.5"))
    names = ask(ros2, node, "list_parameters")["result"]["names"]
    assert {"ramp", "linear_step", "use_sim_time"} < set(names)
    one, other = ask(ros2, node, "get_parameters", "max_linear", "ramp")["values"]
    assert (one["type"], one["double_value"]) == (DOUBLE, 0.5)
    assert other["type"] == STRING
    assert ask(ros2, node, "get_parameter_types", "max_linear", "ramp")["types"] == [DOUBLE, STRING]
    everything = ask(ros2, node, "describe_parameters", *names)["descriptors"]
    assert [one["name"] for one in everything] == names
    about = everything[names.index("max_linear")]
    assert about["description"] == "Maximum linear speed [m/s]"
    assert about["floating_point_range"] == [{"from_value": 0.0, "to_value": 10.0, "step": 0.0}]


def test_what_is_wrong_is_refused_in_words_and_what_is_right_is_set(ros2: Ros2Graph) -> None:
    node = f"/set/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/set"))
    results = ask(ros2, node, "set_parameters", {"name": "max_linear", "value": 99.0})["results"]
    assert results == [
        {"successful": False, "reason": "Parameter max_linear out of range Min: 0.0, Max: 10.0, value: 99.0"}
    ]
    both = ({"name": "max_linear", "value": 0.2}, {"name": "nothing", "value": 1.0})
    assert not ask(ros2, node, "set_parameters_atomically", *both)["result"]["successful"]
    assert ask(ros2, node, "get_parameters", "max_linear")["values"][0]["double_value"] == 1.0
    assert ask(ros2, node, "set_parameters_atomically", both[0])["result"] == {"successful": True, "reason": ""}
    assert ask(ros2, node, "get_parameters", "max_linear")["values"][0]["double_value"] == 0.2


def test_a_lower_limit_slows_a_driving_robot_at_once(ros2: Ros2Graph) -> None:
    driver = DdsDriver(ros2, parameters={"linear_step": 0.3, "sign_timeout": 5.0})
    node = next(name for name in ros2.nodes() if name.endswith(NODE) and name.startswith("/n"))
    ask(ros2, node, "list_parameters")
    driver.show("Forward", count=2)
    driver.expect((0.3, 0.0), (0.6, 0.0))
    assert ask(ros2, node, "set_parameters", {"name": "max_linear", "value": 0.2})["results"][0]["successful"]
    driver.expect((0.3, 0.0), (0.6, 0.0), (0.2, 0.0))


def test_a_changed_parameter_is_in_the_audit(ros2: Ros2Graph) -> None:
    node = f"/told/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/told"))
    ros2.peer.ask("record", topic="/told/audit", type="Log", fields=["name", "function", "msg"])
    assert ask(ros2, node, "set_parameters", {"name": "max_linear", "value": 0.2})["results"][0]["successful"]

    def told() -> list[Any]:
        return [values for _, values in ros2.peer.ask("get", topic="/told/audit")]

    changed = ["told/hand_sign_control", "setting_changed", "changed control.max_linear from 1 to 0.2"]
    eventually(lambda: changed in told())


def test_a_limit_that_is_broken_and_a_change_too_late_are_refused_in_words(ros2: Ros2Graph) -> None:
    node = "/late/my_camera"
    ros2.node("camera", *VIRTUAL, name=node, ros=("-r", "__ns:=/late"))
    ask(ros2, node, "list_parameters")
    (result,) = ask(ros2, node, "set_parameters", {"name": "fps", "value": 20.0})["results"]
    assert result == {"successful": False, "reason": "fps cannot be set: it is only read when the node starts"}
    (result,) = ask(ros2, node, "set_parameters", {"name": "use_sim_time", "value": True})["results"]
    assert not result["successful"]
    assert result["reason"].startswith("use_sim_time cannot be set")
    depth = "qos_overrides./late/image_raw.publisher.depth"
    (result,) = ask(ros2, node, "set_parameters", {"name": depth, "value": 3})["results"]
    assert result == {"successful": False, "reason": f"{depth} cannot be set: it is only read when the node starts"}


def test_a_whole_number_does_for_a_double_and_entries_of_a_table_come_and_go(ros2: Ros2Graph) -> None:
    node = f"/table/{NODE}"
    words = ("-r", "__ns:=/table", "-p", "max_linear:=1", "-p", "actions.Peace:=stop", "-p", "arming:=off")
    ros2.node("control", "--control.arming", "auto", name=node, ros=words)
    names = ask(ros2, node, "list_parameters")["result"]["names"]
    assert "actions.Peace" in names
    changes = [{"name": "max_linear", "value": 2}, {"name": "actions.Rock", "value": "forward"}]
    results = ask(ros2, node, "set_parameters", *changes)["results"]
    assert [one["successful"] for one in results] == [True, True], results
    assert ask(ros2, node, "get_parameters", "max_linear")["values"][0]["double_value"] == 2.0
    assert ask(ros2, node, "get_parameters", "actions.Rock")["values"][0]["string_value"] == "forward"
    ask(ros2, node, "delete_parameters", "actions.Peace")
    names = ask(ros2, node, "list_parameters")["result"]["names"]
    assert "actions.Peace" not in names
    assert "actions.Rock" in names
    (result,) = ask(ros2, node, "set_parameters", {"name": "nonsense", "value": 1.0})["results"]
    assert "there is no such parameter" in result["reason"]


NODES = {
    "camera": ("my_camera", VIRTUAL),
    "recognition": ("hand_sign_recognition", ()),
    "control": (NODE, ()),
    "robot": ("robot", ()),
    "steering": ("steering", ("--port", "0", "--dashboard.no-open-browser")),
}


@pytest.mark.parametrize("verb", NODES)
def test_what_is_dumped_can_be_loaded(ros2: Ros2Graph, verb: str) -> None:
    name, options = NODES[verb]
    node = f"/whole/{name}"
    ros2.node(verb, *options, name=node, ros=("-r", "__ns:=/whole"))
    before = ros2.peer.ask("dump", node=node)
    assert len(before) > 5
    results = ros2.peer.ask("load", node=node, values=before)["results"]
    # rclpy's own, which no node of ROS 2 takes back.
    wrong = [one["reason"] for one in results if not one["successful"]]
    assert wrong == ["Trying to set a read-only parameter: start_type_description_service."]
    assert ros2.peer.ask("dump", node=node) == before


def test_a_file_for_many_nodes_has_parameters_of_others(ros2: Ros2Graph, tmp_path: Path) -> None:
    file = tmp_path / "shared.yaml"
    file.write_text(f"/**/{NODE}: {{ros__parameters: {{max_linear: 0.25}}}}\n/other: {{ros__parameters: {{fps: 1}}}}\n")
    node = f"/shared/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/shared", "--params-file", str(file)))
    assert ask(ros2, node, "get_parameters", "max_linear")["values"][0]["double_value"] == 0.25


def test_ros2_sees_its_own_services_at_the_node_and_their_end(ros2: Ros2Graph) -> None:
    node = f"/shown/{NODE}"
    control = ros2.node("control", name=node, ros=("-r", "__ns:=/shown"))
    ask(ros2, node, "list_parameters")
    seen = ros2.peer.ask("services", node=node)
    assert {f"{node}/{name}": [kind] for name, kind in SERVICES.items()}.items() <= seen.items()
    assert seen[f"{node}/get_type_description"] == ["type_description_interfaces/srv/GetTypeDescription"]
    assert ros2.peer.ask("servers", service=f"{node}/list_parameters") == 1
    eventually(lambda: "is ready" in control.text)
    control.signal(signal.SIGTERM)
    assert control.code() == 0
    eventually(lambda: ros2.peer.ask("servers", service=f"{node}/list_parameters") == 0, 5.0, what="it to be gone")
    assert "Traceback" not in control.text


def test_two_nodes_answer_each_for_itself(ros2: Ros2Graph) -> None:
    for name, limit in (("left", 0.25), ("right", 0.5)):
        ros2.node("control", name=f"/{name}/{NODE}", ros=("-r", f"__ns:=/{name}", "-p", f"max_linear:={limit}"))
    for _ in range(3):
        for name, limit in (("left", 0.25), ("right", 0.5)):
            assert ask(ros2, f"/{name}/{NODE}", "get_parameters", "max_linear")["values"][0]["double_value"] == limit


def test_beyond_this_machine_the_network_card_is_used(tmp_path: Path) -> None:
    with Ros2Graph(tmp_path, "ros2") as graph:
        graph.peer.kill()
        graph.env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
        graph.peer = graph.start_peer()
        graph.node("control", name=f"/{NODE}")
        assert ask(graph, f"/{NODE}", "list_parameters")["result"]["names"]
