"""Starts camera, recognition and control, which convert hand signs to velocities.

ros2 launch handsteer_ros2 sign_control.launch.py camera:=/dev/video0 cmd_vel:=/cmd_vel
ros2 launch handsteer_ros2 sign_control.launch.py camera:=none image:=/front/image_raw namespace:=r1
"""

from handsteer_ros2.arguments import PACKAGE, common, node, text
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, NotEqualsSubstitution, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

PARAMETERS = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "sign_control.yaml"])


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    images = [("image_raw", LaunchConfiguration("image"))]
    has_camera = IfCondition(NotEqualsSubstitution(LaunchConfiguration("camera"), "none"))
    return LaunchDescription(
        [
            *common(PARAMETERS),
            DeclareLaunchArgument(
                "camera",
                default_value="auto",
                description="auto, virtual, a webcam's index or /dev/videoN, an address (rtsp, http), a video file or "
                "a folder; none if another node publishes the images",
            ),
            DeclareLaunchArgument(
                "image", default_value="image_raw", description="Topic of the images; compressed ones are below it"
            ),
            node("camera", "my_camera", parameters={"source": text("camera")}, remappings=images, condition=has_camera),
            node("recognition", "hand_sign_recognition", remappings=images),
            node("control", "hand_sign_control", parameters={"cmd_vel_type": text("cmd_vel_type")}),
        ]
    )
