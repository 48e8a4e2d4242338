"""Our nodes as nodes of a real ROS 2, by its rclpy: the table of docs/ros2.md, a row a test."""

from collections.abc import Iterator
from functools import partial

import pytest

from tests.contracts.node_contract import ChainContract, ControlContract, MakeDriver, Running
from tests.dds.driver import DdsDriver, driving_chain
from tests.ros2.graph import PYTHON, Ros2Graph, ros2_graph

pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]


@pytest.fixture(scope="module")
def ros2(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros2Graph]:
    with ros2_graph(tmp_path_factory.mktemp("ros2"), "ros2") as graph:
        yield graph


class TestControl(ControlContract):
    @pytest.fixture
    def drive(self, ros2: Ros2Graph) -> MakeDriver:
        return partial(DdsDriver, ros2)


class TestChain(ChainContract):
    @pytest.fixture(scope="class")
    @classmethod
    def chain(cls, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
        with ros2_graph(tmp_path_factory.mktemp("chain"), "ros2") as graph:
            yield driving_chain(graph)
