"""Two machines on one: a pair of network namespaces with a link between them, removed at the end. Needs root."""

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.processes import Peer

PREFIX = "handsteer-test"
DEVICE = "link0"
ROBOT, WORKSTATION = "10.77.0.1", "10.77.0.2"
"""Addresses; every pair of namespaces may have the same, for nobody else sees them."""
RELAY = Path(__file__).with_name("relay.py")


class NoNamespacesError(Exception):
    """This machine or user cannot have network namespaces; says why."""


@dataclass(frozen=True)
class Machine:
    """One of the two namespaces.

    Attributes:
        namespace: Its name.
        address: Its address on the link.
    """

    namespace: str
    address: str

    def command(self, *words: str) -> list[str]:
        """Return what runs ``words`` on this machine; it becomes that process, so that signals reach it."""
        return ["ip", "netns", "exec", self.namespace, *words]

    def start(self, *words: str, log: Path) -> Peer:
        """Start a program on this machine that says ``ready``; it ends with the machine at the latest."""
        return Peer(self.command(*words), dict(os.environ), log)

    def run(self, *words: str) -> str:
        """Run a command on this machine and return what it prints."""
        return run(*self.command(*words))


class Link:
    """What joins the machines.

    Args:
        robot: One end.
        workstation: The other.
        log: Where the relay says what goes wrong.

    Attributes:
        robot, workstation: Its ends.
        kind: ``netem`` or ``relay``.
    """

    def __init__(self, robot: Machine, workstation: Machine, log: Path) -> None:
        self.robot, self.workstation = self._ends = (robot, workstation)
        self._limiter: Peer | None = None
        self._shape = (0.0, 0.0, 0.0)
        self.kind = "netem" if has_netem(robot) else "relay"
        one, other = ([end.namespace, DEVICE] for end in self._ends)
        if self.kind == "netem":
            run("ip", "link", "add", one[1], "netns", one[0], "type", "veth", "peer", other[1], "netns", other[0])
        else:
            self._limiter = Peer([sys.executable, str(RELAY), *one, *other], dict(os.environ), log)
        for end in self._ends:
            end.run("ip", "address", "add", f"{end.address}/24", "dev", DEVICE)
            end.run("ip", "link", "set", DEVICE, "up")
            end.run("ip", "link", "set", "lo", "up")

    def shape(self, delay_s: float = 0.0, jitter_s: float = 0.0, loss: float = 0.0) -> None:
        """Delay and lose frames from now on, in both directions; ``loss`` is a share, 0 to 1."""
        self._shape = (delay_s, jitter_s, loss)
        self._apply(*self._shape)

    def cut(self) -> float:
        """Let nothing pass; return when, in Unix time."""
        return self._apply(0.0, 0.0, 1.0)

    def cut_off(self, machine: Machine) -> float:
        """Let nothing come to ``machine``, which is still heard; return when, in Unix time."""
        if self._limiter is not None:
            number = self._ends.index(machine)
            return float(self._limiter.ask("shape", delay_s=0.0, jitter_s=0.0, loss=0.0, cut_off=number)["at_s"])
        began_s = time.time()
        other = self._ends[1 - self._ends.index(machine)]
        other.run("tc", "qdisc", "replace", "dev", DEVICE, "root", "netem", "loss", "100%")
        return began_s

    def restore(self) -> float:
        """Let frames pass as before the cut; return when, in Unix time."""
        return self._apply(*self._shape)

    def without_multicast(self) -> None:
        """Carry no multicast, as many a Wi-Fi does."""
        for end in self._ends:
            end.run("ip", "link", "set", DEVICE, "multicast", "off")

    def close(self) -> None:
        """Remove the link's own process; the rest goes with the namespaces."""
        if self._limiter is not None:
            self._limiter.kill()

    def _apply(self, delay_s: float, jitter_s: float, loss: float) -> float:
        if self._limiter is not None:
            return float(self._limiter.ask("shape", delay_s=delay_s, jitter_s=jitter_s, loss=loss)["at_s"])
        began_s = time.time()
        words = ["delay", f"{delay_s * 1000:g}ms", f"{jitter_s * 1000:g}ms", "loss", f"{loss * 100:g}%"]
        for end in self._ends:
            end.run("tc", "qdisc", "replace", "dev", DEVICE, "root", "netem", *words)
        return began_s


@contextlib.contextmanager
def two_machines(home: Path) -> Iterator[tuple[Machine, Machine, Link]]:
    """The robot's machine, the workstation and the link between them, for as long as the block lasts.

    Raises:
        NoNamespacesError: They cannot be had here.
    """
    remove_leftovers()
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    stem = f"{PREFIX}-{worker}-{os.getpid()}"
    machines = Machine(f"{stem}-robot", ROBOT), Machine(f"{stem}-workstation", WORKSTATION)
    link: Link | None = None
    try:
        try:
            for machine in machines:
                run("ip", "netns", "add", machine.namespace)
            link = Link(*machines, home / "relay.log")
        except (OSError, subprocess.CalledProcessError, AssertionError) as error:
            raise NoNamespacesError(getattr(error, "stderr", None) or str(error)) from error
        yield *machines, link
    finally:
        if link is not None:
            link.close()
        for machine in machines:
            remove(machine.namespace)


def has_netem(machine: Machine) -> bool:
    """Whether the kernel can delay and lose frames by itself."""
    probe = machine.command("tc", "qdisc", "add", "dev", "lo", "root", "netem", "delay", "1ms")
    try:
        if subprocess.run(probe, capture_output=True, check=False).returncode:
            return False
    except OSError:
        return False
    machine.run("tc", "qdisc", "del", "dev", "lo", "root")
    return True


def remove_leftovers() -> None:
    """Remove the namespaces of test runs that were killed."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        for line in run("ip", "netns", "list").splitlines():
            name = line.split(" ")[0]
            if name.startswith(f"{PREFIX}-") and not Path(f"/proc/{name.split('-')[3]}").exists():
                remove(name)


def remove(namespace: str) -> None:
    """Remove a namespace of ours, and end what runs in it; it may be gone already."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        for number in run("ip", "netns", "pids", namespace).split():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(number), 9)
        run("ip", "netns", "delete", namespace)


def run(*words: str) -> str:
    """Run a command and return what it prints."""
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout
