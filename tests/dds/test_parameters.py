"""The parameters of our nodes, as a client of rmw_cyclonedds_cpp sees and sets them."""

import time
from pathlib import Path
from typing import Any

import pytest

from tests.about import about
from tests.contracts.node_contract import CMD_VEL
from tests.contracts.ros2_node_contract import NODE, DdsDriver, record_twists
from tests.dds.graph import DdsGraph
from tests.processes import eventually

pytest.importorskip("cyclonedds")
pytestmark = pytest.mark.slow

DOUBLE, STRING = 3, 4


def ask(dds: DdsGraph, node: str, service: str, kind: str, **fields: Any) -> Any:
    return dds.peer.ask("call", service=f"{node}/{service}", type=kind, fields=fields)


def set_one(dds: DdsGraph, node: str, name: str, **value: Any) -> Any:
    return ask(dds, node, "set_parameters", "SetParameters", parameters={name: value})["results"][0]


def test_the_parameters_of_a_node_are_listed_read_and_described(dds: DdsGraph) -> None:
    node = f"/seen/{NODE}"
    words = ("-r", "__ns:=/seen", "-p", "max_linear:=0.5")
    dds.node("control", name=node, ros=words)
    names = ask(dds, node, "list_parameters", "ListParameters", prefixes=[], depth=0)["result"]["names"]
    assert {"ramp", "linear_step", "mode", "rule"} <= set(names)
    assert "use_sim_time" in names
    (value,) = ask(dds, node, "get_parameters", "GetParameters", names=["max_linear"])["values"]
    assert (value["type"], value["double_value"]) == (DOUBLE, 0.5)
    assert ask(dds, node, "get_parameter_types", "GetParameterTypes", names=["ramp"])["types"] in ([STRING], [4])
    (about,) = ask(dds, node, "describe_parameters", "DescribeParameters", names=["max_linear"])["descriptors"]
    assert about["description"] == "Maximum linear speed [m/s]"
    assert about["floating_point_range"] == [{"from_value": 0.0, "to_value": 10.0, "step": 0.0}]


def test_ros2_sees_the_services_at_the_node_with_hashes_and_one_identity(dds: DdsGraph) -> None:
    node = f"/shown/{NODE}"
    dds.node("control", name=node, ros=("-r", "__ns:=/shown"))
    service = f"{node}/list_parameters"
    eventually(lambda: f"rr{service}Reply" in dds.nodes()[node]["writers"])
    asked, told = dds.nodes()[node]["readers"][f"rq{service}Request"], dds.nodes()[node]["writers"][f"rr{service}Reply"]
    assert asked[0] == "rcl_interfaces::srv::dds_::ListParameters_Request_"
    assert told[0] == "rcl_interfaces::srv::dds_::ListParameters_Response_"
    (identity, asked_hash, _), (same, told_hash, _) = asked[1].split(";"), told[1].split(";")
    assert identity == same
    assert identity.startswith("serviceid=")
    assert asked_hash == "typehash=RIHS01_a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df"
    assert told_hash == "typehash=RIHS01_31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd"


def test_a_lower_limit_slows_a_driving_robot_at_once(dds: DdsGraph) -> None:
    driver = DdsDriver(dds, parameters={"linear_step": 0.3, "sign_timeout": 5.0})
    node = next(name for name in dds.nodes() if name.endswith(NODE) and name.startswith("/n"))
    dds.peer.ask("record", topic="/parameter_events", type="ParameterEvent", fields=["node", "changed_parameters"])
    driver.show("Forward", count=2)
    driver.expect((0.3, 0.0), (0.6, 0.0))
    assert set_one(dds, node, "max_linear", type=DOUBLE, double_value=0.2) == {"successful": True, "reason": ""}
    driver.expect((0.3, 0.0), (0.6, 0.0), (0.2, 0.0))
    eventually(lambda: [node, 1] in [values for _, values in dds.peer.ask("get", topic="/parameter_events")])


def test_what_is_wrong_is_refused_in_words(dds: DdsGraph) -> None:
    node = f"/wrong/{NODE}"
    dds.node("control", name=node, ros=("-r", "__ns:=/wrong"))
    reason = "max_linear: 99.0 should be less than or equal to 10"
    assert set_one(dds, node, "max_linear", type=DOUBLE, double_value=99.0) == {"successful": False, "reason": reason}
    both = {"max_linear": {"type": DOUBLE, "double_value": 0.2}, "nothing": {"type": DOUBLE, "double_value": 1.0}}
    result = ask(dds, node, "set_parameters_atomically", "SetParametersAtomically", parameters=both)["result"]
    assert not result["successful"]
    (value,) = ask(dds, node, "get_parameters", "GetParameters", names=["max_linear"])["values"]
    assert value["double_value"] == 1.0


def test_a_client_that_says_in_no_way_who_it_is_gets_no_answer_and_harms_nobody(dds: DdsGraph) -> None:
    node = f"/other/{NODE}"
    control = dds.node("control", name=node, ros=("-r", "__ns:=/other"))
    order = {"service": f"{node}/list_parameters", "type": "ListParameters", "fields": {"prefixes": [], "depth": 0}}
    assert dds.peer.ask("call", **order, identified=False, timeout_s=1.0) is None
    assert dds.peer.ask("call", **order)["result"]["names"]
    assert "Traceback" not in control.text


def test_requests_do_not_hold_up_signs(tmp_path: Path) -> None:
    with DdsGraph(tmp_path) as dds:
        other = dds.start_peer()
        driver = DdsDriver(dds, parameters={"linear_step": 0.01})
        node = next(name for name in dds.nodes() if name.endswith(NODE))
        order = {"service": f"{node}/list_parameters", "type": "ListParameters", "fields": {"prefixes": [], "depth": 0}}
        began_s = time.monotonic()
        driver.show("Forward", count=20)
        for _ in range(5):
            assert other.ask("call", **order) is not None
        assert time.monotonic() - began_s < 60
        driver.expect(*((about(0.01 * step), 0.0) for step in range(1, 21)))


def test_services_can_be_left_out(dds: DdsGraph) -> None:
    node = f"/closed/{NODE}"
    dds.node("control", name=node, ros=("-r", "__ns:=/closed", "-p", "start_parameter_services:=false"))
    record_twists(dds.peer, f"/closed{CMD_VEL}")
    eventually(lambda: dds.publishes(node, f"/closed{CMD_VEL}"))
    assert not [name for name in dds.nodes()[node]["readers"] if name.startswith("rq")]
