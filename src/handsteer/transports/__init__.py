"""Transports, which carry messages between nodes.

Each subscription has an inbox that keeps the newest message only, so no queue grows and a slow subscriber delays no
other. For signs and commands it keeps the newest ten, in order, because each sign changes the speed by one step.
``in_process`` has the base of all transports: one type per topic, and several subscribers per message. ``encoding`` has
the types of ROS messages and their bytes, ``commands`` publishes velocities with the type that subscribers use.
"""

import importlib.util
from collections.abc import Sequence
from typing import Final

from handsteer import doors
from handsteer.errors import TransportError, did_you_mean, install_command
from handsteer.transports.base import Session

AUTO: Final = "auto"
"""The transport ``ros2`` if rclpy is installed, else ``dds``."""


def transports() -> tuple[str, ...]:
    """Return the names of all transports that :func:`join` knows."""
    return (*doors.TRANSPORTS.names(), AUTO)


def join(transport: str, node: str, arguments: Sequence[str]) -> Session:
    """Make this process a node of a graph of several processes.

    Args:
        transport: Kind of graph, one of :func:`transports`.
        node: Name of the node, unless ``arguments`` rename it.
        arguments: In the syntax of the transport, such as ``image_raw:=/camera/image`` for ROS 1, and ``--ros-args -r
            image_raw:=/camera/image`` for ROS 2.

    Raises:
        TransportError: There is no such transport or graph, or an argument is wrong.
        PluginError: The transport is installed, but cannot be loaded.
    """
    known = transports()
    if transport not in known:
        near = did_you_mean(transport, known)
        raise TransportError(f"there is no transport {transport!r}{near or ':'} use {' or '.join(known)}")
    return doors.TRANSPORTS.open(_found() if transport == AUTO else transport, node, arguments)


def _found() -> str:
    if importlib.util.find_spec("rclpy") is not None:
        return "ros2"
    if importlib.util.find_spec("cyclonedds") is None:
        raise TransportError(
            "there is no ROS 2 here, and nothing that speaks its wire: neither rclpy (source ROS 2, and start "
            f"handsteer with the Python that it is for), nor the package cyclonedds ({install_command('dds')})"
        )
    return "dds"
