"""What the tests of launch files share."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros1.launches import LaunchGraph


@pytest.fixture
def ros(tmp_path: Path) -> Iterator[LaunchGraph]:
    """A ROS 1 graph of the test's own, for launch files."""
    graph = LaunchGraph(tmp_path)
    try:
        yield graph.start()
    finally:
        graph.stop()
