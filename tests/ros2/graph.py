"""A domain of a real ROS 2 for a test: its rclpy, with Fast DDS, looks at our nodes."""

import contextlib
import shutil
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.dds.graph import DdsGraph

PEER = Path(__file__).with_name("peer.py")
PYTHON = Path(sys.prefix) / "ros2" / "bin" / "python"
"""Made by ``make ros2``."""
needs_tf2_msgs = pytest.mark.skipif(
    not (shutil.which("g++") and Path(sysconfig.get_path("include"), "Python.h").exists()),
    reason="make ros2 needs g++ and Python's headers for tf2_msgs",
)


class Ros2Graph(DdsGraph):
    """The processes of a test in a domain, with a node of a real ROS 2 among them that looks on.

    Args:
        home: Folder for logs.
        transport: What joins our nodes; ``ros2`` makes them nodes of that same ROS 2.
    """

    def __init__(self, home: Path, transport: str = "dds") -> None:
        self.transport = transport
        self.python = str(PYTHON) if transport == "ros2" else sys.executable
        super().__init__(home, (str(PYTHON), str(PEER)))

    def publishes(self, node: str, topic: str) -> bool:
        """Return whether ROS 2 knows that the node of this full name publishes ``topic``."""
        return topic in self.nodes()[node]["publishes"]


@contextlib.contextmanager
def ros2_graph(home: Path, transport: str = "dds") -> Iterator[Ros2Graph]:
    """A domain with a ROS 2 node in it, for as long as the block lasts."""
    graph = Ros2Graph(home, transport)
    try:
        yield graph
    finally:
        graph.stop()
