"""What it takes to build a recogniser."""

import json
import subprocess
import sys

PROGRAM = """
import json, sys
from handsteer.config import Config
from handsteer.signs.opening import open_recognizer
recognizer = open_recognizer(Config())
import numpy as np
recognizer.step(np.zeros((480, 640, 3), np.uint8), 0.0)
print(json.dumps(sorted(sys.modules)))
"""
NEEDED = {"ai_edge_litert", "cv2", "numpy", "platformdirs", "pydantic"}
ROOMS_BENEATH = {"config", "control", "errors", "landmarks", "presets", "signs"}


def test_a_recogniser_loads_only_what_recognises() -> None:
    """Loading is most of the time until the first sign is told."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    modules = json.loads(done.stdout)
    packages = {name.partition(".")[0] for name in modules}
    assert packages >= NEEDED
    assert not packages & {"cyclopts", "fastapi", "mujoco", "nicegui", "rosbags", "starlette", "tqdm", "xacro", "yaml"}
    rooms = {name.split(".")[1] for name in modules if name.startswith("handsteer.")}
    assert rooms == ROOMS_BENEATH
