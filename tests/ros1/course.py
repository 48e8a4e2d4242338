"""The course's own nodes and launch files, to run beside ours.

What its last chapter prints is taken out of that text, where it is beside the repository; elsewhere, files of ours with
the same nodes, parameters and args stand for it. What only its repositories have is always a file of ours.
"""

import re
import sys
from pathlib import Path

SEED = Path(__file__).resolve().parents[3] / "shared" / "seed"

_SIGN_CONTROL = """<launch>
  <include file="$(find my_cam)/launch/my_cam.launch"/>
  <include file="$(find ros_hand_gesture_recognition)/launch/hand_sign.launch"/>
  <arg name="publish_gesture_topic" default="/gesture/hand_sign"/>
  <arg name="control_topic" default="/robot_diff_drive_controller/cmd_vel"/>
  <node name="sign_to_controller" pkg="ros_hand_gesture_recognition" type="sign_to_controller.py" output="screen">
    <param name="publish_gesture_topic" type="string" value="$(arg publish_gesture_topic)"/>
    <param name="control_topic" type="string" value="$(arg control_topic)"/>
  </node>
</launch>
"""

_CONTROLLER = """
class GestureController:

    def __init__(self):
        rospy.init_node('hand_sign_control', anonymous=True)
        topic = rospy.get_param("hand_sign_recognition/publish_gesture_topic")
        rospy.Subscriber(topic, String, self.callback)
        self.publisher = rospy.Publisher("/robot_diff_drive_controller/cmd_vel", Twist, queue_size=10)
        self.twist = Twist()

    def callback(self, sign):
        if sign.data in ("Forward", "Backward"):
            self.twist.linear.x += 0.01 if sign.data == "Forward" else -0.01
            self.twist.angular.z = 0.0
        elif sign.data in ("Turn Left", "Turn Right"):
            self.twist.angular.z += 0.1 if sign.data == "Turn Left" else -0.1
        elif sign.data in ("Stop", "NONE"):
            self.twist = Twist()
        self.publisher.publish(self.twist)
"""

HAND_SIGN = """<launch>
  <arg name="keypoint_classifier_label" default="/course/keypoint_classifier_label.csv"/>
  <arg name="keypoint_classifier_model" default="/course/keypoint_classifier.tflite"/>
  <arg name="subscribe_image_topic" default="/image_raw"/>
  <arg name="publish_gesture_topic" default="/gesture/hand_sign"/>
  <arg name="show_image" default="True"/>
  <node name="hand_sign_recognition" pkg="{package}" type="hand_sign_recognition.py" output="screen" respawn="true">
    <param name="keypoint_classifier_label" type="string" value="$(arg keypoint_classifier_label)"/>
    <param name="keypoint_classifier_model" type="string" value="$(arg keypoint_classifier_model)"/>
    <param name="subscribe_image_topic" type="string" value="$(arg subscribe_image_topic)"/>
    <param name="publish_gesture_topic" type="string" value="$(arg publish_gesture_topic)"/>
    <param name="show_image" type="bool" value="$(arg show_image)"/>
  </node>
</launch>
"""
"""The nodes, parameters and args of the course's ``hand_sign.launch``, with the executable of ``package``."""

_RECOGNITION = """
class Recognition:

    def __init__(self):
        rospy.init_node('hand_sign_recognition', anonymous=True)
        told = {name: rospy.get_param("hand_sign_recognition/" + name) for name in (
            "subscribe_image_topic", "publish_gesture_topic", "keypoint_classifier_label",
            "keypoint_classifier_model", "show_image")}
        self.publisher = rospy.Publisher(told["publish_gesture_topic"], String, queue_size=10)
        rospy.Subscriber(told["subscribe_image_topic"], Image, self.callback)

    def callback(self, image):
        self.publisher.publish("Forward")
"""

_CONTROL_ALONE = """<launch>
  <node name="sign_to_controller" pkg="{package}" type="sign_to_controller.py" output="screen" respawn="true"/>
</launch>
"""


def _chapter() -> str:
    return "".join(path.read_text(encoding="utf-8") for path in sorted(SEED.glob("*.txt"))) if SEED.is_dir() else ""


def sign_control_xml() -> str:
    """Return the chapter's ``sign_control.launch``, word for word."""
    found = re.search(r"```xml\n(<launch>.*?</launch>\n)```", _chapter(), re.S)
    return found.group(1) if found else _SIGN_CONTROL


def _controller_class() -> str:
    parts = re.findall(r"```python\n(.*?)```", _chapter(), re.S)
    return "".join(parts) if any("class GestureController" in part for part in parts) else _CONTROLLER


def make_package(folder: Path, name: str = "course") -> Path:
    """Make a ROS package of the course's control and of a stand-in for its recognition, which sees ``Forward`` always.

    Its launch files are ``sign_control.launch`` (the control alone) and ``hand_sign.launch``.
    """
    package = folder / name
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (package / "launch" / "sign_control.launch").write_text(_CONTROL_ALONE.format(package=name))
    (package / "launch" / "hand_sign.launch").write_text(HAND_SIGN.format(package=name))
    _write_node(package / "sign_to_controller.py", "GestureController", _controller_class())
    _write_node(package / "hand_sign_recognition.py", "Recognition", _RECOGNITION)
    return package


def _write_node(path: Path, name: str, source: str) -> None:
    imports = "import rospy\nfrom std_msgs.msg import String\nfrom geometry_msgs.msg import Twist\n"
    images = "from sensor_msgs.msg import Image\n"
    path.write_text(f"#!{sys.executable}\n{imports}{images}\n{source}\n\nnode = {name}()\nrospy.spin()\n")
    path.chmod(0o755)
