"""Recordings among nodes of a real ROS 2: played into rclpy, and made of what rclpy publishes."""

import signal
from pathlib import Path

import pytest

from handsteer.recordings.mcap_reader import McapFile
from tests.processes import eventually
from tests.ros2.graph import PYTHON, ros2_graph

pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]


@pytest.mark.parametrize("transport", ["ros2", "dds"])
def test_a_recording_is_played_into_rclpy_and_recorded_from_it(transport: str, recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    with ros2_graph(tmp_path, transport) as graph:
        graph.peer.ask("record", topic="/image_raw", type="Image", fields=["width", "height", "encoding"])
        graph.peer.ask("advertise", topic="/gesture/hand_sign", type="String")
        recorder = graph.handsteer("record", str(copy), "--transport", transport)
        eventually(lambda: graph.peer.ask("listeners", topic="/gesture/hand_sign") > 0, what="the recorder to listen")
        graph.node("camera", "--camera", str(recording), name="/my_camera")
        eventually(lambda: len(graph.peer.ask("get", topic="/image_raw")) > 30, what="pictures in rclpy")
        assert {tuple(seen) for _, seen in graph.peer.ask("get", topic="/image_raw")} == {(640, 480, "bgr8")}
        graph.peer.ask("publish", topic="/gesture/hand_sign", values={"data": "Forward"}, count=20, period_s=0.1)
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
