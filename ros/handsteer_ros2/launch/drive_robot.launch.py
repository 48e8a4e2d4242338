"""Starts the simulated robot with its transforms, the page, and optionally RViz.

ros2 launch handsteer_ros2 drive_robot.launch.py namespace:=r1 world:=empty port:=8081 rviz:=true
"""

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from handsteer_ros2.arguments import PACKAGE, common, node, text
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import Command, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare(PACKAGE)
PARAMETERS = PathJoinSubstitution([SHARE, "config", "drive_robot.yaml"])


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    kind = {"cmd_vel_type": text("cmd_vel_type")}
    return LaunchDescription(
        [
            *common(PARAMETERS),
            DeclareLaunchArgument("world", default_value="obstacles", description="Name of a world, or a YAML file"),
            DeclareLaunchArgument("page", default_value="true", description="Serve the page"),
            DeclareLaunchArgument("port", default_value="8080", description="Port of the page; 0 picks a free one"),
            DeclareLaunchArgument("rviz", default_value="false", description="Show the robot in RViz"),
            node("robot", "robot", parameters={**kind, "world": text("world")}),
            node(
                "steering",
                "steering",
                *("--port", LaunchConfiguration("port"), "--control.cmd-vel-type", LaunchConfiguration("cmd_vel_type")),
                condition=IfCondition(LaunchConfiguration("page")),
            ),
            OpaqueFunction(function=_transforms),
            OpaqueFunction(function=_rviz, condition=IfCondition(LaunchConfiguration("rviz"))),
        ]
    )


def _prefix(context: LaunchContext) -> str:
    """Return the prefix of coordinate frames: the namespace, as for the robot itself."""
    namespace = LaunchConfiguration("namespace").perform(context).strip("/")
    return f"{namespace}/" if namespace else ""


def _transforms(context: LaunchContext) -> list[Node | LogInfo]:
    """Return robot_state_publisher, which publishes the transforms of wheels and scanner, if it is installed."""
    try:
        get_package_share_directory("robot_state_publisher")
    except PackageNotFoundError:
        return [LogInfo(msg="robot_state_publisher is not installed: /tf ends at base_link")]
    model = PathJoinSubstitution([SHARE, "urdf", "handsteer_robot.urdf.xacro"])
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                {
                    "robot_description": ParameterValue(Command(["xacro ", model]), value_type=str),
                    "frame_prefix": _prefix(context),
                    "use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool),
                }
            ],
            output="screen",
        )
    ]


def _rviz(context: LaunchContext) -> list[Node]:
    view = PathJoinSubstitution([SHARE, "rviz", "drive_robot.rviz"])
    return [
        Node(
            package="rviz2",
            executable="rviz2",
            namespace=LaunchConfiguration("namespace"),
            arguments=["-d", view, "-f", f"{_prefix(context)}odom"],
            parameters=[{"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}],
        )
    ]
