"""The simulated robot, and the page that shows it and steers it.

ros2 launch handsteer_ros2 drive_robot.launch.py namespace:=r1 world:=empty page:=false
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "handsteer_ros2"
PARAMETERS = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "drive_robot.yaml"])


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    common = {
        "package": PACKAGE,
        "namespace": LaunchConfiguration("namespace"),
        "output": "screen",
    }
    transport = ["--transport", LaunchConfiguration("transport")]
    use_sim_time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes, as r1"),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Follow /clock"),
            DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="YAML file with parameters"),
            DeclareLaunchArgument("transport", default_value="dds", description="dds or zenoh"),
            DeclareLaunchArgument("world", default_value="obstacles", description="Name of a world, or a YAML file"),
            DeclareLaunchArgument("page", default_value="true", description="Serve the page"),
            Node(
                executable="robot",
                name="robot",
                arguments=[*transport, "--world", LaunchConfiguration("world")],
                parameters=[LaunchConfiguration("params_file"), use_sim_time],
                **common,
            ),
            Node(
                executable="steering",
                name="steering",
                arguments=transport,
                parameters=[use_sim_time],
                condition=IfCondition(LaunchConfiguration("page")),
                **common,
            ),
        ]
    )
