"""Transports, which carry messages between nodes.

Each subscription has an inbox that keeps the newest message only, so no queue grows and a slow subscriber delays no
other. For signs and commands it keeps the newest ten, in order, because each sign changes the speed by one step.
``in_process`` has the base of all transports: one type per topic, and several subscribers per message. ``encoding`` has
the types of ROS messages and their bytes, ``commands`` publishes velocities with the type that subscribers use.
"""

import importlib.util
import sys
from collections.abc import Callable, Sequence
from typing import Any

from handsteer.errors import TransportError, did_you_mean, needing
from handsteer.transports.base import Session


def join(transport: str, node: str, arguments: Sequence[str]) -> Session:
    """Make this process a node of a graph of several processes.

    Args:
        transport: Kind of graph, one of :data:`TRANSPORTS`.
        node: Name of the node, unless ``arguments`` rename it.
        arguments: In the syntax of the transport, such as ``image_raw:=/camera/image`` for ROS 1, and ``--ros-args -r
            image_raw:=/camera/image`` for ROS 2.

    Raises:
        TransportError: There is no such transport or graph, or an argument is wrong.
    """
    if transport not in TRANSPORTS:
        near = did_you_mean(transport, TRANSPORTS)
        raise TransportError(f"there is no transport {transport!r}{near or ':'} use {' or '.join(TRANSPORTS)}")
    return TRANSPORTS[transport](node, arguments)


def _ros1(node: str, arguments: Sequence[str]) -> Session:
    # rospy is not installed everywhere, so it is imported only when it is used.
    from handsteer.plugins.ros1.session import Ros1Session  # noqa: PLC0415

    return Ros1Session(node, arguments)


def _dds(node: str, arguments: Sequence[str]) -> Session:
    # There is no wheel of cyclonedds for Python 3.14 and newer, nor for Linux on ARM.
    with needing("the transport dds (zenoh works on every system)", "dds", "cyclonedds"):
        from handsteer.plugins.dds.transport import DdsTransport  # noqa: PLC0415
    return _wire(node, arguments, DdsTransport)


def _zenoh(node: str, arguments: Sequence[str]) -> Session:
    with needing("the transport zenoh", "zenoh", "zenoh", "xxhash"):
        from handsteer.plugins.zenoh.transport import ZenohTransport  # noqa: PLC0415
    return _wire(node, arguments, ZenohTransport)


def _wire(node: str, arguments: Sequence[str], connect: Any) -> Session:
    # It loads all types of ROS 2.
    from handsteer.plugins.ros2.base_session import Ros2Session  # noqa: PLC0415

    return Ros2Session(node, arguments, connect)


def _ros2(node: str, arguments: Sequence[str]) -> Session:
    if importlib.util.find_spec("rclpy") is None:
        raise TransportError(f"the transport ros2 needs rclpy, {_WITHOUT_RCLPY}; --transport dds needs no ROS 2")
    try:
        from handsteer.plugins.ros2.session import RclpySession  # noqa: PLC0415
    except ImportError as problem:
        raise TransportError(f"rclpy is there but cannot be loaded ({problem}): is a ROS 2 sourced?") from None
    return RclpySession(node, arguments)


def _auto(node: str, arguments: Sequence[str]) -> Session:
    if importlib.util.find_spec("rclpy") is not None:
        return _ros2(node, arguments)
    if importlib.util.find_spec("cyclonedds") is None:
        raise TransportError(
            f"there is no ROS 2 here, and nothing that speaks its wire: neither rclpy, {_WITHOUT_RCLPY}; "
            "nor the package cyclonedds (pip install 'handsteer[dds]')"
        )
    return _dds(node, arguments)


_WITHOUT_RCLPY = (
    f"which this Python ({sys.version_info[0]}.{sys.version_info[1]}) does not find: source ROS 2 "
    "(source /opt/ros/jazzy/setup.bash) and start handsteer with the Python that it is for"
)

TRANSPORTS: dict[str, Callable[[str, Sequence[str]], Session]] = {
    "ros1": _ros1,
    "ros2": _ros2,
    "dds": _dds,
    "zenoh": _zenoh,
    "auto": _auto,
}
"""Functions that join a graph of several processes, by name of the transport."""
