"""The door of the transport over ROS 2."""

import importlib.util
import sys
from collections.abc import Callable, Sequence
from typing import Any

from handsteer.errors import TransportError
from handsteer.transports.base import Session


def join(node: str, arguments: Sequence[str]) -> Session:
    """Join a graph of ROS 2 by rclpy."""
    if importlib.util.find_spec("rclpy") is None:
        raise TransportError(
            f"the transport ros2 needs rclpy, which this Python ({sys.version_info[0]}.{sys.version_info[1]}) does not "
            "find: source ROS 2 (source /opt/ros/jazzy/setup.bash) and start handsteer with the Python that it is for; "
            "--transport dds needs no ROS 2"
        )
    try:
        from handsteer.plugins.ros2.session import RclpySession
    except ImportError as problem:
        raise TransportError(f"rclpy is there but cannot be loaded ({problem}): is a ROS 2 sourced?") from None
    return RclpySession(node, arguments)


def join_without_rclpy(node: str, arguments: Sequence[str], connect: Callable[..., Any]) -> Session:
    """Join a graph of ROS 2 by the transport that ``connect`` makes."""
    from handsteer.plugins.ros2.base_session import Ros2Session

    return Ros2Session(node, arguments, connect)
