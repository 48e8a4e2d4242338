"""Our control finds out what a robot of a real ROS 2 takes, Twist or TwistStamped."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.contracts.command_type_contract import CommandTypeContract, MakeRobot, Robot
from tests.ros2.graph import PYTHON, Ros2Graph, ros2_graph

pytest.importorskip("cyclonedds")
pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]


class TestCommandType(CommandTypeContract):
    @pytest.fixture(params=("ros2", "dds"))
    def graph(self, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ros2Graph]:
        with ros2_graph(tmp_path, request.param) as graph:
            yield graph

    @pytest.fixture
    def make_robot(self, graph: Ros2Graph) -> MakeRobot:
        return lambda kind: Robot(graph.start_peer(), kind)
