"""The course's two terminals on a real master: what is launched drives, stops, and comes back."""

import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import cv2
import numpy as np
import pytest

from tests.ros1.ros_graph import DEBIAN_PYTHON, ROOT, Recorder, RosGraph, eventually, needs_ros, run

pytestmark = [pytest.mark.ros1, pytest.mark.slow, needs_ros]

SIGN_CONTROL = ("ros_hand_gesture_recognition", "sign_control.launch")
DRIVE_ROBOT = ("ros_mobile_robot", "drive_robot.launch")
CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
ODOM = "/robot_diff_drive_controller/odom"
HAND_SIGN = "/gesture/hand_sign"
TOPICS = {
    "robot_diff_drive_controller__cmd_vel": "geometry_msgs/Twist",
    "robot_diff_drive_controller__odom": "nav_msgs/Odometry",
    "gesture__hand_sign": "std_msgs/String",
}
CHAIN = ["/my_camera", "/hand_sign_recognition", "/hand_sign_control", "/robot"]

LONGEST_S = 0.5
"""What the issue allows from a kill to the zero velocity that reaches the robot."""


def small_hand(ros: RosGraph, script: str, camera: str = "my_camera") -> None:
    """Let the drawn hand show ``script``, small enough for several systems on one machine."""
    ros.set(
        **{
            f"{camera}__virtual_hand__script": script,
            f"{camera}__width": 320,
            f"{camera}__height": 240,
            f"{camera}__fps": 20.0,
        }
    )


def moving(recorder: Recorder, since_s: float) -> dict[str, Any] | None:
    """Return the first odometry since ``since_s`` that says that the robot drives forward."""
    return next((odom for odom in recorder.of(ODOM, since_s) if odom["linear"] > 0.05), None)


def assert_moves_as_the_signs_say(recorder: Recorder, expected: set[str]) -> None:
    """Hold odometry against signs: in each stretch of one sign, the velocity goes where the sign sends it."""
    signs, odometry = recorder.of(HAND_SIGN), recorder.of(ODOM)
    seen = set()
    for word, group in groupby(signs, key=lambda sign: sign["word"]):
        stretch = list(group)
        begin_s, end_s = stretch[0]["at_s"], stretch[-1]["at_s"]
        during = [odom for odom in odometry if begin_s + 0.2 <= odom["at_s"] <= end_s]
        if end_s - begin_s < 1.0 or len(during) < 10:
            continue
        seen.add(word)
        first, last = during[0], during[-1]
        turned = sum(math.remainder(b["yaw"] - a["yaw"], math.tau) for a, b in pairwise(during))
        told = f"{word}: {first} ... {last}"
        if word == "Forward":
            assert last["linear"] > first["linear"] + 0.02, told
            assert abs(last["angular"]) < 0.1, told
        elif word == "Backward":
            assert last["linear"] < first["linear"] - 0.02, told
        elif word == "Turn Left":
            assert last["angular"] > 0.1, told
            assert turned > 0.02, told
        elif word == "Turn Right":
            assert last["angular"] < -0.1, told
            assert turned < -0.02, told
        elif word in ("Stop", "NONE"):
            assert abs(last["linear"]) < 0.02, told
            assert abs(last["angular"]) < 0.05, told
    assert expected <= seen


def test_the_two_terminals_drive_the_robot_by_the_virtual_hand(ros: RosGraph) -> None:
    small_hand(ros, "Stop:3 Forward:3 Turn Left:3 Stop:4 Backward:3 Turn Right:3")
    record = ros.record(
        **TOPICS,
        tf="tf2_msgs/TFMessage",
        joint_states="sensor_msgs/JointState",
        diagnostics="diagnostic_msgs/DiagnosticArray",
    )
    ros.launch(*SIGN_CONTROL, "camera_name:=virtual")
    ros.launch(*DRIVE_ROBOT, "world:=empty")

    def shown() -> set[str]:
        return {sign["word"] for sign in record.of(HAND_SIGN)}

    eventually(lambda: {"Stop", "Forward", "Turn Left", "Backward", "Turn Right"} <= shown(), "all signs are told")
    eventually(lambda: record.of(HAND_SIGN)[-1]["word"] == "Stop", "the hand has shown all of its signs")
    time.sleep(2.0)
    assert_moves_as_the_signs_say(record, {"Stop", "Forward", "Turn Left", "Backward", "Turn Right"})

    assert set(ros.tell("rosnode", "list").split()) >= {*CHAIN, "/robot_state_publisher", "/rosout"}
    reported = {name for message in record.of("/diagnostics") for name in message["status"]}
    assert {name.strip("/") for name in CHAIN} <= {name.partition(":")[0] for name in reported}
    odom = record.of(ODOM)[-1]
    assert odom["frame_id"] == "odom"
    assert abs(odom["stamp_s"] - time.time()) < 5.0
    frames = {tuple(frame) for message in record.of("/tf") for frame in message["frames"]}
    assert ("odom", "base_link") in frames
    assert ("chassis_link", "front_left_wheel_link") in frames
    assert abs(record.of("/joint_states")[-1]["stamp_s"] - odom["stamp_s"]) < 1.0


def test_photos_as_a_30_hz_video_drive_the_robot(ros: RosGraph, data_dir: Path, tmp_path: Path) -> None:
    video = tmp_path / "photos.mp4"
    seconds = {"stop": 2, "forward": 3, "turn_left": 3, "turn_right": 3}
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter_fourcc(*"mp4v"), 30.0, (640, 480))
    for sign, duration in seconds.items():
        photo = cv2.imread(str(sorted((data_dir / "photos" / sign).glob("emre*"))[0]))
        assert photo is not None
        for _ in range(30 * duration):
            writer.write(cv2.resize(photo, (640, 480)))
    writer.release()

    record = ros.record(**TOPICS)
    ros.launch(*DRIVE_ROBOT, "world:=empty")
    eventually(lambda: record.of(ODOM), "the robot is there")
    ros.launch(*SIGN_CONTROL, f"camera_name:={video}")
    eventually(lambda: record.of(HAND_SIGN), "signs are told")
    time.sleep(sum(seconds.values()) + 2.5)
    assert_moves_as_the_signs_say(record, {"Stop", "Forward", "Turn Left", "Turn Right"})


def test_the_topics_are_those_that_the_args_say(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600")
    ros.launch(*SIGN_CONTROL, "camera_name:=virtual", "publish_gesture_topic:=/words", "control_topic:=/other/cmd_vel")
    record = ros.record(words="std_msgs/String", other__cmd_vel="geometry_msgs/Twist")
    eventually(lambda: any(twist["linear"] > 0.05 for twist in record.of("/other/cmd_vel")), "it drives elsewhere")
    assert {word["word"] for word in record.of("/words")} >= {"Forward"}
    assert not {HAND_SIGN, CMD_VEL} & set(ros.topics())

    ros.launch(
        "ros_hand_gesture_recognition",
        "hand_sign.launch",
        "subscribe_image_topic:=/cam2/image",
        "publish_gesture_topic:=/cam2/words",
        ROS_NAMESPACE="second",
    )
    ros.launch("my_cam", "my_cam.launch", "camera_name:=virtual", ROS_NAMESPACE="second")
    second = "/second/hand_sign_recognition"
    eventually(lambda: second in ros.topics().get("/cam2/image", (set(), set()))[1], "images come from elsewhere")
    eventually(lambda: second in ros.topics().get("/cam2/words", (set(), set()))[0], "words go elsewhere")
    eventually(
        lambda: "/second/my_camera" in ros.topics().get("/second/image_raw", (set(), set()))[0], "a second camera"
    )


def test_two_systems_run_side_by_side_in_namespaces(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600", "r1__my_camera")
    small_hand(ros, "Turn Left:600", "r2__my_camera")
    ros.set(r1__my_camera__fps=10.0, r2__my_camera__fps=10.0)
    kinds = {f"{name}__{topic}": kind for name in ("r1", "r2") for topic, kind in TOPICS.items()}
    record = ros.record(**kinds, r1__tf="tf2_msgs/TFMessage", r2__tf="tf2_msgs/TFMessage")
    for name in ("r1", "r2"):
        ros.launch(*SIGN_CONTROL, "camera_name:=virtual", ROS_NAMESPACE=name)
        ros.launch(*DRIVE_ROBOT, "world:=empty", ROS_NAMESPACE=name)
    eventually(lambda: any(odom["x"] > 0.1 for odom in record.of(f"/r1{ODOM}")), "the first drives")
    eventually(lambda: any(odom["yaw"] > 0.2 for odom in record.of(f"/r2{ODOM}")), "the second turns")
    assert max(abs(odom["yaw"]) for odom in record.of(f"/r1{ODOM}")) < 0.1
    assert max(abs(odom["x"]) for odom in record.of(f"/r2{ODOM}")) < 0.1
    for name in ("r1", "r2"):
        assert record.of(f"/{name}/tf")
    shared = {topic for topic in ros.topics() if not topic.startswith(("/r1/", "/r2/"))}
    assert shared <= {"/rosout", "/rosout_agg", "/diagnostics", "/clock"}


def test_each_node_that_is_killed_stops_the_robot_and_comes_back(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600")
    ros.set(hand_sign_control__max_linear=0.3)
    record = ros.record(**TOPICS)
    ros.launch(*SIGN_CONTROL, "camera_name:=virtual")
    ros.launch(*DRIVE_ROBOT, "world:=empty")
    since_s = 0.0
    for node in CHAIN:
        eventually(lambda since_s=since_s: moving(record, since_s), f"it drives, before {node} is killed")
        pid = eventually(lambda node=node: ros.pid(node), f"{node} answers")
        killed_s = time.monotonic()
        os.kill(pid, signal.SIGKILL)
        if node == "/robot":
            assert_starts_standing(record, killed_s)
        else:
            stopped_s = assert_stops(record, killed_s, by_itself=node == "/hand_sign_control")
            print(f"{node}: zero after {stopped_s - killed_s:.3f} s")  # noqa: T201 - shown by pytest -rP
            assert_starts_from_zero(record, stopped_s)
        eventually(lambda node=node, pid=pid: ros.pid(node) not in (None, pid), f"{node} is back")
        since_s = time.monotonic()
    eventually(lambda: moving(record, since_s), "it drives again after all that")


def assert_stops(record: Recorder, killed_s: float, *, by_itself: bool) -> float:
    """Return when zero velocity reached the robot: by a Twist, or as it brakes without one; in time, that is."""
    if by_itself:
        before = record.of(ODOM, killed_s - 0.2)[0]["linear"]
        stop = eventually(
            lambda: next((odom for odom in record.of(ODOM, killed_s) if odom["linear"] < 0.9 * before), None),
            "the robot brakes by itself",
        )
    else:
        stop = eventually(
            lambda: next((twist for twist in record.of(CMD_VEL, killed_s) if twist["linear"] == 0.0), None),
            "it is told to stand",
        )
    stopped_s = float(stop["at_s"])
    assert stopped_s - killed_s <= LONGEST_S
    eventually(lambda: any(abs(odom["linear"]) < 0.01 for odom in record.of(ODOM, stopped_s)), "the robot stands", 5.0)
    return stopped_s


def assert_starts_from_zero(record: Recorder, stopped_s: float) -> None:
    """After the stop, velocities grow from zero: nothing of the old one, 0.3 m/s, is taken up again.

    The first steps of a new publisher go before the recorder is connected to it.
    """
    first = eventually(
        lambda: next((twist for twist in record.of(CMD_VEL, stopped_s) if twist["linear"] != 0.0), None),
        "it is told to drive again",
    )
    assert 0 < first["linear"] <= 0.05


def assert_starts_standing(record: Recorder, killed_s: float) -> None:
    """The new robot stands at its origin until it gets a command of its own."""
    odom = eventually(lambda: record.of(ODOM, killed_s + 0.5), "the robot is back")[0]
    assert abs(odom["x"]) < 0.05
    assert abs(odom["linear"]) < 0.1


def test_ctrl_c_leaves_the_robot_standing(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600")
    record = ros.record(**TOPICS)
    control = ros.launch(*SIGN_CONTROL, "camera_name:=virtual")
    ros.launch(*DRIVE_ROBOT, "world:=empty")
    eventually(lambda: moving(record, 0.0), "it drives")
    control.stop()
    assert record.of(CMD_VEL)[-1]["linear"] == 0.0
    eventually(lambda: abs(record.of(ODOM)[-1]["linear"]) < 0.01, "the robot stands")


def test_time_may_come_from_the_clock_topic(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600")
    ros.set(use_sim_time=True)
    record = ros.record(**TOPICS)
    with subprocess.Popen(
        [DEBIAN_PYTHON, str(Path(__file__).with_name("publish_clock.py")), "1000"], env=ros.env
    ) as clock:
        try:
            ros.launch(*SIGN_CONTROL, "camera_name:=virtual")
            ros.launch(*DRIVE_ROBOT, "world:=empty")
            driving = eventually(lambda: moving(record, 0.0), "it drives on simulated time")
            assert 1000 < driving["stamp_s"] < 1200
        finally:
            clock.kill()
        # With time standing still, no odometry comes: what the robot is told counts.
        eventually(lambda: record.of(CMD_VEL)[-1]["linear"] == 0.0, "a clock that stops leaves it standing")


def test_sliders_are_served_where_the_arg_says(ros: RosGraph) -> None:
    port = ros.uri.rsplit(":", 1)[1]
    port = str(int(port) + 1 if int(port) < 65000 else int(port) - 1)
    ros.launch("ros_mobile_robot", "steering.launch", f"port:={port}", f"control_topic:={CMD_VEL}")
    eventually(lambda: "/steering" in ros.topics().get(CMD_VEL, (set(), set()))[0], "sliders drive the robot itself")

    def served() -> bool:
        try:
            with urlopen(f"http://127.0.0.1:{port}", timeout=5) as page:
                return b"handsteer" in page.read().lower()
        except OSError:
            return False

    eventually(served, "the page is served")


def test_a_camera_that_is_not_there_is_named_with_what_works_without(ros: RosGraph) -> None:
    launch = ros.launch(*SIGN_CONTROL, "camera_name:=/dev/video97")
    eventually(lambda: "there is no webcam /dev/video97" in launch.said, "the message")
    assert "virtual" in launch.said
    assert "Traceback" not in launch.said
    record = ros.record(**TOPICS)
    eventually(lambda: record.of(HAND_SIGN), "the others run on")
    assert {sign["word"] for sign in record.of(HAND_SIGN)} == {"NONE"}


def test_the_subscriber_of_chapter_8_says_what_images_come(ros: RosGraph) -> None:
    small_hand(ros, "Forward:600")
    ros.launch("my_cam", "my_cam.launch", "camera_name:=virtual")
    log = ros.folder / "subscriber.txt"
    with log.open("w") as output:
        command = ["rosrun", "my_cam", "image_subscriber.py"]
        with subprocess.Popen(command, env=ros.env, stdout=output, stderr=subprocess.STDOUT) as subscriber:
            try:
                said = eventually(
                    lambda: re.search(r"320x240 bgr8, (\d+) images.* (\d+) ms old", log.read_text()), "it"
                )
            finally:
                subscriber.terminate()
    assert int(said[1]) >= 5
    assert int(said[2]) < 500


@pytest.mark.skipif(
    not all(shutil.which(tool) for tool in ("rviz", "Xvfb", "import")), reason="needs rviz, xvfb and imagemagick"
)
def test_rviz_shows_the_robot_driving(tmp_path: Path) -> None:
    path = tmp_path / "rviz.png"
    run(sys.executable, str(ROOT / "scripts" / "rviz_screenshot.py"), str(path), env=dict(os.environ), timeout_s=240)
    picture = cv2.imread(str(path))
    assert picture is not None
    assert picture.shape == (800, 1280, 3)
    # Left of the blue columns of the world; only the robot is blue there.
    view, hand = picture[70:760, 430:1150].astype(int), picture[475:765, 5:395].astype(int)
    blue, green, red = view[..., 0], view[..., 1], view[..., 2]
    assert np.count_nonzero((blue > red + 60) & (blue > green + 20)) > 300, "the blue chassis"
    assert np.count_nonzero((red > blue + 60) & (green > blue + 20)) > 300, "the trail of odometry, the obstacles"
    assert np.count_nonzero(hand[..., 1] > hand[..., 0] + 60) > 100, "the green word in the picture with the hand"


def test_parameters_on_the_server_count(ros: RosGraph) -> None:
    ros.set(hand_sign_control__linear_step=0.04)
    small_hand(ros, "Forward:600")
    record = ros.record(**TOPICS)
    ros.launch(*SIGN_CONTROL, "camera_name:=virtual")
    first = eventually(
        lambda: next((twist for twist in record.of(CMD_VEL) if twist["linear"] != 0), None), "it is told to drive"
    )
    assert first["linear"] == pytest.approx(0.04)
    assert ros.tell("rosparam", "get", "/my_camera/source").strip() == "virtual"
