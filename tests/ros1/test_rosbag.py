"""A camera's images in a bag of the real rosbag: played again, they give the same signs, and drive."""

import shutil
import signal
import time
from collections.abc import Callable
from itertools import dropwhile, groupby
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from tests.bags import BUSY, FRAMES, PLAYS, frames
from tests.bags import SHOWN as SHOWN_IN_BAG
from tests.processes import eventually
from tests.ros1.launches import LaunchGraph, Recorder

pytestmark = [
    pytest.mark.ros1,
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("rosbag"), reason="there is no rosbag: make ros1"),
]

HAND_SIGN = "/gesture/hand_sign"
ODOM = "/robot_diff_drive_controller/odom"
TOPICS = {HAND_SIGN: "std_msgs/String", ODOM: "nav_msgs/Odometry"}
IMAGE = "sensor_msgs/msg/Image"
PACKAGE = "ros_hand_gesture_recognition"
SHOWN = ["Stop", "Forward", "Turn Left"]


def order(record: Recorder, since_s: float) -> list[str]:
    """Return the signs that lasted for some frames, in their order, without those where no hand was seen."""
    words = [str(sign["word"]) for sign in record.of(HAND_SIGN, since_s)]
    lasted = [word for word, group in groupby(words) if len(list(group)) >= 4 and word != "NONE"]
    return [word for word, _ in groupby(lasted)]


def bag_of_the_drawn_hand(ros: LaunchGraph, record: Recorder, path: Path) -> None:
    """Record what the camera shows while it drives the robot live."""
    script = "Stop:4 Forward:4 Turn Left:4 NONE:600"
    for name, value in {"virtual_hand/script": script, "width": 320, "height": 240, "fps": 10}.items():
        ros.set_parameter(f"/my_camera/{name}", value)
    recorder = ros.run("rosbag", "record", "-O", str(path), "/image_raw")
    eventually(lambda: any(name.startswith("/record_") for name in ros.nodes()), what="rosbag record")
    camera = ros.run("rosrun", "my_cam", "image_publisher.py", "_source:=virtual")
    eventually(lambda: order(record, 0.0) == SHOWN, what="the signs, live")
    # The last sign to its end: what is cut off here could be too short to be seen again.
    eventually(lambda: record.of(HAND_SIGN)[-1]["word"] == "NONE", what="the hand to be gone")
    camera.signal(signal.SIGINT)
    camera.code()
    recorder.signal(signal.SIGINT)
    recorder.code()
    eventually(path.exists, what="the bag")


def test_a_bag_drives_as_the_camera_did(ros: LaunchGraph, tmp_path: Path) -> None:
    bag = tmp_path / "drive.bag"
    record = ros.record(TOPICS)
    ros.launch("ros_mobile_robot", "drive_robot.launch", "world:=empty")
    recognition = ros.run("rosrun", PACKAGE, "hand_sign_recognition.py")
    ros.run("rosrun", PACKAGE, "sign_to_controller.py")
    eventually(lambda: "/hand_sign_recognition" in ros.listeners("/image_raw"), what="the recognition")
    eventually(lambda: "/hand_sign_control" in ros.listeners(HAND_SIGN), what="the control")
    eventually(lambda: record.of(ODOM), what="the robot")
    bag_of_the_drawn_hand(ros, record, bag)
    eventually(lambda: abs(record.of(ODOM)[-1]["linear"]) < 0.01, what="the robot to stand")

    played_s = time.monotonic()
    ros.tell("rosbag", "play", "--delay", "1", str(bag))
    assert order(record, played_s) == SHOWN
    assert max(odom["linear"] for odom in record.of(ODOM, played_s)) > 0.05
    assert "they are followed, as a recording's" in recognition.text
    eventually(lambda: record.of(HAND_SIGN)[-1]["word"] == "NONE", what="NONE once it has ended")
    eventually(lambda: abs(record.of(ODOM)[-1]["linear"]) < 0.01, what="the robot to stand")


def test_a_bag_that_comes_by_another_node_is_followed_when_asked_for(ros: LaunchGraph, tmp_path: Path) -> None:
    """As from ``image_transport republish``: nothing tells that it is a player's."""
    bag = tmp_path / "drive.bag"
    record = ros.record({HAND_SIGN: "std_msgs/String", "/careful": "std_msgs/String"})
    ros.run("rosrun", PACKAGE, "hand_sign_recognition.py", "__name:=willing", "_recorded:=always")
    eventually(lambda: ros.listeners("/image_raw"), what="the recognition")
    bag_of_the_drawn_hand(ros, record, bag)
    # One that has seen the camera itself would take the bag for the camera with another clock.
    careful = ["__name:=careful", "_publish_gesture_topic:=/careful"]
    recognition = ros.run("rosrun", PACKAGE, "hand_sign_recognition.py", *careful)
    eventually(lambda: "/careful" in ros.listeners("/image_raw"), what="the other recognition")

    played_s = time.monotonic()
    # Older than any link delays, by its first frame: the bag itself is longer.
    ros.tell("rosbag", "play", "--delay", "1", str(bag), "__name:=republish")
    assert order(record, played_s) == SHOWN
    assert {sign["word"] for sign in record.of("/careful", played_s)} == {"NONE"}
    assert "set the parameter recorded to always" in recognition.text


def bag_of_frames(path: Path) -> None:
    """Write a bag of raw images, of another day."""
    types = get_typestore(Stores.ROS1_NOETIC)
    header, image, time_ = (types.types[name] for name in ("std_msgs/msg/Header", IMAGE, "builtin_interfaces/msg/Time"))
    with Writer(path) as writer:
        connection = writer.add_connection("/image_raw", IMAGE, typestore=types)
        for number, (stamp_ns, bgr) in enumerate(frames()):
            stamp = time_(stamp_ns // 10**9, stamp_ns % 10**9)
            message = image(header(number, stamp, ""), 240, 320, "bgr8", 0, 960, bgr.reshape(-1))
            writer.write(connection, stamp_ns, types.serialize_ros1(message, IMAGE))


def test_a_bag_gives_the_same_signs_each_time_quiet_and_beside_load(
    ros: LaunchGraph, tmp_path: Path, busy: Callable[[int], None]
) -> None:
    """Each of its images is recognised, in order, each time, quiet and beside busy processes."""
    bag = tmp_path / "frames.bag"
    bag_of_frames(bag)
    record = ros.record({HAND_SIGN: "std_msgs/String"})
    recognition = ros.run("rosrun", PACKAGE, "hand_sign_recognition.py")
    eventually(lambda: "/hand_sign_recognition" in ros.listeners("/image_raw"), what="the recognition")
    eventually(lambda: record.of(HAND_SIGN), what="the recognition's NONE")

    def signs() -> list[str]:
        """Return the signs of one play, without the NONE before and after: the bag begins and ends with Stop."""
        played_s = time.monotonic()
        ros.tell("rosbag", "play", "--wait-for-subscribers", "--rate", "2", str(bag))

        def shown() -> list[str]:
            words = [str(sign["word"]) for sign in record.of(HAND_SIGN, played_s)]
            return [*dropwhile(lambda word: word == "NONE", words)]

        eventually(lambda: len(shown()) > FRAMES and shown()[-1] == "NONE", 120.0, "a sign for each image")
        return [*dropwhile(lambda word: word == "NONE", reversed(shown()))][::-1]

    quiet = [signs() for _ in range(PLAYS)]
    assert [len(each) for each in quiet] == [FRAMES] * PLAYS
    assert [word for word, _ in groupby(quiet[0]) if word != "NONE"] == SHOWN_IN_BAG
    assert all(each == quiet[0] for each in quiet)
    busy(BUSY)
    beside_load = [signs() for _ in range(PLAYS)]
    assert [len(each) for each in beside_load] == [FRAMES] * PLAYS
    assert all(each == quiet[0] for each in beside_load)
    assert "dropped" not in recognition.text
