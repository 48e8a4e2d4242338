"""A Zenoh network of its own for a test, with its router, and processes in it."""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.processes import NODES, Peer, Process, Processes, as_tests_drive, eventually, free_port

PEER = Path(__file__).with_name("peer.py")
MODULES = (*NODES, "handsteer.transports.zenoh.transport")
DOMAIN = 7
_VARIABLES = (
    "ZENOH_CONFIG_OVERRIDE",
    "ZENOH_ROUTER_CHECK_ATTEMPTS",
    "ZENOH_ROUTER_CONFIG_URI",
    "ZENOH_SESSION_CONFIG_URI",
    "RUST_LOG",
)


class ZenohGraph(Processes):
    """The processes of a test around a router, with one plain Zenoh program among them that looks on.

    Args:
        home: Folder for what the processes say.
        mode: ``peer``, in which processes connect directly, or ``client``, in which all goes by the router.

    Attributes:
        env: Environment of the processes.
        router: ``handsteer zenoh-router``.
        peer: The plain program.
    """

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
        """Start a plain program; wait until it is ready."""
        command = [sys.executable, str(PEER), self.endpoint, str(DOMAIN)]
        return self.adopt(
            Peer(command, {**self.env, "PEER_CONFIG": f'mode="{self._mode}"'}, self.log("peer"), ("zenoh",))
        )

    def handsteer(self, *arguments: str, **env: str) -> Process:
        """Start ``handsteer`` with ``arguments`` in this network."""
        return self._start(list(arguments), {**self.env, **env})

    def node(self, verb: str, *arguments: str, name: str, ros: tuple[str, ...] = ()) -> Process:
        """Start one of handsteer's nodes and wait until it is in the graph under ``name``."""
        process = self.handsteer(
            verb, "--transport", "zenoh", *as_tests_drive(verb, arguments), *(("--ros-args", *ros) if ros else ())
        )
        eventually(lambda: name in self.nodes() or not process.running, what=f"{name} to start")
        assert process.running, process.text
        return process

    def nodes(self) -> dict[str, Any]:
        """Return the nodes as the plain program knows them: what they publish and subscribe to."""
        return dict(self.peer.ask("graph"))

    def publishes(self, node: str, topic: str) -> bool:
        """Return whether the node publishes on the topic."""
        return topic in self.nodes()[node]["MP"]

    def _start(self, arguments: list[str], env: dict[str, str]) -> Process:
        return self.adopt(Process([sys.executable, "-m", "handsteer", *arguments], env, self.log(), MODULES))


@contextlib.contextmanager
def zenoh_graph(home: Path, mode: str = "peer") -> Iterator[ZenohGraph]:
    """A network with a router and a plain program in it, for as long as the block lasts."""
    graph = ZenohGraph(home, mode)
    try:
        yield graph
    finally:
        graph.stop()
