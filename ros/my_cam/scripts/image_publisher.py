#!/usr/bin/env -S python3 -S
"""Publishes the frames of a camera (chapter 7 of the course): ``handsteer camera`` as a ROS node."""

try:
    import os
    import signal
    import sys
    from pathlib import Path

    # Signals stay blocked until handsteer can shut down cleanly: a new program inherits the mask.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    node = Path(__file__).resolve().parents[2] / "handsteer_node"
    os.execv(node, [str(node), "camera", *sys.argv[1:]])
except KeyboardInterrupt:
    pass  # nothing has started yet
