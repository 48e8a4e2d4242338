"""Domains with a node of a real ROS 2 in them."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.bags import busy_machine
from tests.ros2.graph import TRANSPORTS, Ros2Graph


@pytest.fixture(scope="module")
def ros2_domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros2Graph]:
    """A domain in which our nodes are of rclpy, too."""
    with Ros2Graph(tmp_path_factory.mktemp("ros2"), "ros2") as graph:
        yield graph


@pytest.fixture
def ros2(ros2_domain: Ros2Graph) -> Iterator[Ros2Graph]:
    """The module's domain for one test."""
    with ros2_domain.test():
        yield ros2_domain


@pytest.fixture(params=TRANSPORTS)
def fresh(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ros2Graph]:
    """A domain of the test's own, for each transport of our nodes."""
    with Ros2Graph(tmp_path, request.param) as graph:
        yield graph


@pytest.fixture
def busy() -> Iterator[Callable[[int], None]]:
    """What keeps as many processes busy as it is told, until the test ends."""
    with busy_machine() as busy:
        yield busy
