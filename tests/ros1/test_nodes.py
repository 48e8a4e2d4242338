"""Our nodes as processes in a real ROS 1 graph, seen by plain rospy nodes and ROS's own tools."""

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import pytest

from tests.contracts.node_contract import (
    CMD_VEL,
    LIMIT_S,
    ODOM,
    PATIENT,
    RUN,
    VIRTUAL,
    ChainContract,
    ControlContract,
    Driver,
    MakeDriver,
    Running,
    Twists,
    expect_a_run_to_drive,
    twists,
)
from tests.processes import Peer, eventually
from tests.ros1.graph import Ros1Graph, ros1_graph

pytestmark = [pytest.mark.ros1, pytest.mark.slow]

SCRIPT = "_virtual_hand/script:=Forward:25 Stop:1.5"
"""Neutral again and again: a pause of a busy machine may have required it."""

numbers = itertools.count()


class Ros1Driver(Driver):
    def __init__(self, graph: Ros1Graph, *options: str, parameters: Mapping[str, Any] | None = None) -> None:
        self.namespace = f"/n{next(numbers)}"
        words = [f"_{name}:={value}" for name, value in (parameters or {}).items()]
        name = f"{self.namespace}/{NODE}"
        self.process = graph.node("control", f"__ns:={self.namespace}", *options, *words, name=name)
        self._peer = graph.peer(f"__ns:={self.namespace}")
        record_twists(self._peer, f"{self.namespace}{CMD_VEL}")
        self._peer.ask("advertise", topic="gesture/hand_sign", package="std_msgs", type="String")
        self._peer.ask("advertise", topic="gesture/joy", package="sensor_msgs", type="Joy")
        heard = "gesture/joy" if (parameters or {}).get("mode") == "joystick" else "gesture/hand_sign"
        eventually(lambda: self._peer.ask("listeners", topic=heard) > 0)
        eventually(lambda: graph.connected(name, f"{self.namespace}{CMD_VEL}"))

    def show(self, sign: str, count: int = 1, period_s: float = 0.02) -> None:
        values = {"data": sign}
        self._peer.ask("publish", topic="gesture/hand_sign", values=values, count=count, period_s=period_s)

    def hold(self, left: float, forward: float, *, held: bool = True) -> None:
        values = {"axes": [left, forward], "buttons": [int(held)]}
        self._peer.ask("publish", topic="gesture/joy", values=values, period_s=0.02)

    def interfere(self) -> None:
        self._peer.ask("advertise", topic=f"{self.namespace}{CMD_VEL}", package="geometry_msgs", type="Twist")

    @property
    def commands(self) -> Twists:
        return twists(self._peer, f"{self.namespace}{CMD_VEL}")


NODE = "hand_sign_control"


def record_twists(peer: Peer, topic: str = CMD_VEL) -> None:
    peer.ask("record", topic=topic, package="geometry_msgs", type="Twist", fields=["linear.x", "angular.z"])


class TestControl(ControlContract):
    @pytest.fixture
    def drive(self, ros1: Ros1Graph) -> MakeDriver:
        return partial(Ros1Driver, ros1)


def test_rostopic_pub_gives_one_twist(ros1: Ros1Graph) -> None:
    driver = Ros1Driver(ros1, *PATIENT)
    topic = f"{driver.namespace}/gesture/hand_sign"
    publish = ros1.run("rostopic", "pub", "-1", topic, "std_msgs/String", "data: 'Turn Left'")
    driver.expect((0.0, 0.1))
    publish.kill()


class AfterALatchedMessage:
    """A control that starts while ``rostopic pub`` keeps a message for whoever subscribes, and a peer beside it."""

    def __init__(self, graph: Ros1Graph, topic: str, kind: str, values: str) -> None:
        self.space, self._graph = f"/n{next(numbers)}", graph
        latched, name = f"{self.space}/{topic}", f"{self.space}/{NODE}"
        graph.run("rostopic", "pub", latched, kind, values)
        eventually(lambda: graph.talkers(latched))
        (publisher,) = graph.talkers(latched)
        self.peer = graph.peer(f"__ns:={self.space}")
        record_twists(self.peer, f"{self.space}{CMD_VEL}")
        graph.node("control", f"__ns:={self.space}", name=name)
        eventually(lambda: graph.connected(name, f"{self.space}{CMD_VEL}"))
        eventually(lambda: graph.connected(publisher, latched))

    @property
    def commands(self) -> set[tuple[float, float]]:
        return {velocity for _, velocity in twists(self.peer, f"{self.space}{CMD_VEL}")}


def test_a_sign_that_was_latched_before_the_control_started_moves_nothing(ros1: Ros1Graph) -> None:
    after = AfterALatchedMessage(ros1, "gesture/hand_sign", "std_msgs/String", "data: 'Turn Left'")
    time.sleep(1.0)
    assert after.commands <= {(0.0, 0.0)}
    ros1.run("rostopic", "pub", "-1", f"{after.space}/gesture/hand_sign", "std_msgs/String", "data: 'Turn Left'")
    eventually(lambda: (0.0, 0.1) in after.commands, what="a sign that is latched now to count")


def test_a_zero_that_was_latched_before_the_control_started_is_not_a_release(ros1: Ros1Graph) -> None:
    after = AfterALatchedMessage(ros1, "steering/cmd_vel", "geometry_msgs/Twist", "{}")
    after.peer.ask("advertise", topic="steering/cmd_vel", package="geometry_msgs", type="Twist")
    eventually(lambda: after.peer.ask("listeners", topic="steering/cmd_vel") > 0)
    held = {"topic": "steering/cmd_vel", "values": {"linear.x": 0.3}, "count": 20, "period_s": 0.05}
    after.peer.ask("publish", **held)
    assert after.commands <= {(0.0, 0.0)}
    after.peer.ask("publish", topic="steering/cmd_vel", values={"linear.x": 0.0})
    after.peer.ask("publish", **held)
    eventually(lambda: (0.3, 0.0) in after.commands, what="a release that is shown now to count")


def test_the_control_is_stopped_reset_and_asked_by_rosservice(ros1: Ros1Graph) -> None:
    driver = Ros1Driver(ros1, *PATIENT)
    node = f"{driver.namespace}/{NODE}"

    def call(service: str) -> list[str]:
        done = subprocess.run(
            ["rosservice", "call", f"{node}/{service}"], env=ros1.env, check=True, capture_output=True, text=True
        )
        return done.stdout.splitlines()

    driver.show("Forward", count=2)
    driver.expect((0.01, 0.0), (0.02, 0.0))
    assert call("stop") == ["success: True", 'message: "stopped, until it is reset"']
    driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))
    assert call("engage_state") == ["success: True", 'message: "engaged; stopped, until it is reset"']
    assert call("reset") == ["success: True", 'message: "reset"']
    driver.show("Stop")
    driver.show("Forward")
    eventually(lambda: driver.twists[-1] == (0.01, 0.0), what="the robot to be driven")


def test_one_zero_when_ros_ends_the_node(ros1: Ros1Graph) -> None:
    driver = Ros1Driver(ros1, *PATIENT)
    driver.show("Forward")
    driver.expect((0.01, 0.0))
    subprocess.run(["rosnode", "kill", f"{driver.namespace}/{NODE}"], env=ros1.env, check=True, capture_output=True)
    assert driver.process.code() == 0, driver.process.text
    driver.expect((0.01, 0.0), (0.0, 0.0))


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


def test_camera_info_lies_beside_the_images(ros1: Ros1Graph) -> None:
    ros1.node("camera", *VIRTUAL, "__name:=beside", "image_raw:=/front/image", name="/beside")
    eventually(lambda: "/beside" in ros1.talkers("/front/camera_info"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["control", "_control_topic:=7"], "ROS parameter /hand_sign_control/control_topic: 7 should be the name of a"),
        (["recognition", "_show_image:=maybe"], "ROS parameter /hand_sign_recognition/show_image: 'maybe' should be"),
        (["control", "_linear_step:=7"], "ROS parameter /hand_sign_control/linear_step: 7 should be less than or eq"),
        (["control", "_linear_step:=quick"], "ROS parameter /hand_sign_control/linear_step: 'quick' should be a valid"),
        (["camera", "_virtual_hand/skin:=green"], "ROS parameter /my_camera/virtual_hand/skin: 'green' should be"),
        (["camera", "_source:=gone.mp4"], "there is no camera gone.mp4"),
        (["control", "fast"], "'fast' is not a valid argument of ROS: it should be as name:=value"),
        (["control", "__ns:=9x"], "'9x', for '__ns', is not a valid name of ROS"),
        (["control", "_joy:=null"], "'null', for '_joy', is not a valid value of ROS 1: cannot marshal None"),
        (["control", "_actions:={1: stop}"], "'{1: stop}', for '_actions', is not a valid value of ROS 1: dictionary"),
        (
            ["control", "_max_linear:=99999999999"],
            "'99999999999', for '_max_linear', is not a valid value of ROS 1",
        ),
        (["control", "__name:=a/b"], "'a/b', for '__name', is not a valid name of ROS"),
        (["control", "gesture/hand_sign:=a b"], "'a b', for 'gesture/hand_sign', is not a valid name of ROS"),
        (["control", "--control.linear-step", "7"], "control.linear_step: '7' should be less than or equal to 1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_is_wrong_is_said_in_one_line(ros1: Ros1Graph, arguments: list[str], message: str) -> None:
    verb, *rest = arguments
    process = ros1.handsteer(verb, "--transport", "ros1", *rest)
    assert process.code() == 2, process.text
    for name in ("hand_sign_control", "hand_sign_recognition", "my_camera"):
        with_name = f"/{name}"
        if ros1.master.hasParam("/test", with_name)[2]:
            ros1.master.deleteParam("/test", with_name)
    assert [line for line in process.text.splitlines() if line.startswith(f"handsteer: {message}")], process.text
    assert "Traceback" not in process.text


def test_a_parameter_that_is_not_known_is_said_and_does_nothing(ros1: Ros1Graph) -> None:
    parameters = {"linear_stepp": 0.5, "robot_description": "robot", "linear_step": 0.02}
    driver = Ros1Driver(ros1, *PATIENT, parameters=parameters)
    driver.show("Forward")
    driver.expect((0.02, 0.0))
    text = driver.process.text
    assert text.count(f"ignoring unknown ROS parameter {driver.namespace}/{NODE}/linear_stepp") == 1
    assert text.count("did you mean linear_step?") == 1
    assert text.count(f"ignoring unknown ROS parameter {driver.namespace}/{NODE}/robot_description") == 1


def test_without_a_master_it_ends_at_once(ros1: Ros1Graph) -> None:
    for uri in ("http://localhost:1", "http://localhost:99999", "http://localhost:port", "nonsense"):
        process = ros1.run(
            "env", f"ROS_MASTER_URI={uri}", sys.executable, "-m", "handsteer", "control", "--transport", "ros1"
        )
        assert process.code() == 2
        assert uri in process.text
        assert "ROS_MASTER_URI" in process.text
        assert "Traceback" not in process.text


def test_when_the_master_goes_away_the_robot_is_stopped(tmp_path: Any) -> None:
    with ros1_graph(tmp_path) as graph:
        driver = Ros1Driver(graph, *PATIENT)
        driver.show("Forward")
        driver.expect((0.01, 0.0))
        graph.stop_master()
        assert driver.process.code() == 2
        driver.expect((0.01, 0.0), (0.0, 0.0))
        assert "no ROS master answers" in driver.process.text


def test_kill_9_of_the_master_stops_a_robot_that_is_being_driven_faster(tmp_path: Any) -> None:
    killed_s: list[float] = []

    with ros1_graph(tmp_path) as graph:
        driver = Ros1Driver(graph)

        def kill() -> None:
            graph.kill_master()
            killed_s.append(time.monotonic())

        killer = threading.Timer(1.0, kill)
        killer.start()
        driver.show("Forward", count=150)
        killer.join()
        assert driver.process.code() == 2
        assert "it has gone away, so this node ends" in driver.process.text
        assert "Traceback" not in driver.process.text
        at_s, last = driver.commands[-1]
        assert last == (0.0, 0.0)
        assert at_s - killed_s[0] <= LIMIT_S


def test_a_master_that_only_takes_long_is_waited_for(tmp_path: Any) -> None:
    with ros1_graph(tmp_path) as graph:
        driver = Ros1Driver(graph, *PATIENT)
        # Before its first command, the control asks the master what the robot takes.
        driver.show("NONE")
        driver.expect((0.0, 0.0))
        pid = graph.master.getPid("/test")[2]
        os.kill(pid, signal.SIGSTOP)
        try:
            for shown in range(8, 81, 8):  # a node keeps ten that wait
                driver.show("Forward", count=8, period_s=0.04)
                driver.expect(*[(round(0.01 * n, 6), 0.0) for n in range(shown + 1)])
        finally:
            os.kill(pid, signal.SIGCONT)
        assert driver.process.running


def test_another_master_in_the_status_of_the_first_is_not_taken_for_it(tmp_path: Any) -> None:
    with ros1_graph(tmp_path) as graph:
        driver = Ros1Driver(graph, *PATIENT)
        driver.show("Forward")
        driver.expect((0.01, 0.0))
        graph.restart_master()
        assert driver.process.code() == 2
        driver.expect((0.01, 0.0), (0.0, 0.0))


def test_a_stop_outlives_the_master(tmp_path: Any) -> None:
    with ros1_graph(tmp_path) as graph:

        def call(service: str) -> str:
            command = ["rosservice", "call", f"/{NODE}/{service}"]
            return subprocess.run(command, env=graph.env, check=False, capture_output=True, text=True).stdout

        control = graph.node("control", *PATIENT, name=f"/{NODE}")
        eventually(lambda: "success: True" in call("stop"), what="its services")
        graph.restart_master()
        assert control.code() == 2
        control = graph.node("control", *PATIENT, name=f"/{NODE}")
        eventually(lambda: "stopped, until it is reset" in call("engage_state"), what="it to be stopped")
        assert "stays stopped until it is reset" in control.text
        call("reset")
        eventually(lambda: "until it is reset" not in call("engage_state"), what="it to be reset")
        graph.restart_master()
        assert control.code() == 2
        control = graph.node("control", *PATIENT, name=f"/{NODE}")
        eventually(lambda: "engaged" in call("engage_state"), what="its services")
        assert "until it is reset" not in call("engage_state") + control.text


class TestChain(ChainContract):
    @pytest.fixture(scope="class")
    @classmethod
    def chain(cls, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
        with ros1_graph(tmp_path_factory.mktemp("chain")) as graph:
            peer = graph.peer()
            record_twists(peer)
            fields = ["twist.twist.linear.x", "pose.pose.position.x"]
            peer.ask("record", topic=ODOM, package="nav_msgs", type="Odometry", fields=fields)
            start = {
                "robot": lambda: graph.node("robot", "--world", "empty", name="/robot"),
                "control": lambda: graph.node("control", "_max_linear:=0.3", name=f"/{NODE}"),
                "recognition": lambda: graph.node("recognition", name="/hand_sign_recognition"),
                "camera": lambda: graph.node("camera", *VIRTUAL, SCRIPT, name="/my_camera"),
            }
            yield Running(peer, start)


def test_a_run_drives_a_robot_of_the_graph(ros1: Ros1Graph) -> None:
    odom, peer = f"/real{ODOM}", ros1.peer()
    fields = ["twist.twist.linear.x", "pose.pose.position.x"]
    peer.ask("record", topic=odom, package="nav_msgs", type="Odometry", fields=fields)
    ros1.node("robot", "__ns:=/real", name="/real/robot")
    words = (f"cmd_vel:=/real{CMD_VEL}", f"odom:={odom}")
    expect_a_run_to_drive(ros1.handsteer("run", *RUN, "--robot", "ros1", *words), peer, odom)


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
    ros1.node("camera", "__ns:=/jpeg", *VIRTUAL, SCRIPT, name="/jpeg/my_camera")
    eventually(lambda: ["Forward"] in [values for _, values in peer.ask("get", topic="/jpeg/gesture/hand_sign")])
    assert "/jpeg/hand_sign_recognition" not in ros1.listeners("/jpeg/image_raw")
