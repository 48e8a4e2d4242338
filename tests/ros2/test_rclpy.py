"""What our nodes have of rclpy, as nodes of a real ROS 2: services, overrides of profiles, the log."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from tests.contracts.node_contract import CMD_VEL, ODOM, RUN, VIRTUAL, expect_a_run_to_drive
from tests.contracts.ros2_node_contract import NODE, DdsDriver
from tests.processes import eventually
from tests.ros2.graph import NEEDS_ROS2, PYTHON, Ros2Graph

pytestmark = NEEDS_ROS2


@pytest.fixture
def without_tf2_msgs(ros2: Ros2Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Ros2Graph:
    """A ROS 2 that lacks tf2_msgs: a module of that name is found first."""
    (tmp_path / "tf2_msgs.py").touch()
    before = ros2.env.get("PYTHONPATH", "").split(os.pathsep)
    monkeypatch.setitem(ros2.env, "PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, before)]))
    return ros2


def test_a_stop_and_a_reset_can_be_called(ros2: Ros2Graph) -> None:
    driver = DdsDriver(ros2, parameters={"sign_timeout": 5.0})
    node = next(name for name in ros2.nodes() if name.startswith("/n") and name.endswith(NODE))
    driver.show("Forward", count=2)
    driver.expect((0.01, 0.0), (0.02, 0.0))
    assert ros2.peer.ask("call", service=f"{node}/stop") == {"success": True, "message": "stopped, until it is reset"}
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))
    driver.show("Forward", count=3)
    eventually(lambda: len(driver.twists) >= 6, what="a twist for each sign")
    assert set(driver.twists[2:]) == {(0.0, 0.0)}
    assert ros2.peer.ask("call", service=f"{node}/reset") == {"success": True, "message": "reset"}
    driver.show("Stop")
    driver.show("Forward")
    eventually(lambda: driver.twists[-1] == (0.01, 0.0), what="the robot to be driven")


def test_the_odometry_can_be_reset_while_the_robot_stays(ros2: Ros2Graph) -> None:
    peer, odom = ros2.peer, f"/back{ODOM}"
    ros2.node("robot", name="/back/robot", ros=("-r", "__ns:=/back"))
    peer.ask("record", topic=odom, type="Odometry", fields=["pose.pose.position.x"], reliable=False)
    peer.ask("advertise", topic=f"/back{CMD_VEL}", type="Twist")
    eventually(lambda: peer.ask("listeners", topic=f"/back{CMD_VEL}") > 0 and peer.ask("get", topic=odom))

    def has_driven() -> bool:
        peer.ask("publish", topic=f"/back{CMD_VEL}", values={"linear.x": 0.3}, count=10, period_s=0.05)
        return bool(peer.ask("get", topic=odom)[-1][1][0] > 0.2)

    eventually(has_driven, what="the robot to drive")
    assert peer.ask("call", service="/back/robot/reset_odometry")["success"]
    eventually(lambda: peer.ask("get", topic=odom)[-1][1][0] < 0.1, 5.0, what="the odometry to begin again")


def test_what_is_asked_of_a_profile_is_done(ros2: Ros2Graph) -> None:
    """``qos_overrides``, as ROS 2 has it for each of its own nodes."""
    override = f"qos_overrides./less{ODOM}.publisher.reliability:=best_effort"
    ros2.node("robot", name="/less/robot", ros=("-r", "__ns:=/less", "-p", override))
    ends = eventually(lambda: ros2.peer.ask("endpoints", topic=f"/less{ODOM}"))
    assert [end["reliability"] for end in ends if end["kind"] == "publisher"] == ["BEST_EFFORT"]


def test_what_this_ros2_lacks_is_said_once_and_the_robot_drives_without(without_tf2_msgs: Ros2Graph) -> None:
    ros2 = without_tf2_msgs
    robot = ros2.node("robot", name="/bare/robot", ros=("-r", "__ns:=/bare"))
    eventually(lambda: ros2.publishes("/bare/robot", f"/bare{ODOM}"))
    said = "/tf is left out: this ROS 2 lacks the package tf2_msgs"
    eventually(lambda: said in robot.text)
    assert robot.text.count(said) == 1


def test_what_a_node_logs_is_on_rosout(without_tf2_msgs: Ros2Graph) -> None:
    """The log is latched: what was said before anybody listened is told, too."""
    ros2 = without_tf2_msgs
    robot = ros2.node("robot", name="/told/robot", ros=("-r", "__ns:=/told"))
    eventually(lambda: "/tf is left out" in robot.text)
    ros2.peer.ask("record", topic="/rosout", type="Log", fields=["level", "name", "msg"], latched=True)
    logged = eventually(lambda: [one for _, one in ros2.peer.ask("get", topic="/rosout") if one[1] == "told.robot"])
    assert (logged[0][0], logged[0][2].partition(" ")[0]) == (30, "/tf")


def test_it_logs_as_much_as_it_is_told(without_tf2_msgs: Ros2Graph) -> None:
    ros2 = without_tf2_msgs
    words = ("-r", "__ns:=/hush", "--log-level", "error")
    robot = ros2.node("robot", name="/hush/robot", ros=words)
    eventually(lambda: ros2.publishes("/hush/robot", f"/hush{ODOM}"))
    assert "/tf is left out" not in robot.text


@pytest.mark.parametrize("words", [("-p", "max_linear:=99.0"), ("--params-file", "/no/such.yaml"), ("-r", "__ns:=1/2")])
def test_what_is_wrong_ends_a_node_with_one_line(ros2: Ros2Graph, words: tuple[str, ...]) -> None:
    control = ros2.handsteer("control", "--transport", "ros2", "--ros-args", *words)
    assert control.code() == 2, control.text
    assert "Traceback" not in control.text
    assert control.text.strip().splitlines()[-1].startswith("handsteer: ")


def test_a_run_drives_a_robot_by_rclpy(tmp_path: Path) -> None:
    with Ros2Graph(tmp_path, "ros2") as graph:
        peer = graph.peer
        graph.node("robot", name="/robot", ros=("-r", f"{CMD_VEL[1:]}:=/cmd_vel", "-r", f"{ODOM[1:]}:=/odom"))
        fields = ["twist.twist.linear.x", "pose.pose.position.x"]
        peer.ask("record", topic="/odom", type="Odometry", fields=fields, reliable=False)
        run = graph.handsteer("run", *RUN, "--robot", "auto")
        expect_a_run_to_drive(run, peer, "/odom")


def test_a_node_that_is_ended_leaves_at_once(ros2: Ros2Graph) -> None:
    camera = ros2.node("camera", *VIRTUAL, name="/brief/my_camera", ros=("-r", "__ns:=/brief"))
    camera.signal(signal.SIGINT)
    assert camera.code() == 0, camera.text
    assert "Traceback" not in camera.text
    eventually(lambda: "/brief/my_camera" not in ros2.nodes(), 3.0, what="the node to be gone for others")


def test_the_transport_keeps_its_contract_where_rclpy_is() -> None:
    tests = "tests/plugins/ros2/in_ros2.py"
    command = [str(PYTHON), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", tests]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600.0, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
