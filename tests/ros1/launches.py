"""A real ROS 1 graph in which this repository's launch files run, and what there is to see of them from outside."""

import math
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.processes import Peer, Process
from tests.ros1.graph import Ros1Graph

ROOT = Path(__file__).resolve().parents[2]
ROS = ROOT / "ros"

FIELDS = {
    "geometry_msgs/Twist": {"linear": "linear.x", "angular": "angular.z"},
    "nav_msgs/Odometry": {
        "stamp_s": "header.stamp",
        "frame_id": "header.frame_id",
        "x": "pose.pose.position.x",
        "qz": "pose.pose.orientation.z",
        "qw": "pose.pose.orientation.w",
        "linear": "twist.twist.linear.x",
        "angular": "twist.twist.angular.z",
    },
    "sensor_msgs/JointState": {"stamp_s": "header.stamp"},
    "std_msgs/String": {"word": "data"},
    "tf2_msgs/TFMessage": {},
}
"""What is noted of a message, by its type: names of the tests, and where they are in the message."""


def ros_environment(**more: str) -> dict[str, str]:
    """Return this process's environment, with the packages of this repository, no display, and the tested handsteer."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("ROS_") and name != "DISPLAY"}
    paths = f"{Path(sys.executable).parent}:{kept['PATH']}"
    return {**kept, "PATH": paths, "ROS_HOSTNAME": "localhost", "ROS_PACKAGE_PATH": str(ROS), **more}


def run(*command: str, env: dict[str, str], timeout_s: float = 90.0) -> str:
    """Run ``command`` and return what it prints; it must succeed."""
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=timeout_s, check=False)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


class Launch(Process):
    """A ``roslaunch`` that runs."""

    def kill(self) -> None:
        """End it as Ctrl-C does, so that it ends its nodes."""
        if self.running:
            self.signal(signal.SIGINT)
            try:
                self.code(30)
            except subprocess.TimeoutExpired:
                self.popen.kill()
        self.popen.wait(30)


class Recorder:
    """Notes the messages of some topics, each with its arrival on the clock that all processes of the machine share.

    Args:
        peer: The node that listens.
        topics: Type of each topic by its name.
    """

    def __init__(self, peer: Peer, topics: dict[str, str]) -> None:
        self._peer = peer
        self._fields = {topic: FIELDS[kind] for topic, kind in topics.items()}
        for topic, kind in topics.items():
            package, name = kind.split("/")
            peer.ask("record", topic=topic, package=package, type=name, fields=list(FIELDS[kind].values()))

    def of(self, topic: str, since_s: float = 0.0) -> list[dict[str, Any]]:
        """Return what came on ``topic`` since ``since_s``, oldest first; ``at_s`` is when."""
        names = self._fields[topic]
        noted = self._peer.ask("get", topic=topic)
        return [
            _with_yaw({"at_s": at_s, **dict(zip(names, values, strict=True))})
            for at_s, values in noted
            if at_s >= since_s
        ]


class LaunchGraph(Ros1Graph):
    """A graph with launch files in it."""

    def start(self) -> "LaunchGraph":
        """Start the master."""
        super().start()
        self.env = ros_environment(**{name: self.env[name] for name in ("ROS_MASTER_URI", "ROS_HOME")})
        return self

    def launch(self, package: str, file: str, *args: str, **env: str) -> Launch:
        """Start ``roslaunch``; the caller waits for whatever it needs."""
        words = ["roslaunch", "--wait", package, file, *args]
        return self.adopt(Launch(words, {**self.env, **env}, self.log("launch")))

    def launch_file(self, file: Path, *args: str) -> Launch:
        """Start ``roslaunch`` on a file that is in no package."""
        return self.adopt(Launch(["roslaunch", "--wait", str(file), *args], self.env, self.log("launch")))

    def record(self, topics: dict[str, str]) -> Recorder:
        """Note what comes on ``topics``, given as type by name."""
        return Recorder(self.peer(), topics)

    def pid(self, node: str) -> int | None:
        """Return the process that ``node`` runs in, or None while it does not answer."""
        code, _, uri = self.master.lookupNode("/test", node)
        try:
            return int(type(self.master)(uri).getPid("/test")[2]) if code == 1 else None
        except OSError:
            return None

    def tell(self, *command: str) -> str:
        """Run one of ROS's command line tools and return what it prints."""
        return run(*command, env=self.env)


def _with_yaw(noted: dict[str, Any]) -> dict[str, Any]:
    if "qz" in noted:
        noted["yaw"] = math.remainder(2 * math.atan2(noted["qz"], noted["qw"]), math.tau)
    return noted
