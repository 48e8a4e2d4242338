"""Shared by the launch files: their arguments, and how to start a node of handsteer."""

import os
from typing import Any

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, NotEqualsSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = "handsteer_ros2"
CMD_VEL = "robot_diff_drive_controller/cmd_vel"


def common(params_file: Any) -> list[Any]:
    """Return the actions that declare the arguments of all launch files and apply them.

    Args:
        params_file: Default file of parameters.
    """
    return [
        DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes, such as r1"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="Use the time of /clock"),
        DeclareLaunchArgument("params_file", default_value=params_file, description="YAML file with parameters"),
        DeclareLaunchArgument(
            "transport",
            default_value="auto",
            choices=["auto", "ros2", "dds", "zenoh"],
            description="auto is rclpy (ros2) if installed, else Cyclone DDS (dds)",
        ),
        DeclareLaunchArgument("cmd_vel", default_value=CMD_VEL, description="Topic of the commands"),
        DeclareLaunchArgument(
            "cmd_vel_type",
            default_value="auto",
            choices=["auto", "twist", "twist_stamped"],
            description="Type of the commands; auto is the type the robot subscribes to, twist for the simulated one",
        ),
        DeclareLaunchArgument("respawn", default_value="true", description="Restart a node that has ended"),
        DeclareLaunchArgument(
            "discovery_range",
            default_value="",
            choices=["", "LOCALHOST", "SUBNET", "OFF", "SYSTEM_DEFAULT"],
            description="ROS_AUTOMATIC_DISCOVERY_RANGE of all nodes; empty keeps the environment's",
        ),
        SetEnvironmentVariable(
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            LaunchConfiguration("discovery_range"),
            condition=IfCondition(NotEqualsSubstitution(LaunchConfiguration("discovery_range"), "")),
        ),
    ]


def text(argument: str) -> ParameterValue:
    """Return an argument as a string parameter, even if it looks like a number."""
    return ParameterValue(LaunchConfiguration(argument), value_type=str)


def node(verb: str, name: str, *words: Any, parameters: dict[str, Any] | None = None, **more: Any) -> Node:
    """Return one of handsteer's nodes.

    Args:
        verb: The executable.
        name: Its name in the graph.
        words: Further arguments of its command line.
        parameters: Parameters that override those of the file.
        more: Passed to :class:`launch_ros.actions.Node`.
    """
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return Node(
        package=PACKAGE,
        executable=verb,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        arguments=["--transport", LaunchConfiguration("transport"), *words],
        parameters=[LaunchConfiguration("params_file"), {"use_sim_time": simulated, **(parameters or {})}],
        remappings=[(CMD_VEL, LaunchConfiguration("cmd_vel")), *more.pop("remappings", [])],
        additional_env={"HANDSTEER_LAUNCH": str(os.getpid())},
        respawn=LaunchConfiguration("respawn"),
        respawn_delay=1.0,
        output="screen",
        **more,
    )
