"""A Zenoh network of its own for a test, with its router, and processes in it."""

import os
import sys
from pathlib import Path

from tests.contracts.ros2_node_contract import PeerGraph
from tests.processes import NODES, Peer, Process, eventually, free_port

PEER = Path(__file__).with_name("peer.py")
MODULES = (*NODES, "handsteer.plugins.zenoh.transport")
DOMAIN = 7
_VARIABLES = (
    "ZENOH_CONFIG_OVERRIDE",
    "ZENOH_ROUTER_CHECK_ATTEMPTS",
    "ZENOH_ROUTER_CONFIG_URI",
    "ZENOH_SESSION_CONFIG_URI",
    "RUST_LOG",
)


class ZenohGraph(PeerGraph):
    """A network around a router, with a plain Zenoh program in it.

    Args:
        home: Folder for what the processes say.
        mode: ``peer``, in which processes connect directly, or ``client``, in which all goes by the router.

    Attributes:
        router: ``handsteer zenoh-router``.
    """

    transport = "zenoh"

    def __init__(self, home: Path, mode: str = "peer") -> None:
        super().__init__(home)
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        plain = {name: value for name, value in os.environ.items() if name not in _VARIABLES}
        self.env = {**plain, "ROS_DOMAIN_ID": str(DOMAIN), "PYTHONUNBUFFERED": "1"}
        self.router = self.start_router()
        self.env["ZENOH_CONFIG_OVERRIDE"] = f'mode="{mode}";connect/endpoints=["{self.endpoint}"]'
        self._mode = mode
        self.peer = self.start_peer()

    def start_router(self) -> Process:
        """Start the router; wait until it listens."""
        env = {name: value for name, value in self.env.items() if name not in _VARIABLES}
        router = self._start(["zenoh-router", "--listen", self.endpoint], env)
        eventually(lambda: "the Zenoh router listens" in router.text or not router.running)
        assert router.running, router.text
        return router

    def start_peer(self) -> Peer:
        command = [sys.executable, str(PEER), self.endpoint, str(DOMAIN)]
        return self.adopt(
            Peer(command, {**self.env, "PEER_CONFIG": f'mode="{self._mode}"'}, self.log("peer"), ("zenoh",))
        )

    def handsteer(self, *arguments: str, **env: str) -> Process:
        return self._start(list(arguments), {**self.env, **env})

    def publishes(self, node: str, topic: str) -> bool:
        return topic in self.nodes()[node]["MP"]

    def _start(self, arguments: list[str], env: dict[str, str]) -> Process:
        return self.adopt(Process([sys.executable, "-m", "handsteer", *arguments], env, self.log(), MODULES))
