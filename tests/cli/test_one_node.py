"""One node as a process: what it loads, and what becomes of a command line that has ROS's own words alone."""

import os
import subprocess
import sys

import pytest

from tests.processes import free_port
from tests.recognition.test_imports import loaded_by

BEGIN = "import handsteer.cli.one_node, handsteer.nodes.{verb}\n"


@pytest.mark.parametrize("verb", ["control", "recognition"])
def test_a_node_loads_nothing_of_other_nodes(verb: str) -> None:
    """Loading is most of the time that a node takes to start."""
    modules = loaded_by(BEGIN.format(verb=verb))
    packages = {name.partition(".")[0] for name in modules}
    assert not packages & {"cyclopts", "mujoco", "nicegui", "rospy", "xacro"}
    nodes = {"camera", "control", "recognition", "robot", "steering"} - {verb}
    assert not modules & {f"handsteer.nodes.{other}" for other in nodes}
    assert "handsteer.robots" not in modules
    assert not packages & {"ai_edge_litert", "cv2"} or verb == "recognition"


@pytest.mark.ros1
@pytest.mark.parametrize("option", [[], ["--control.arming", "off"]], ids=["ROS's words alone", "an option of ours"])
def test_what_is_wrong_is_said_alike_however_a_node_is_started(option: list[str]) -> None:
    words = ["control", "--transport", "ros1", *option, "gesture/hand_sign:=/words", "_max_linear:=0.2"]
    environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{free_port()}"}
    done = subprocess.run(
        [sys.executable, "-m", "handsteer", *words], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.startswith("handsteer: no ROS master answers at http://localhost:")
    assert len(done.stderr.splitlines()) == 1
