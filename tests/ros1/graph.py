"""A real ROS 1 graph for tests: a master on a port of its own, and processes in it."""

import contextlib
import os
import signal
import subprocess
import sys
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.processes import NODES, Peer, Process, Processes, as_tests_drive, eventually, free_port

PEER = Path(__file__).with_name("peer.py")
ROSPY = ("rosgraph.xmlrpc", "rosgraph.roslogging", "roscpp.srv", "rosgraph_msgs.msg", "roslib.message", "rospkg")
"""What rospy imports; it reads the namespace of the command line while it is imported itself."""
MODULES = (*NODES, *ROSPY, "handsteer.plugins.ros1.conversion")


class Ros1Graph(Processes):
    """A ``roscore`` on a free port, and the processes that a test starts in its graph.

    Attributes:
        uri: Address of the master.
        env: Environment of the processes.
    """

    def __init__(self, home: Path) -> None:
        super().__init__(home)
        self._core: subprocess.Popen[bytes] | None = None
        self.uri = ""
        self.env: dict[str, str] = {}

    def start(self) -> "Ros1Graph":
        """Start the master, and wait until it and ``/rosout`` are there."""
        port = free_port()
        self.uri = f"http://localhost:{port}"
        self.env = {
            **os.environ,
            "ROS_MASTER_URI": self.uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_HOME": str(self._home),
            "PYTHONUNBUFFERED": "1",
        }
        for inherited in ("ROS_IP", "ROS_NAMESPACE"):
            self.env.pop(inherited, None)
        with (self._home / "roscore.log").open("wb") as log:
            self._core = subprocess.Popen(
                ["roscore", "-p", str(port)], env=self.env, stdout=log, stderr=log, start_new_session=True
            )
        eventually(lambda: "/rosout" in self.nodes(), what="roscore")
        return self

    def restart_master(self) -> None:
        """Kill the master's process, and start another at the same address; roscore ends itself meanwhile."""
        self.kill_master()
        self.run("rosmaster", "--core", "-p", self.uri.rpartition(":")[2])
        eventually(self._master_answers, what="the other master")

    def _master_answers(self) -> bool:
        try:
            return bool(self.master.getPid("/test"))
        except OSError:
            return False

    def stop(self) -> None:
        """End all processes, the master last."""
        super().stop()
        self.stop_master()

    def stop_master(self) -> None:
        """End the master."""
        if self._core is not None:
            self._core.send_signal(signal.SIGINT)
            try:
                self._core.wait(10)
            except subprocess.TimeoutExpired:
                os.killpg(self._core.pid, signal.SIGKILL)
                self._core.wait()
            self._core = None

    def kill_master(self) -> None:
        """Kill the master's process, which says nothing to anybody."""
        os.kill(self.master.getPid("/test")[2], signal.SIGKILL)

    def nodes(self) -> set[str]:
        """Return the full names of all nodes; empty when no master answers."""
        try:
            _, _, state = self.master.getSystemState("/test")
        except OSError:
            return set()
        return {node for kind in state for _, nodes in kind for node in nodes}

    def topics(self) -> dict[str, tuple[set[str], set[str]]]:
        """Return who publishes and who subscribes to each topic."""
        _, _, (publishers, subscribers, _) = self.master.getSystemState("/test")
        sending, listening = dict(publishers), dict(subscribers)
        return {name: (set(sending.get(name, ())), set(listening.get(name, ()))) for name in {*sending, *listening}}

    def listeners(self, topic: str) -> list[str]:
        """Return the full names of the nodes that subscribe to ``topic``."""
        return sorted(self.topics().get(topic, (set(), set()))[1])

    def talkers(self, topic: str) -> list[str]:
        """Return the full names of the nodes that publish ``topic``."""
        return sorted(self.topics().get(topic, (set(), set()))[0])

    def connected(self, node: str, topic: str) -> list[str]:
        """Return the full names of the nodes to which ``node`` sends ``topic``: the master knows no connections."""
        _, _, uri = self.master.lookupNode("/test", node)
        interface: Any = xmlrpc.client.ServerProxy(uri)
        _, _, info = interface.getBusInfo("/test")
        return [other for _, other, direction, _, name, *_ in info if (direction, name) == ("o", topic)]

    @property
    def master(self) -> Any:
        """The master's XML-RPC interface."""
        return xmlrpc.client.ServerProxy(self.uri)

    def set_parameter(self, name: str, value: object) -> None:
        """Set a parameter on the master."""
        self.master.setParam("/test", name, value)

    def run(self, *command: str) -> Process:
        """Start a process in this graph."""
        return self.adopt(Process(list(command), self.env, self.log()))

    def handsteer(self, *arguments: str) -> Process:
        """Start ``handsteer`` with ``arguments`` in this graph."""
        return self.adopt(Process([sys.executable, "-m", "handsteer", *arguments], self.env, self.log(), MODULES))

    def node(self, verb: str, *arguments: str, name: str = "") -> Process:
        """Start one of handsteer's nodes and wait until it is in the graph under ``name``."""
        process = self.handsteer(verb, "--transport", "ros1", *as_tests_drive(verb, arguments))
        if name:
            eventually(lambda: name in self.nodes() or not process.running, what=f"{name} to start")
            assert process.running, process.text
        return process

    def peer(self, *arguments: str) -> Peer:
        """Start a plain rospy node, as ``tests/ros1/peer.py`` tells; wait until it is ready."""
        return self.adopt(Peer([sys.executable, str(PEER), *arguments], self.env, self.log("peer"), ROSPY))


@contextlib.contextmanager
def ros1_graph(home: Path) -> Iterator[Ros1Graph]:
    """A graph with a master, for as long as the block lasts."""
    graph = Ros1Graph(home)
    try:
        yield graph.start()
    finally:
        graph.stop()
