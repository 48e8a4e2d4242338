"""What the tests of launch files share."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.bags import busy_machine
from tests.ros1.launches import LaunchGraph


@pytest.fixture
def ros(tmp_path: Path) -> Iterator[LaunchGraph]:
    """A ROS 1 graph of the test's own, for launch files."""
    graph = LaunchGraph(tmp_path)
    try:
        yield graph.start()
    finally:
        graph.stop()


@pytest.fixture
def busy() -> Iterator[Callable[[int], None]]:
    """What keeps as many processes busy as it is told, until the test ends."""
    with busy_machine() as busy:
        yield busy
