#!/usr/bin/env -S python3 -S
"""Steers by the sliders of the page (chapter 11 of the course): ``handsteer steering`` as a ROS node."""

try:
    import os
    import signal
    import sys
    from pathlib import Path

    # Ctrl-C waits until handsteer can end in order: a new program inherits what is blocked.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    node = Path(__file__).resolve().parents[2] / "handsteer_node"
    os.execv(node, [str(node), "steering", *sys.argv[1:]])
except KeyboardInterrupt:
    pass  # nothing has begun yet
