"""The door of the transport over ROS 1."""

from collections.abc import Sequence

from handsteer.transports.base import Session


def join(node: str, arguments: Sequence[str]) -> Session:
    """Join a graph of ROS 1."""
    from handsteer.plugins.ros1.session import Ros1Session

    return Ros1Session(node, arguments)
