"""The parameters of our nodes, as a real ROS 2 on Fast DDS sees and sets them by rclpy's own client."""

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.contracts.node_contract import CMD_VEL
from tests.dds.driver import NODE, DdsDriver
from tests.processes import eventually
from tests.ros2.graph import PYTHON, Ros2Graph, ros2_graph

pytest.importorskip("cyclonedds")
pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]

DOUBLE, STRING = 3, 4
SERVICES = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}


@pytest.fixture(scope="module")
def ros2(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros2Graph]:
    with ros2_graph(tmp_path_factory.mktemp("ros2")) as graph:
        yield graph


def ask(ros2: Ros2Graph, node: str, call: str, *arguments: Any) -> Any:
    return ros2.peer.ask("parameters", node=node, call=call, arguments=list(arguments))


def test_the_parameters_of_a_node_are_listed_read_and_described(ros2: Ros2Graph) -> None:
    node = f"/seen/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/seen", "-p", "max_linear:=0.5"))
    names = ask(ros2, node, "list_parameters")["result"]["names"]
    assert names[:2] == ["ramp", "linear_step"]
    assert "use_sim_time" in names
    one, other = ask(ros2, node, "get_parameters", "max_linear", "ramp")["values"]
    assert (one["type"], one["double_value"]) == (DOUBLE, 0.5)
    assert other["type"] == STRING
    assert ask(ros2, node, "get_parameter_types", "max_linear", "ramp")["types"] == [DOUBLE, STRING]
    everything = ask(ros2, node, "describe_parameters", *names)["descriptors"]
    assert [one["name"] for one in everything] == names
    about = everything[names.index("max_linear")]
    assert about["description"] == "Highest forward and backward speed [m/s]"
    assert about["floating_point_range"] == [{"from_value": 0.0, "to_value": 10.0, "step": 0.0}]


def test_what_is_wrong_is_refused_in_words_and_what_is_right_is_set(ros2: Ros2Graph) -> None:
    node = f"/set/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/set"))
    reason = "max_linear: 99.0 should be less than or equal to 10"
    results = ask(ros2, node, "set_parameters", {"name": "max_linear", "value": 99.0})["results"]
    assert results == [{"successful": False, "reason": reason}]
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


def test_ros2_sees_the_services_at_the_node_alone_and_their_end(ros2: Ros2Graph) -> None:
    node = f"/shown/{NODE}"
    control = ros2.node("control", name=node, ros=("-r", "__ns:=/shown"))
    ask(ros2, node, "list_parameters")
    assert ros2.peer.ask("services", node=node) == {f"{node}/{name}": [kind] for name, kind in SERVICES.items()}
    assert ros2.peer.ask("servers", service=f"{node}/list_parameters") == 2  # one for each DDS
    names = ros2.peer.ask("names")
    assert names.count(node) == 1
    assert all(name == "/looker" or name.endswith(NODE) for name in names), names
    control.signal(signal.SIGTERM)
    assert control.code() == 0
    # Fast DDS does not understand how Cyclone DDS takes its leave, and waits ten seconds until it is overdue.
    eventually(lambda: ros2.peer.ask("servers", service=f"{node}/list_parameters") <= 1, 5.0, what="ours to be gone")
    assert "Traceback" not in control.text


def test_many_clients_one_after_the_other_are_answered(ros2: Ros2Graph) -> None:
    node = f"/asked/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/asked"))
    count = len(ask(ros2, node, "list_parameters")["result"]["names"])
    answers = ros2.peer.ask("fresh_clients", node=node, count=20)
    assert [found for found, _ in answers] == [count] * 20


def test_two_nodes_answer_each_for_itself(ros2: Ros2Graph) -> None:
    for name, limit in (("left", 0.25), ("right", 0.5)):
        ros2.node("control", name=f"/{name}/{NODE}", ros=("-r", f"__ns:=/{name}", "-p", f"max_linear:={limit}"))
    for _ in range(3):
        for name, limit in (("left", 0.25), ("right", 0.5)):
            assert ask(ros2, f"/{name}/{NODE}", "get_parameters", "max_linear")["values"][0]["double_value"] == limit


def test_services_can_be_left_out(ros2: Ros2Graph) -> None:
    node = f"/closed/{NODE}"
    ros2.node("control", name=node, ros=("-r", "__ns:=/closed", "-p", "start_parameter_services:=false"))
    eventually(lambda: ros2.publishes(node, f"/closed{CMD_VEL}"))
    assert ros2.peer.ask("services", node=node) == {}


def test_beyond_this_machine_the_network_card_is_used(tmp_path: Path) -> None:
    with ros2_graph(tmp_path) as graph:
        graph.peer.kill()
        graph.env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
        graph.peer = graph.start_peer()
        graph.node("control", name=f"/{NODE}")
        assert ask(graph, f"/{NODE}", "list_parameters")["result"]["names"][0] == "ramp"


@pytest.mark.parametrize(
    ("verb", "name"),
    [
        ("camera", "my_camera"),
        ("recognition", "hand_sign_recognition"),
        ("control", "hand_sign_control"),
        ("robot", "robot"),
        ("steering", "steering"),
    ],
)
def test_what_is_dumped_can_be_loaded(ros2: Ros2Graph, tmp_path: Path, verb: str, name: str) -> None:
    """Among it are an empty list, and texts that YAML takes for something else."""
    options = {"camera": ("--camera.source", "virtual"), "steering": ("--port", "0", "--dashboard.open-browser=false")}
    words = ("-r", "__ns:=/dumped", *(("-p", "arming:='off'") if verb == "control" else ()))
    ros2.node(verb, *options.get(verb, ()), name=f"/dumped/{name}", ros=words)
    assert ros2.peer.ask("reload", node=f"/dumped/{name}", file=str(tmp_path / "dump.yaml")) == []
