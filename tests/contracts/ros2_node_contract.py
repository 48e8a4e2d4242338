"""What our nodes must do as processes in every graph of ROS 2; each transport's own test module inherits it."""

from functools import partial
from typing import Any

import pytest

from tests.contracts.node_contract import CMD_VEL, FORWARD, ODOM, ControlContract, MakeDriver
from tests.dds.driver import DdsDriver, PeerGraph
from tests.processes import eventually


class Ros2NodeContract(ControlContract):
    """Inherit, and provide ``graph``.

    Attributes:
        images: A topic of a camera whose images reach the plain program, and its type.
    """

    images = ("image_raw", "Image")

    @pytest.fixture
    def graph(self) -> PeerGraph:
        raise NotImplementedError

    @pytest.fixture
    def drive(self, graph: PeerGraph) -> MakeDriver:
        return partial(DdsDriver, graph)

    def test_what_is_no_text_does_not_end_the_node(self, graph: PeerGraph) -> None:
        driver = DdsDriver(graph)
        driver.show_raw(b"\x00\x01\x00\x00\x03\x00\x00\x00\xff\xfe\x00\x00")
        driver.show("Turn Left")
        driver.expect((0.0, 0.1))
        assert "a message of 12 bytes cannot be read" in driver.process.text
        assert "Traceback" not in driver.process.text

    def test_a_late_subscriber_gets_the_description_of_the_robot(self, graph: PeerGraph) -> None:
        topic = "/late/robot_description"
        graph.node("robot", name="/late/robot", ros=("-r", "__ns:=/late"))
        eventually(lambda: graph.publishes("/late/robot", topic))
        graph.peer.ask("record", topic=topic, type="String", fields=["data"], latched=True)
        [[_, [description]]] = eventually(lambda: graph.peer.ask("get", topic=topic))
        assert "<robot" in description

    def test_a_robot_follows_another_programs_twists(self, graph: PeerGraph) -> None:
        peer, odom = graph.peer, f"/lone{ODOM}"
        graph.node("robot", name="/lone/robot", ros=("-r", "__ns:=/lone", "-r", f"{CMD_VEL[1:]}:=/lone/cmd_vel"))
        fields = ["twist.twist.angular.z", "pose.pose.orientation.z"]
        peer.ask("record", topic=odom, type="Odometry", fields=fields, reliable=False)
        peer.ask("advertise", topic="/lone/cmd_vel", type="Twist")
        eventually(lambda: peer.ask("listeners", topic="/lone/cmd_vel") > 0)
        eventually(lambda: peer.ask("get", topic=odom))

        def turns_left() -> bool:
            peer.ask("publish", topic="/lone/cmd_vel", values={"angular.z": 0.5}, count=10, period_s=0.05)
            noted: list[Any] = [values for _, values in peer.ask("get", topic=odom)]
            return bool(noted[-1][1] > 0.1 and max(speed for speed, _ in noted) == pytest.approx(0.5, abs=0.05))

        eventually(turns_left, 20.0, what="the robot to turn")
        eventually(lambda: abs(peer.ask("get", topic=odom)[-1][1][0]) < 0.01, 5.0, what="the robot to stand")

    def test_simulated_time_is_followed(self, graph: PeerGraph) -> None:
        peer, (name, kind) = graph.peer, self.images
        topic = f"/simulated/{name}"
        peer.ask("advertise", topic="/clock", type="Clock", reliable=False, depth=1)
        peer.ask("record", topic=topic, type=kind, fields=["header.stamp"], reliable=False)
        words = ("-r", "__ns:=/simulated", "-p", "use_sim_time:=true")
        camera = graph.node("camera", *FORWARD, name="/simulated/my_camera", ros=words)
        eventually(lambda: peer.ask("listeners", topic="/clock") > 0)
        peer.ask("run_clock", from_s=1000.0, seconds=30.0)
        eventually(lambda: [v for _, (v,) in peer.ask("get", topic=topic) if 1000.0 < v < 1040.0], 15.0)
        assert camera.running
