"""Time to stop the robot over ROS 1 after a node, or the master, is killed with kill -9 while it drives.

Run ``python benchmarks/ros1_stop.py`` after ``make ros1``. All nodes run as processes, with a real roscore, and the
virtual hand shows ``Forward``. Measured is the time from the kill to the first zero on the robot's topic; if no node is
left to send one, to the time at which the robot's wheels are slower than commanded.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the graph that the tests use

from tests.processes import Peer, eventually
from tests.ros1.graph import Ros1Graph, ros1_graph

CMD_VEL, ODOM = "/robot_diff_drive_controller/cmd_vel", "/robot_diff_drive_controller/odom"
SPEED_MPS, SLOWER_MPS = 0.3, 0.29
CAMERA = ["--camera", "virtual", "--camera.width", "320", "--camera.height", "240", "_virtual_hand/script:=Forward:60"]
NODES = {
    "robot": ("/robot", []),
    "control": ("/hand_sign_control", [f"_max_linear:={SPEED_MPS}"]),
    "recognition": ("/hand_sign_recognition", []),
    "camera": ("/my_camera", CAMERA),
}
VICTIMS = ("camera", "recognition", "control", "master")
LIMIT_MS = 500


def noted(peer: Peer, topic: str, since_s: float = 0.0) -> list[tuple[float, float]]:
    return [(at_s, values[0]) for at_s, values in peer.ask("get", topic=topic) if at_s > since_s]


def stop_ms(graph: Ros1Graph, victim: str) -> float:
    """Let the robot drive, kill ``victim``, and return the time until the robot was stopped."""
    peer = graph.peer()
    peer.ask("record", topic=CMD_VEL, package="geometry_msgs", type="Twist", fields=["linear.x"])
    peer.ask("record", topic=ODOM, package="nav_msgs", type="Odometry", fields=["twist.twist.linear.x"])
    nodes = {verb: graph.node(verb, *options, name=name) for verb, (name, options) in NODES.items()}
    eventually(lambda: noted(peer, ODOM) and noted(peer, ODOM)[-1][1] > SLOWER_MPS, what="the robot to drive")
    killed_s = time.monotonic()
    if victim == "master":
        graph.kill_master()
    else:
        nodes[victim].popen.kill()
    topic, limit = (ODOM, SLOWER_MPS) if victim == "control" else (CMD_VEL, 1e-9)
    eventually(lambda: [value for _, value in noted(peer, topic, killed_s) if value < limit], 5.0, what="zero velocity")
    stopped_s = next(at_s for at_s, value in noted(peer, topic, killed_s) if value < limit)
    for process in (*nodes.values(), peer):
        process.kill()
    return (stopped_s - killed_s) * 1000


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Measure the time to stop the robot after a node or the master is killed."
    )
    parser.add_argument("--times", type=int, default=5, help="number of kills of each")
    parser.add_argument("--only", choices=VICTIMS, help="kill only this one")
    options = parser.parse_args()
    for victim in VICTIMS if options.only is None else [options.only]:
        times = []
        for _ in range(options.times):
            with tempfile.TemporaryDirectory() as home, ros1_graph(Path(home)) as graph:
                times.append(stop_ms(graph, victim))
        print(
            f"kill -9 of {victim:12s} {len(times)} times: robot stopped after {np.median(times):.0f} ms (median), "
            f"{max(times):.0f} ms (maximum; limit {LIMIT_MS})"
        )


if __name__ == "__main__":
    main()
