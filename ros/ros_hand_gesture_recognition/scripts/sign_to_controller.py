#!/usr/bin/env -S python3 -S
"""Converts signs to velocities (chapter 12 of the course): ``handsteer control`` as a ROS node."""

try:
    import os
    import signal
    import sys
    from pathlib import Path

    # Signals stay blocked until handsteer can shut down cleanly: a new program inherits the mask.
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    node = Path(__file__).resolve().parents[2] / "handsteer_node"
    # The parameters ~arming, ~engage and ~renew override this file.
    course = Path(__file__).resolve().with_name("course.yaml")
    given = sys.argv[1:]
    file = [] if any(word.startswith("--config") for word in given) else ["--config", str(course)]
    os.execv(node, [str(node), "control", *file, *given])
except KeyboardInterrupt:
    pass  # nothing has started yet
