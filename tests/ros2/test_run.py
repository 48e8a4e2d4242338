"""``handsteer run --robot …`` and ``handsteer record`` among nodes of a real ROS 2."""

import json
import signal
import time
from pathlib import Path

import pytest

from handsteer.plugins.record.mcap_reader import McapFile
from tests.contracts.node_contract import VIRTUAL
from tests.processes import eventually
from tests.ros2.graph import NEEDS_ROS2, Ros2Graph

pytest.importorskip("cyclonedds")
pytestmark = NEEDS_ROS2

CAMERA = ("--headless", "--json", *VIRTUAL)
FIELDS = {"TwistStamped": ["twist.linear.x", "header.stamp", "header.frame_id"], "Twist": ["linear.x"]}


@pytest.mark.parametrize("kind", list(FIELDS))
def test_a_robot_of_a_real_ros2_is_driven_as_it_takes_commands(fresh: Ros2Graph, kind: str) -> None:
    peer = fresh.peer
    peer.ask("record", topic="/cmd_vel", type=kind, fields=FIELDS[kind])
    peer.ask("advertise", topic="/odom", type="Odometry", depth=5)
    # It stands still, which a control notices that tells it to go faster than this.
    words = ("--virtual-hand.script", "Stop:6 Forward:60", "--control.max-linear", "0.09", "--robot.odom-timeout", "10")
    process = fresh.handsteer("run", *CAMERA, "--robot", fresh.transport, *words, "--control.engage-by", "hold")
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


def test_a_recording_is_played_into_rclpy_and_recorded_from_it(
    fresh: Ros2Graph, recording: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy.mcap"
    fresh.peer.ask("record", topic="/image_raw", type="Image", fields=["width", "height", "encoding"])
    fresh.peer.ask("advertise", topic="/gesture/hand_sign", type="String")
    recorder = fresh.handsteer("record", str(copy), "--transport", fresh.transport)
    eventually(lambda: fresh.peer.ask("listeners", topic="/gesture/hand_sign") > 0, what="the recorder to listen")
    fresh.node("camera", "--camera", str(recording), name="/my_camera")
    eventually(lambda: len(fresh.peer.ask("get", topic="/image_raw")) > 30, what="pictures in rclpy")
    assert {tuple(seen) for _, seen in fresh.peer.ask("get", topic="/image_raw")} == {(640, 480, "bgr8")}
    fresh.peer.ask("publish", topic="/gesture/hand_sign", values={"data": "Forward"}, count=20, period_s=0.1)
    eventually(lambda: copy.stat().st_size > 500_000 or not recorder.running, what="pictures in the recording")
    recorder.signal(signal.SIGINT)
    assert recorder.code() == 0, recorder.text
    file = McapFile(copy)
    kinds = {(recorded.topic, recorded.type) for recorded in file.messages()}
    assert file.problem is None
    assert ("/image_raw/compressed", "sensor_msgs/msg/CompressedImage") in kinds
    signs = [recorded.message.data for recorded in file.messages({"/gesture/hand_sign"})]
    assert set(signs) == {"Forward"}
    assert len(signs) >= 10
