"""The executables: each becomes ``handsteer`` with a node's verb.

handsteer itself need not be installed for ROS's Python, whose numpy and protobuf may be others: ``HANDSTEER`` names the
program, else it is looked for in ``PATH``.
"""

import os
import shutil
import signal
import sys


def camera() -> None:
    """Run ``handsteer camera``."""
    _become("camera")


def recognition() -> None:
    """Run ``handsteer recognition``."""
    _become("recognition")


def control() -> None:
    """Run ``handsteer control``."""
    _become("control")


def robot() -> None:
    """Run ``handsteer robot``."""
    _become("robot")


def steering() -> None:
    """Run ``handsteer steering``."""
    _become("steering")


def _become(verb: str) -> None:
    """Replace this process, so that signals of ``ros2 launch`` reach the node itself."""
    wanted = os.environ.get("HANDSTEER", "handsteer")
    program = shutil.which(wanted)
    if program is None:
        sys.exit(f"handsteer_ros2: there is no program {wanted}: install handsteer, or set HANDSTEER to its path")
    words = sys.argv[1:]
    transport = [] if "--transport" in words else ["--transport", "dds"]
    # Ctrl-C waits until handsteer can end in order: a new program inherits what is blocked.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    os.execv(program, [program, verb, *transport, *words])
