"""A domain of a real ROS 2 for a test: its rclpy, with Fast DDS, looks at our nodes."""

import shutil
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.dds.graph import DdsGraph

PEER = Path(__file__).with_name("peer.py")
PYTHON = Path(sys.prefix) / "ros2" / "bin" / "python"
"""Made by ``make ros2``."""
TRANSPORTS = ("ros2", "dds")
"""What joins our nodes."""
NEEDS_ROS2 = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]
"""Marks of the tests that need it."""
needs_tf2_msgs = pytest.mark.skipif(
    not (shutil.which("g++") and Path(sysconfig.get_path("include"), "Python.h").exists()),
    reason="make ros2 needs g++ and Python's headers for tf2_msgs",
)


class Ros2Graph(DdsGraph):
    """A domain, with a node of a real ROS 2 in it.

    Args:
        home: Folder for logs.
        transport: What joins our nodes; ``ros2`` makes them nodes of that same ROS 2.
    """

    def __init__(self, home: Path, transport: str = "dds") -> None:
        self.transport = transport
        self.python = str(PYTHON) if transport == "ros2" else sys.executable
        super().__init__(home, (str(PYTHON), str(PEER)))

    def publishes(self, node: str, topic: str) -> bool:
        return topic in self.nodes()[node]["publishes"]
