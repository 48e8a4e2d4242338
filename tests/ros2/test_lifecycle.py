"""Recognition and control as managed nodes: what ``ros2 lifecycle`` and Nav2's lifecycle manager call, by rclpy."""

import re
import threading
import time

import pytest

from tests.contracts.node_contract import CMD_VEL, twists
from tests.contracts.ros2_node_contract import NODE, DdsDriver, record_twists
from tests.processes import eventually
from tests.ros2.graph import NEEDS_ROS2, Ros2Graph

pytestmark = NEEDS_ROS2

AT_MOST_S = 0.2


def node_of(driver: DdsDriver) -> str:
    return driver.signs.removesuffix("/gesture/hand_sign") + f"/{NODE}"


def times_and_twists(ros2: Ros2Graph, driver: DdsDriver) -> list[tuple[float, tuple[float, ...]]]:
    return [(at_s, tuple(values)) for at_s, values in ros2.peer.ask("get", topic=driver.cmd_vel)]


def test_a_control_that_is_deactivated_sends_zero_and_is_silent_until_it_is_active_and_neutral_is_seen(
    ros2: Ros2Graph,
) -> None:
    driver = DdsDriver(ros2, parameters={"sign_timeout": 0.35})
    manager, node = ros2.start_peer(), node_of(driver)
    assert manager.ask("state", node=node) == "active", "by itself"
    shows = threading.Thread(target=driver.show, args=("Forward", 400))  # eight seconds, with no pause
    shows.start()
    try:
        time.sleep(1.0)
        asked_s = time.monotonic()
        assert manager.ask("change_state", node=node, transition="TRANSITION_DEACTIVATE")
        assert manager.ask("state", node=node) == "inactive"
        time.sleep(1.0)
        assert manager.ask("change_state", node=node, transition="TRANSITION_ACTIVATE")
        active_s = time.monotonic()
        time.sleep(1.0)
    finally:
        shows.join()
    found = times_and_twists(ros2, driver)
    before = [values for at_s, values in found if at_s < asked_s]
    assert before[-1][0] > 0.1, "it drove"
    after = [(at_s - asked_s, values) for at_s, values in found if asked_s <= at_s < active_s]
    stopped_s = next(at_s for at_s, values in after if values == (0.0, 0.0))
    assert stopped_s < AT_MOST_S
    assert [values for at_s, values in after if at_s > stopped_s] == [], "silent"
    assert {values for at_s, values in found if at_s > active_s} == {(0.0, 0.0)}, "the same hand is still up"
    driver.show("Stop")
    driver.show("Forward", 3)
    eventually(lambda: driver.twists[-1] == (0.03, 0.0), what="the robot to be driven")


@pytest.mark.parametrize("verb", ["control", "recognition"])
def test_a_lifecycle_manager_brings_a_node_up_and_down(ros2: Ros2Graph, verb: str) -> None:
    """In the order in which Nav2's manager does it."""
    node = f"/nav_{verb}/hand_sign_{verb}"
    process = ros2.node(verb, name=node, ros=("-r", f"__ns:=/nav_{verb}", "-p", "autostart:=false"))
    assert ros2.peer.ask("state", node=node) == "unconfigured"
    for wrong in ("ACTIVATE", "DEACTIVATE", "CLEANUP", "ACTIVE_SHUTDOWN", "CALLBACK_SUCCESS"):
        assert not ros2.peer.ask("change_state", node=node, transition=f"TRANSITION_{wrong}"), wrong
    states = []
    for transition in ("CONFIGURE", "ACTIVATE", "DEACTIVATE", "ACTIVATE", "DEACTIVATE", "CLEANUP", "CONFIGURE"):
        assert ros2.peer.ask("change_state", node=node, transition=f"TRANSITION_{transition}")
        states.append(ros2.peer.ask("state", node=node))
    assert states == ["inactive", "active", "inactive", "active", "inactive", "unconfigured", "inactive"]
    assert ros2.peer.ask("change_state", node=node, transition="TRANSITION_INACTIVE_SHUTDOWN")
    assert ros2.peer.ask("state", node=node) == "finalized"
    assert not ros2.peer.ask("change_state", node=node, transition="TRANSITION_ACTIVATE")
    assert process.running
    assert "Traceback" not in process.text


def test_a_control_that_is_not_yet_active_commands_nothing_but_remembers_a_stop(ros2: Ros2Graph) -> None:
    peer, node, signs = ros2.peer, f"/later/{NODE}", "/later/gesture/hand_sign"
    record_twists(peer, cmd_vel := f"/later{CMD_VEL}")
    peer.ask("advertise", topic=signs, type="String")
    ros2.node("control", name=node, ros=("-r", "__ns:=/later", "-p", "autostart:=false"))
    eventually(lambda: peer.ask("listeners", topic=signs) > 0)
    eventually(lambda: ros2.publishes(node, cmd_vel))

    def show(sign: str, count: int) -> None:
        peer.ask("publish", topic=signs, values={"data": sign}, count=count, period_s=0.02)

    show("Stop", 20)
    show("Forward", 20)
    assert peer.ask("call", service=f"{node}/stop")["success"]
    assert twists(peer, cmd_vel) == []
    for transition in ("CONFIGURE", "ACTIVATE"):
        assert peer.ask("change_state", node=node, transition=f"TRANSITION_{transition}")
    show("Stop", 20)
    show("Forward", 20)
    eventually(lambda: twists(peer, cmd_vel), what="zeros")
    assert {velocity for _, velocity in twists(peer, cmd_vel)} == {(0.0, 0.0)}
    said = peer.ask("call", service=f"{node}/engage_state")
    assert said == {"success": True, "message": "engaged; stopped, until it is reset"}


@pytest.mark.parametrize(("name", "value"), [("autostart", "maybe"), ("use_sim_time", "3")])
def test_what_is_not_a_boolean_is_said(ros2: Ros2Graph, name: str, value: str) -> None:
    node = ros2.handsteer("control", "--transport", "ros2", "--ros-args", "-p", f"{name}:={value}")
    assert node.code() == 2
    assert re.search(f"ROS parameter {name}: '?{value}'? should be true or false", node.text), node.text
