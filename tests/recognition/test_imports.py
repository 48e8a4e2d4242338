"""What it takes to load what recognises signs."""

import json
import subprocess
import sys

RECOGNISE_AN_ARRAY = """
import numpy as np
from handsteer import Recognizer
Recognizer().step(np.zeros((480, 640, 3), np.uint8), 0.0)
"""
LOADED = "import json, sys; print(json.dumps(sorted(sys.modules)))"


def loaded_by(program: str) -> set[str]:
    """Return the names of all modules that a process has loaded which ran ``program``."""
    done = subprocess.run([sys.executable, "-c", program + LOADED], check=True, capture_output=True, text=True)
    return set(json.loads(done.stdout))


def test_a_recogniser_loads_nothing_but_what_recognises() -> None:
    """Loading is most of the time until the first sign is told."""
    modules = loaded_by(RECOGNISE_AN_ARRAY)
    packages = {name.partition(".")[0] for name in modules}
    assert packages >= {"ai_edge_litert", "cv2", "numpy", "platformdirs", "pydantic"}
    assert not packages & {"cyclopts", "fastapi", "mujoco", "nicegui", "rosbags", "starlette", "tqdm", "xacro", "yaml"}
    packages = {name.split(".")[1] for name in modules if name.startswith("handsteer.")}
    assert packages == {"config", "doors", "errors", "recognition", "regular_files", "timeouts", "types"}


def test_photos_and_videos_are_recognised_without_messages_or_robots() -> None:
    modules = loaded_by("import handsteer.cli.recognize\n")
    packages = {name.partition(".")[0] for name in modules}
    assert not packages & {"mujoco", "nicegui", "rosbags", "xacro"}


def test_a_node_loads_nothing_of_cameras_and_robots_that_other_processes_have() -> None:
    modules = loaded_by("import handsteer.cli.nodes\n")
    packages = {name.partition(".")[0] for name in modules}
    assert not packages & {"mujoco", "nicegui", "rospy", "xacro"}
    assert "handsteer.plugins.virtual_hand" not in modules
