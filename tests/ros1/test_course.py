"""The course's own nodes and launch files beside ours, on one master."""

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from tests.processes import eventually
from tests.ros1.course import HAND_SIGN as HAND_SIGN_XML
from tests.ros1.course import make_package, sign_control_xml
from tests.ros1.launches import ROS, Launch, LaunchGraph, Recorder

pytestmark = [pytest.mark.ros1, pytest.mark.slow]

CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
ODOM = "/robot_diff_drive_controller/odom"
TOPICS = {CMD_VEL: "geometry_msgs/Twist", ODOM: "nav_msgs/Odometry"}
OURS = "ros_hand_gesture_recognition"


@pytest.fixture
def course(ros: LaunchGraph, tmp_path: Path) -> LaunchGraph:
    """A graph that finds the package ``course`` too, with our robot and a camera that shows Stop, then Forward."""
    make_package(tmp_path)
    ros.env["ROS_PACKAGE_PATH"] = f"{ROS}:{tmp_path}"
    settings = {"source": "virtual", "virtual_hand/script": "Stop:2 Forward:8", "width": 320, "height": 240, "fps": 15}
    for name, value in settings.items():
        ros.set_parameter(f"/drawn/{name}", value)
    # The chapter's file gives its camera no args, so it is a webcam that is not there, and another shows the hand.
    ros.run("rosrun", "my_cam", "image_publisher.py", "__name:=drawn")
    ros.launch("ros_mobile_robot", "drive_robot.launch", "world:=empty")
    return ros


def drives(record: Recorder) -> None:
    """Wait until the robot drives forward anew: it was told to, and does."""
    since_s = time.monotonic()
    eventually(
        lambda: any(odom["linear"] > 0.05 for odom in record.of(ODOM, since_s)), what="the robot to drive forward"
    )


def restarted(ros: LaunchGraph, launch: Launch, node: str) -> None:
    """Kill what runs as ``node`` and wait until another process does."""
    old = eventually(lambda: ros.pid(node), what=f"{node} to be there")
    os.kill(old, signal.SIGKILL)
    eventually(lambda: ros.pid(node) not in (None, old) or not launch.running, what=f"{node} to come back")


def test_the_chapters_launch_file_drives_the_robot(course: LaunchGraph, tmp_path: Path) -> None:
    file = tmp_path / "sign_control.launch"
    file.write_text(sign_control_xml())
    record = course.record(TOPICS)
    launch = course.launch_file(file)
    drives(record)
    assert course.talkers(CMD_VEL) == ["/sign_to_controller"]
    # roslaunch itself says what it sets; the nodes have nothing to say about it.
    assert "ignoring unknown" not in launch.text


def test_the_chapters_args_count(course: LaunchGraph, tmp_path: Path) -> None:
    """The recognition is not given the arg, so it publishes where it does by itself, and the control follows that."""
    file = tmp_path / "sign_control.launch"
    file.write_text(sign_control_xml())
    course.set_parameter("/sign_to_controller/engage_by", "hold")
    record = course.record({"/other/cmd_vel": "geometry_msgs/Twist"})
    launch = course.launch_file(file, "control_topic:=/other/cmd_vel", "publish_gesture_topic:=/words")
    eventually(lambda: any(twist["linear"] > 0.05 for twist in record.of("/other/cmd_vel")), what="it drives elsewhere")
    assert "publish_gesture_topic is /words, but signs are read from gesture/hand_sign" in launch.text


def test_with_any_other_control_topic_the_hand_has_to_engage_first(ros: LaunchGraph) -> None:
    record = ros.record({"/cmd_vel": "geometry_msgs/Twist"})
    ros.run("rosrun", OURS, "sign_to_controller.py", "_control_topic:=/cmd_vel", "_engage_by:=hold")
    peer = ros.peer()
    peer.ask("advertise", topic="gesture/hand_sign", package="std_msgs", type="String")
    eventually(lambda: peer.ask("listeners", topic="gesture/hand_sign") > 0)
    eventually(lambda: ros.connected("/hand_sign_control", "/cmd_vel"))

    def show(sign: str, count: int) -> None:
        peer.ask("publish", topic="gesture/hand_sign", values={"data": sign}, count=count, period_s=0.05)

    show("Forward", 60)
    assert {twist["linear"] for twist in record.of("/cmd_vel")} <= {0.0}
    assert ros.listeners("/odom") == ["/hand_sign_control"]

    def drives_on() -> bool:
        show("Stop", 30)  # again, where a busy machine left a gap
        show("Forward", 10)
        return any(twist["linear"] > 0.0 for twist in record.of("/cmd_vel"))

    eventually(drives_on, what="it drives once it is engaged")


def test_the_courses_recognition_file_starts_ours(course: LaunchGraph, tmp_path: Path) -> None:
    file = tmp_path / "hand_sign.launch"
    file.write_text(HAND_SIGN_XML.format(package=OURS))
    record = course.record({"/words": "std_msgs/String"})
    launch = course.launch_file(file, "publish_gesture_topic:=/words", "subscribe_image_topic:=image_raw")
    eventually(lambda: any(sign["word"] == "Forward" for sign in record.of("/words")), what="the sign")
    said = [line for line in launch.text.splitlines() if "handsteer" in line or "[WARN]" in line or "[INFO]" in line]
    for what in ("keypoint_classifier.tflite cannot be used", "keypoint_classifier_label.csv is not read", "no window"):
        assert sum(what in line for line in said) == 1, launch.text


def test_the_courses_camera_file_starts_ours(ros: LaunchGraph, tmp_path: Path) -> None:
    file = tmp_path / "my_cam.launch"
    node = '<node name="my_webcam" pkg="my_cam" type="image_publisher_launch.py" output="screen">'
    camera = '<param name="camera_name" type="string" value="$(arg camera_name)"/>'
    file.write_text(f'<launch><arg name="camera_name" default="/dev/video0"/>{node}{camera}</node></launch>')
    ros.launch_file(file, "camera_name:=virtual")
    ros.tell("rostopic", "echo", "-n", "1", "--noarr", "/image_raw")
    assert ros.talkers("/image_raw") == ["/my_webcam"]


@pytest.mark.parametrize("first", ["control", "recognition"])
def test_the_courses_control_and_our_recognition(course: LaunchGraph, first: str) -> None:
    files: dict[str, Any] = {
        "control": ("course", "sign_control.launch"),
        "recognition": (OURS, "hand_sign.launch"),
    }
    record = course.record(TOPICS)
    order = [first, *(name for name in files if name != first)]
    # A control that comes first is started again, as in the course, until the recognition's topic is known.
    launches = {name: course.launch(*files[name]) for name in order}
    drives(record)
    restarted(course, launches["recognition"], "/hand_sign_recognition")
    drives(record)
    (control,) = course.talkers(CMD_VEL)
    restarted(course, launches["control"], control)
    drives(record)
    assert launches["recognition"].running


@pytest.mark.parametrize("topic", ["/gesture/hand_sign", "/words"])
@pytest.mark.parametrize("first", ["control", "recognition"])
def test_our_control_and_the_courses_recognition(course: LaunchGraph, first: str, topic: str) -> None:
    record = course.record(TOPICS)
    recognition = ("course", "hand_sign.launch", f"publish_gesture_topic:={topic}")
    if first == "control":
        course.set_parameter("/hand_sign_recognition/publish_gesture_topic", topic)
        course.run("rosrun", OURS, "sign_to_controller.py")
        eventually(lambda: "/hand_sign_control" in course.nodes(), what="our control")
    launch = course.launch(*recognition)
    if first == "recognition":
        eventually(lambda: "/hand_sign_recognition" in course.nodes(), what="their recognition")
        course.run("rosrun", OURS, "sign_to_controller.py")
    drives(record)
    restarted(course, launch, "/hand_sign_recognition")
    drives(record)
