"""The executables: each runs ``handsteer`` with a node's verb.

If handsteer is installed for ROS's own Python, the node runs there and can use rclpy. Otherwise, or if ``HANDSTEER`` is
set, the program of that name is run, such as handsteer in a virtual environment.
"""

import ctypes
import importlib.util
import os
import shutil
import signal
import sys

_PR_SET_PDEATHSIG = 1


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


def _end_with_launch() -> None:
    """End by SIGTERM when the ``ros2 launch`` that started this process has ended, however; only on Linux.

    The launch files name its process in ``HANDSTEER_LAUNCH``; a node that a shell has started outlives that.
    """
    parent = os.getppid()
    if os.environ.get("HANDSTEER_LAUNCH") == str(parent) and sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGTERM))
        if os.getppid() != parent:  # it ended before the call
            sys.exit(0)


def _run(verb: str) -> None:
    _end_with_launch()
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
