"""``handsteer run --robot …`` drives a node of a real ROS 2 that stands for the robot, whichever commands it takes."""

import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import eventually
from tests.ros2.graph import PYTHON, Ros2Graph, ros2_graph

pytest.importorskip("cyclonedds")
pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]

CAMERA = ("--headless", "--json", "--camera", "virtual", "--camera.width", "320", "--camera.height", "240")
FIELDS = {"TwistStamped": ["twist.linear.x", "header.stamp", "header.frame_id"], "Twist": ["linear.x"]}


@pytest.fixture(params=("ros2", "dds"))
def ros2(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ros2Graph]:
    with ros2_graph(tmp_path, request.param) as graph:
        yield graph


@pytest.mark.parametrize("kind", list(FIELDS))
def test_a_robot_of_a_real_ros2_is_driven_as_it_takes_commands(ros2: Ros2Graph, kind: str) -> None:
    peer = ros2.peer
    peer.ask("record", topic="/cmd_vel", type=kind, fields=FIELDS[kind])
    peer.ask("advertise", topic="/odom", type="Odometry", depth=5)
    # It stands still, which a control notices that tells it to go faster than this.
    words = ("--virtual-hand.script", "Stop:6 Forward:60", "--control.max-linear", "0.09", "--robot.odom-timeout", "10")
    process = ros2.handsteer("run", *CAMERA, "--robot", ros2.transport, *words)
    eventually(lambda: peer.ask("listeners", topic="/odom") or not process.running)
    assert process.running, process.text
    # Both ends have found each other only when each has seen the other, which takes Fast DDS up to three seconds.
    peer.ask("publish", topic="/odom", values={"pose.pose.position.x": 1.5}, count=100, period_s=0.05)
    eventually(lambda: peer.ask("get", topic="/cmd_vel")[-1:] and peer.ask("get", topic="/cmd_vel")[-1][1][0] == 0.09)
    _, (_, *header) = peer.ask("get", topic="/cmd_vel")[-1]
    if kind == "TwistStamped":
        stamp_s, frame = header
        assert abs(stamp_s - time.time()) < 5.0
        assert frame == "base_link"
    process.signal(signal.SIGTERM)
    assert process.code() == 0, process.text
    summary = json.loads(next(line for line in process.text.splitlines() if line.startswith("{")))
    assert summary["final_pose"] == {"x": 1.5, "y": 0.0, "yaw": 0.0}
    eventually(lambda: [speed for _, (speed, *_) in peer.ask("get", topic="/cmd_vel")][-3:] == [0.0] * 3, 5.0)
