"""The door of the transport over Zenoh."""

from collections.abc import Sequence

from handsteer.errors import needing
from handsteer.plugins.ros2.door import join_without_rclpy
from handsteer.transports.base import Session


def join(node: str, arguments: Sequence[str]) -> Session:
    """Join a graph of ROS 2 over Zenoh."""
    with needing("the transport zenoh", "zenoh", "zenoh", "xxhash"):
        from handsteer.plugins.zenoh.transport import ZenohTransport
    return join_without_rclpy(node, arguments, ZenohTransport)
