"""What the tests on real ROS 1 share."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros1.ros_graph import RosGraph, ros_graph


@pytest.fixture
def ros(tmp_path: Path) -> Iterator[RosGraph]:
    """A ROS graph with a master of its own, on a free port."""
    with ros_graph(tmp_path) as graph:
        yield graph
