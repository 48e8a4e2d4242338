"""The executables: each runs ``handsteer`` with a node's verb.

If handsteer is installed for ROS's own Python, the node runs there and can use rclpy. Otherwise, or if ``HANDSTEER`` is
set, the program of that name is run, such as handsteer in a virtual environment.
"""

import importlib.util
import os
import shutil
import signal
import sys


def camera() -> None:
    """Run ``handsteer camera``."""
    _run("camera")


def recognition() -> None:
    """Run ``handsteer recognition``."""
    _run("recognition")


def control() -> None:
    """Run ``handsteer control``."""
    _run("control")


def robot() -> None:
    """Run ``handsteer robot``."""
    _run("robot")


def steering() -> None:
    """Run ``handsteer steering``."""
    _run("steering")


def _run(verb: str) -> None:
    words = sys.argv[1:]
    transport = [] if "--transport" in words else ["--transport", "auto"]
    named = os.environ.get("HANDSTEER", "")
    if not named and importlib.util.find_spec("handsteer") is not None:
        from handsteer.cli import main  # noqa: PLC0415 - may not be installed

        main([verb, *transport, *words])
        return
    wanted = named or "handsteer"
    program = shutil.which(wanted)
    if program is None:
        sys.exit(f"handsteer_ros2: there is no program {wanted}: install handsteer, or set HANDSTEER to its path")
    # Replace this process, so that signals of ``ros2 launch`` reach the node itself. They stay blocked until handsteer
    # can shut down cleanly: a new program inherits the mask.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    os.execv(program, [program, verb, *transport, *words])
