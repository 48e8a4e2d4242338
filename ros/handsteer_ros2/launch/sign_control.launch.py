"""Camera, recognition and control: what turns hand signs into velocities.

ros2 launch handsteer_ros2 sign_control.launch.py cmd_vel:=/cmd_vel namespace:=r1 transport:=dds
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "handsteer_ros2"
NODES = {"camera": "my_camera", "recognition": "hand_sign_recognition", "control": "hand_sign_control"}
PARAMETERS = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "sign_control.yaml"])


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes, as r1"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="Follow /clock"),
        DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="YAML file with parameters"),
        DeclareLaunchArgument("transport", default_value="dds", description="dds or zenoh"),
        DeclareLaunchArgument(
            "cmd_vel", default_value="robot_diff_drive_controller/cmd_vel", description="Topic of the commands"
        ),
    ]
    return LaunchDescription([*arguments, *(_node(verb, name) for verb, name in NODES.items())])


def _node(verb: str, name: str) -> Node:
    return Node(
        package=PACKAGE,
        executable=verb,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        arguments=["--transport", LaunchConfiguration("transport")],
        parameters=[
            LaunchConfiguration("params_file"),
            {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)},
        ],
        remappings=[("robot_diff_drive_controller/cmd_vel", LaunchConfiguration("cmd_vel"))],
        output="screen",
    )
