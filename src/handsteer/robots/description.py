"""The URDF of the handsteer robot."""

import threading
from functools import cache
from pathlib import Path

import xacro

_XACRO = Path(__file__).parent / "urdf" / "handsteer_robot.urdf.xacro"
_xacro_lock = threading.Lock()


@cache
def robot_description() -> str:
    """Return the URDF of the handsteer robot."""
    with _xacro_lock:  # xacro keeps its state in globals
        document = xacro.process_file(str(_XACRO))
    # The element alone: xacro writes the path of its source into a comment above it.
    return str(document.documentElement.toxml())
