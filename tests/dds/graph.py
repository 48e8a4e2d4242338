"""A DDS domain of its own for a test, and processes in it."""

import contextlib
import fcntl
import os
import random
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tests.contracts.ros2_node_contract import PeerGraph
from tests.processes import NODES, Peer, Process

PEER = Path(__file__).with_name("peer.py")
MODULES = {"dds": "handsteer.plugins.dds.transport", "ros2": "handsteer.plugins.ros2.session"}
# Domains above have their ports among those that the system gives to others.
_LARGEST_DOMAIN = 100
# Whoever was killed is still in its domain for others, for ten seconds.
_AT_ONCE = 10
ROS_VARIABLES = (
    "CYCLONEDDS_URI",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_DISTRO",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
)


_claims: list[int] = []


def free_domain() -> int:
    """Return the number of a domain that no other test on this machine uses."""
    if len(_claims) == _AT_ONCE:
        os.close(_claims.pop(0))  # its test ended long ago
    for domain in random.sample(range(1, _LARGEST_DOMAIN + 1), _LARGEST_DOMAIN):
        claim = os.open(Path(tempfile.gettempdir(), f"handsteer_test_domain_{domain}"), os.O_CREAT | os.O_RDWR)
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(claim, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _claims.append(claim)
            return domain
        os.close(claim)
    raise AssertionError("all DDS domains are taken by other tests")


class DdsGraph(PeerGraph):
    """A domain, with a plain DDS program in it.

    Attributes:
        python: What runs our nodes.

    Args:
        home: Folder for logs.
        peer: Command that starts the plain program; the domain is added.
    """

    transport = "dds"
    python = sys.executable

    def __init__(self, home: Path, peer: Sequence[str] = (sys.executable, str(PEER))) -> None:
        super().__init__(home)
        self._peer_command = list(peer)
        self.domain = free_domain()
        self.env = {**os.environ, "ROS_DOMAIN_ID": str(self.domain), "PYTHONUNBUFFERED": "1"}
        for inherited in ROS_VARIABLES:
            self.env.pop(inherited, None)
        self.env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # ours by default, but not ROS 2's
        self.peer = self.start_peer()

    def start_peer(self, machine: str = "") -> Peer:
        """Start a plain program, as ``tests/dds/peer.py`` tells; wait until it is ready.

        Args:
            machine: Name of the machine that it says it is on, if that is not this one.
        """
        command = [*self._peer_command, str(self.domain), "", machine]
        return self.adopt(Peer(command, self.env, self.log("peer"), ("cyclonedds.domain", "rclpy")))

    def handsteer(self, *arguments: str) -> Process:
        command = [self.python, "-m", "handsteer", *arguments]
        return self.adopt(Process(command, self.env, self.log(), (*NODES, MODULES[self.transport])))

    def publishes(self, node: str, topic: str) -> bool:
        return f"rt{topic}" in self.nodes()[node]["writers"]
