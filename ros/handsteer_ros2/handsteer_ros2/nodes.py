"""The executables: each is ``handsteer`` with a node's verb.

Where ROS's own Python has handsteer, the node runs in it, and may be one of rclpy. Else, or where ``HANDSTEER`` names a
program, that is run: handsteer in an environment of its own.
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
        from handsteer.cli import main  # noqa: PLC0415 - it is not everywhere

        main([verb, *transport, *words])
        return
    wanted = named or "handsteer"
    program = shutil.which(wanted)
    if program is None:
        sys.exit(f"handsteer_ros2: there is no program {wanted}: install handsteer, or set HANDSTEER to its path")
    # In place of this process, so that signals of ``ros2 launch`` reach the node itself.
    # Ctrl-C waits until handsteer can end in order: a new program inherits what is blocked.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    os.execv(program, [program, verb, *transport, *words])
