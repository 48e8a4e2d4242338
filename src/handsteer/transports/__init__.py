"""How messages travel between nodes."""

from collections.abc import Callable, Sequence

from handsteer.errors import TransportError
from handsteer.transports.protocol import Session


def join(transport: str, node: str, arguments: Sequence[str]) -> Session:
    """Make this process a node of a graph of several processes.

    Args:
        transport: Which kind of graph, one of :data:`TRANSPORTS`.
        node: Name of the node, unless ``arguments`` rename it.
        arguments: In the words of the transport itself, as ROS 1 has ``image_raw:=/camera/image``, and ROS 2
            ``--ros-args -r image_raw:=/camera/image``.

    Raises:
        TransportError: There is no such transport or graph, or an argument is wrong.
    """
    if transport not in TRANSPORTS:
        raise TransportError(f"there is no transport {transport!r}: use {' or '.join(TRANSPORTS)}")
    return TRANSPORTS[transport](node, arguments)


def _ros1(node: str, arguments: Sequence[str]) -> Session:
    # rospy is not everywhere, and is loaded only when it is used.
    from handsteer.transports.ros1.session import Ros1Session  # noqa: PLC0415

    return Ros1Session(node, arguments)


def _dds(node: str, arguments: Sequence[str]) -> Session:
    try:
        from handsteer.transports.dds.session import DdsSession  # noqa: PLC0415
    except ModuleNotFoundError as problem:
        if (problem.name or "").partition(".")[0] != "cyclonedds":
            raise
        raise TransportError(
            "the transport dds needs the package cyclonedds: run pip install 'cyclonedds>=11,<12' beside handsteer "
            "(there is none for Python 3.14 and newer, nor for Linux on ARM)"
        ) from None
    return DdsSession(node, arguments)


TRANSPORTS: dict[str, Callable[[str, Sequence[str]], Session]] = {"ros1": _ros1, "dds": _dds}
"""What joins a graph of several processes, by name."""
