"""Our nodes as processes in a real ROS 1 graph, seen by plain rospy nodes and ROS's own tools."""

import itertools
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.processes import Peer, Process, eventually
from tests.ros1.graph import Ros1Graph, ros1_graph

pytestmark = [pytest.mark.ros1, pytest.mark.slow]

CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
FORWARD = ["--camera", "virtual", "--camera.width", "320", "--camera.height", "240", "_virtual_hand/script:=Forward:60"]
LIMIT_S = 0.5
"""From the death of any node to a zero velocity at the robot."""

numbers = itertools.count()


class Driver:
    """A peer that shows signs to a control of its own namespace, and notes the velocities that come out."""

    def __init__(self, graph: Ros1Graph, *options: str) -> None:
        self.namespace = f"/n{next(numbers)}"
        self.control = graph.node("control", f"__ns:={self.namespace}", *options, name=f"{self.namespace}/{NODE}")
        self.peer = graph.peer(f"__ns:={self.namespace}")
        record_twists(self.peer, f"{self.namespace}{CMD_VEL}")
        self.peer.ask("advertise", topic="gesture/hand_sign", package="std_msgs", type="String")
        eventually(lambda: self.peer.ask("listeners", topic="gesture/hand_sign") > 0)
        eventually(lambda: graph.listeners(f"{self.namespace}{CMD_VEL}"))

    def show(self, sign: str, count: int = 1, period_s: float = 0.02) -> None:
        values = {"data": sign}
        self.peer.ask("publish", topic="gesture/hand_sign", values=values, count=count, period_s=period_s)

    @property
    def twists(self) -> list[tuple[float, float]]:
        return [twist for _, twist in twists(self.peer, f"{self.namespace}{CMD_VEL}")]

    def expect(self, *wanted: tuple[float, float]) -> None:
        eventually(lambda: len(self.twists) >= len(wanted), 10.0, what=f"{len(wanted)} twists")
        assert self.twists[: len(wanted)] == list(wanted)


NODE = "hand_sign_control"


def record_twists(peer: Peer, topic: str = CMD_VEL) -> None:
    peer.ask("record", topic=topic, package="geometry_msgs", type="Twist", fields=["linear.x", "angular.z"])


def twists(peer: Peer, topic: str = CMD_VEL) -> list[tuple[float, tuple[float, float]]]:
    return [(at_s, (round(x, 6), round(z, 6))) for at_s, (x, z) in peer.ask("get", topic=topic)]


@pytest.fixture
def drive(ros1: Ros1Graph) -> Callable[..., Driver]:
    return lambda *options: Driver(ros1, *options)


def test_exactly_one_twist_a_sign_with_the_values_of_the_course(drive: Callable[..., Driver]) -> None:
    driver = drive()
    driver.show("Forward", count=5)
    for sign in ("Turn Left", "Go", "Dance", "Turn Right", "Backward", "Stop", "Forward", "NONE"):
        driver.show(sign)
    grown = [(0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.04, 0.0), (0.05, 0.0)]
    kept = [(0.05, 0.1), (0.05, 0.1), (0.05, 0.1), (0.05, 0.0), (0.04, 0.0), (0.0, 0.0), (0.01, 0.0), (0.0, 0.0)]
    driver.expect(*grown, *kept)
    time.sleep(0.2)
    assert len(driver.twists) == len(grown) + len(kept)


def test_signs_that_come_all_at_once_count_each(drive: Callable[..., Driver]) -> None:
    driver = drive()
    driver.show("Forward", count=5, period_s=0.0)
    driver.expect(*[(round(0.01 * n, 6), 0.0) for n in range(1, 6)])


def test_rostopic_pub_gives_one_twist(ros1: Ros1Graph, drive: Callable[..., Driver]) -> None:
    driver = drive()
    topic = f"{driver.namespace}/gesture/hand_sign"
    publish = ros1.run("rostopic", "pub", "-1", topic, "std_msgs/String", "data: 'Turn Left'")
    driver.expect((0.0, 0.1))
    publish.kill()


def test_speed_is_bounded_and_does_not_wind_up(drive: Callable[..., Driver]) -> None:
    driver = drive("_max_linear:=0.1", "_linear_step:=0.04")
    driver.show("Forward", count=60, period_s=0.01)
    driver.show("Backward")
    driver.expect((0.04, 0.0), (0.08, 0.0), *[(0.1, 0.0)] * 58, (0.06, 0.0))


def test_zero_when_signs_stop_then_silence(drive: Callable[..., Driver]) -> None:
    driver = drive()
    driver.show("Forward", count=2)
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))
    time.sleep(0.6)
    assert len(driver.twists) == 3


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_zero_at_exit(drive: Callable[..., Driver], number: signal.Signals) -> None:
    driver = drive("--control.sign-timeout", "5")
    driver.show("Forward", count=2)
    driver.expect((0.01, 0.0), (0.02, 0.0))
    driver.control.signal(number)
    assert driver.control.code() == 0, driver.control.text
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))


def test_one_zero_when_ros_ends_the_node(ros1: Ros1Graph, drive: Callable[..., Driver]) -> None:
    driver = drive("--control.sign-timeout", "5")
    driver.show("Forward")
    driver.expect((0.01, 0.0))
    subprocess.run(["rosnode", "kill", f"{driver.namespace}/{NODE}"], env=ros1.env, check=True, capture_output=True)
    assert driver.control.code() == 0, driver.control.text
    driver.expect((0.01, 0.0), (0.0, 0.0))


def test_after_a_freeze_nothing_old_is_obeyed(drive: Callable[..., Driver]) -> None:
    driver = drive()
    driver.show("Forward", count=3)
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0))
    driver.control.freeze()
    driver.show("Forward", count=30, period_s=0.033)
    driver.control.signal(signal.SIGCONT)
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.0, 0.0))
    time.sleep(0.5)
    assert driver.twists[3:] == [(0.0, 0.0)]


def test_names_follow_remappings_and_namespaces(ros1: Ros1Graph) -> None:
    control = ros1.node("control", "__ns:=/far", "__name:=driver", f"{CMD_VEL[1:]}:=/base/cmd_vel", name="/far/driver")
    eventually(lambda: "/far/driver" in ros1.listeners("/far/gesture/hand_sign"))
    assert ros1.talkers("/base/cmd_vel") == ["/far/driver"]
    assert "/far/driver" in ros1.talkers("/diagnostics")
    control.signal(signal.SIGTERM)
    assert control.code() == 0


def test_a_full_name_can_be_remapped(ros1: Ros1Graph) -> None:
    ros1.node("control", "__name:=remapped", "/gesture/hand_sign:=/hand", name="/remapped")
    eventually(lambda: "/remapped" in ros1.listeners("/hand"))


def test_compressed_images_are_renamed_with_the_raw_ones_unless_named_themselves(ros1: Ros1Graph) -> None:
    options = ["recognition", "_image_transport:=compressed", "image_raw:=/front/image"]
    ros1.node(*options, "__name:=beneath", name="/beneath")
    eventually(lambda: "/beneath" in ros1.listeners("/front/image/compressed"))
    ros1.node(*options, "__name:=named", "image_raw/compressed:=/jpeg", name="/named")
    eventually(lambda: "/named" in ros1.listeners("/jpeg"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["control", "_linear_stepp:=0.1"],
            "ROS parameter /hand_sign_control/linear_stepp: there is no such parameter",
        ),
        (["control", "_linear_step:=7"], "ROS parameter /hand_sign_control/linear_step: 7 should be less than or eq"),
        (["control", "_linear_step:=quick"], "ROS parameter /hand_sign_control/linear_step: 'quick' should be a valid"),
        (
            ["camera", "_virtual_hand/skn:=dark"],
            "ROS parameter /my_camera/virtual_hand/skn: there is no such parameter",
        ),
        (["camera", "_source:=gone.mp4"], "there is no camera gone.mp4"),
        (["control", "fast"], "'fast' is no argument of ROS: it should be as name:=value"),
        (["control", "--control.linear-step", "7"], "control.linear_step: '7' should be less than or equal to 1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_is_wrong_is_said_in_one_line(ros1: Ros1Graph, arguments: list[str], message: str) -> None:
    verb, *rest = arguments
    process = ros1.handsteer(verb, "--transport", "ros1", *rest)
    assert process.code() == 2, process.text
    for name in ("hand_sign_control/linear_stepp", "hand_sign_control/linear_step", "my_camera"):
        with_name = f"/{name}"
        if ros1.master.hasParam("/test", with_name)[2]:
            ros1.master.deleteParam("/test", with_name)
    assert [line for line in process.text.splitlines() if line.startswith(f"handsteer: {message}")], process.text
    assert "Traceback" not in process.text


def test_options_go_before_ros_parameters_before_the_file(ros1: Ros1Graph, tmp_path: Any) -> None:
    file = tmp_path / "my.yaml"
    file.write_text("control: {linear_step: 0.02, angular_step: 0.2, max_linear: 3.0}\n")
    driver = Driver(
        ros1, "--config", str(file), "_linear_step:=0.03", "_angular_step:=0.3", "--control.angular-step=0.4"
    )
    driver.show("Forward")
    driver.show("Turn Left")
    driver.expect((0.03, 0.0), (0.03, 0.4))


def test_without_a_master_it_ends_at_once(ros1: Ros1Graph) -> None:
    for uri in ("http://localhost:1", "nonsense"):
        process = ros1.run(
            "env", f"ROS_MASTER_URI={uri}", sys.executable, "-m", "handsteer", "control", "--transport", "ros1"
        )
        assert process.code(20.0) == 2
        assert uri in process.text
        assert "ROS_MASTER_URI" in process.text
        assert "Traceback" not in process.text


def test_when_the_master_goes_away_the_robot_is_stopped(tmp_path: Any) -> None:
    with ros1_graph(tmp_path) as graph:
        driver = Driver(graph, "--control.sign-timeout", "5")
        driver.show("Forward")
        driver.expect((0.01, 0.0))
        graph.stop_master()
        assert driver.control.code() == 2
        driver.expect((0.01, 0.0), (0.0, 0.0))
        assert "no ROS master answers" in driver.control.text


@pytest.fixture
def running(tmp_path: Any) -> Iterator[tuple[Ros1Graph, Peer, dict[str, Process]]]:
    """The whole graph, the robot driving forward."""
    with ros1_graph(tmp_path) as graph:
        peer = graph.peer()
        record_twists(peer)
        peer.ask(
            "record",
            topic="/robot_diff_drive_controller/odom",
            package="nav_msgs",
            type="Odometry",
            fields=["header.stamp", "twist.twist.linear.x"],
        )
        nodes = {
            "robot": graph.node("robot", name="/robot"),
            "control": graph.node("control", "_max_linear:=0.3", name=f"/{NODE}"),
            "recognition": graph.node("recognition", name="/hand_sign_recognition"),
            "camera": graph.node("camera", *FORWARD, name="/my_camera"),
        }
        eventually(lambda: speeds(peer) and speeds(peer)[-1][1] > 0.25, what="the robot to drive")
        yield graph, peer, nodes


def speeds(peer: Peer) -> list[tuple[float, float]]:
    return [(at_s, values[1]) for at_s, values in peer.ask("get", topic="/robot_diff_drive_controller/odom")]


@pytest.mark.parametrize("victim", ["camera", "recognition", "control"])
def test_kill_9_of_any_node_stops_the_robot(running: tuple[Ros1Graph, Peer, dict[str, Process]], victim: str) -> None:
    _, peer, nodes = running
    killed_s = time.monotonic()
    nodes[victim].popen.kill()
    eventually(lambda: abs(speeds(peer)[-1][1]) < 0.01, 5.0, what="the robot to stand")
    if victim == "control":
        # No Twist can come any more: the robot's controller brakes by itself.
        braked_s = next(at_s for at_s, speed in speeds(peer) if at_s > killed_s and speed < 0.28)
        assert braked_s - killed_s <= LIMIT_S + 0.05  # the speed has to fall before it can be seen to fall
    else:
        zero_s = next(at_s for at_s, twist in twists(peer) if at_s > killed_s and twist == (0.0, 0.0))
        assert zero_s - killed_s <= LIMIT_S
        time.sleep(0.3)
        assert {twist for at_s, twist in twists(peer) if at_s > zero_s} <= {(0.0, 0.0)}


def test_a_robot_that_was_frozen_does_not_drive_on(running: tuple[Ros1Graph, Peer, dict[str, Process]]) -> None:
    _, peer, nodes = running
    nodes["robot"].freeze()
    nodes["control"].popen.kill()
    time.sleep(1.0)
    resumed_s = time.monotonic()
    nodes["robot"].signal(signal.SIGCONT)
    eventually(lambda: abs(speeds(peer)[-1][1]) < 0.01, 5.0, what="the robot to stand")
    stood_s = next(at_s for at_s, speed in speeds(peer) if at_s > resumed_s and abs(speed) < 0.01)
    assert stood_s - resumed_s < 0.6  # 0.3 m/s at 1 m/s², and no more


def test_the_page_is_served_and_knows_the_nodes(ros1: Ros1Graph) -> None:
    steering = ros1.node(
        "steering", "--port", "0", "--dashboard.no-open-browser", "__ns:=/paged", name="/paged/steering"
    )
    address = eventually(lambda: "http://" in steering.text and steering.text.partition("page is at ")[2].split()[0])
    with urllib.request.urlopen(address, timeout=20) as page:
        assert b"handsteer" in page.read()
    steering.signal(signal.SIGTERM)
    assert steering.code() == 0


def test_recognition_of_compressed_images(ros1: Ros1Graph) -> None:
    peer = ros1.peer()
    peer.ask("record", topic="/jpeg/gesture/hand_sign", package="std_msgs", type="String", fields=["data"])
    ros1.node("recognition", "__ns:=/jpeg", "_image_transport:=compressed", name="/jpeg/hand_sign_recognition")
    ros1.node("camera", "__ns:=/jpeg", *FORWARD, name="/jpeg/my_camera")
    eventually(lambda: ["Forward"] in [values for _, values in peer.ask("get", topic="/jpeg/gesture/hand_sign")])
    assert "/jpeg/hand_sign_recognition" not in ros1.listeners("/jpeg/image_raw")
