"""The door of the transport over DDS."""

from collections.abc import Sequence

from handsteer.errors import needing
from handsteer.plugins.ros2.door import join_without_rclpy
from handsteer.transports.base import Session


def join(node: str, arguments: Sequence[str]) -> Session:
    """Join a graph of ROS 2 over DDS."""
    # There is no wheel of cyclonedds for Python 3.14 and newer, nor for Linux on ARM.
    with needing("the transport dds (zenoh works on every system)", "dds", "cyclonedds"):
        from handsteer.plugins.dds.transport import DdsTransport
    return join_without_rclpy(node, arguments, DdsTransport)
