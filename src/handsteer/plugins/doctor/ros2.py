"""Checks whether this machine can join a ROS 2 graph over DDS, and what prevents it."""

import contextlib
import importlib.util
import json
import platform
import re
import socket
import subprocess
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from handsteer.errors import TransportError, install_command
from handsteer.plugins.dds.network import PLACES_BY_MULTICAST, Network, multicast_addresses, network

Verdict = Literal["ok", "optional", "wrong", "missing"]

# RTPS 2.3, section 9.6.1.1: ports of a domain, and of a participant in it.
_BASE, _PER_DOMAIN, _PER_PARTICIPANT, _OWN, _LARGEST_DOMAIN = 7400, 250, 2, 10, 232
_TABLES = ("/proc/net/udp", "/proc/net/udp6")
_GROUP = "239.255.0.1"
_ANSWER_S = 0.3

_TIMEOUT_S = 20.0
# Cyclone DDS prefixes its lines with the time, the domain and the program.
_ENGINE_LINE = re.compile(r"^\d+\.\d+ \[\d+\]\s+\S+: (.*)$", re.MULTILINE)

_RANGE_VARIABLES = frozenset(
    {"CYCLONEDDS_URI", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"}
)
_NAME = "dds"
_NEWEST_PYTHON = (3, 13)
_DOMAINS_AT_ONCE = 4
_HIDDEN = (
    "not found by programs that start now with ROS 2's default range, the subnet: start what is not found without "
    "ROS_LOCALHOST_ONLY, or those programs with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
)
# Linux assigns ports from 32768 on dynamically.
_LARGEST_SAFE_DOMAIN = 101


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes:
        name: The subject: ``camera``, ``models``, ``port``...
        verdict: ``ok``; ``optional`` if missing, but handsteer works without it; ``wrong`` if present, but probably not
            as intended; ``missing`` if handsteer does not work without it.
        detail: What was found, and how to fix a problem.
    """

    name: str
    verdict: Verdict
    detail: str


def taken_ports() -> set[int]:
    """Return the UDP ports in use on this machine; empty if the system does not report them (all but Linux)."""
    taken: set[int] = set()
    for table in _TABLES:
        with contextlib.suppress(OSError):
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
            taken |= {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    return taken


def domains_in_use(taken: set[int], participants: int) -> list[int]:
    """Return the DDS domains with participants on this machine.

    A participant uses two neighbouring ports of its own (unicast), or shares the two of its domain (multicast).

    Args:
        taken: UDP ports in use.
        participants: Number of participant indices to check in each domain.
    """
    return [
        domain
        for domain in range(_LARGEST_DOMAIN + 1)
        if any({port, port + 1} <= taken for port in (_BASE + _PER_DOMAIN * domain, *_places(domain, participants)))
    ]


def places_left(domain: int, taken: set[int], participants: int) -> int:
    """Return how many more participants can get ports in ``domain`` on this machine."""
    return sum(not {port, port + 1} & taken for port in _places(domain, participants))


def _places(domain: int, participants: int) -> range:
    first = _BASE + _PER_DOMAIN * domain + _OWN
    return range(first, first + _PER_PARTICIPANT * participants, _PER_PARTICIPANT)


def multicast_interfaces() -> dict[str, bool]:
    """Return whether a multicast packet from this machine to itself passes each network interface.

    The packet does not leave the machine. Loopback and interfaces that are down or without multicast are left out.
    """
    return {name: _hears_itself(address) for name, address in multicast_addresses().items()}


def _hears_itself(address: str) -> bool:
    interface = socket.inet_aton(address)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        try:
            receiver.bind(("", 0))
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(_GROUP) + interface)
            receiver.settimeout(_ANSWER_S)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, interface)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            sender.sendto(b"handsteer", (_GROUP, receiver.getsockname()[1]))
            return receiver.recv(16) == b"handsteer"
        except OSError:
            return False


@dataclass(frozen=True)
class Sight:
    """What was observed in a domain.

    Attributes:
        graph: What :mod:`handsteer.plugins.dds.look` prints, from JSON; None if it cannot be joined.
        problem: Why it cannot be joined: the engine's message, or else ours.
    """

    graph: dict[str, Any] | None
    problem: str = ""

    @property
    def others(self) -> list[str]:
        """The nodes in the domain, and the topics of unnamed ones."""
        graph = self.graph or {"nodes": [], "topics": []}
        return [*graph["nodes"]] or [topic["name"] for topic in graph["topics"]]


def look(environments: Mapping[int, Mapping[str, str]]) -> dict[int, Sight]:
    """Return what is observed in each domain, looked at simultaneously with its environment variables."""
    processes = {
        domain: _looking({**environment, "ROS_DOMAIN_ID": str(domain)}) for domain, environment in environments.items()
    }
    return {domain: _sight(process) for domain, process in processes.items()}


def not_found_by_others(environment: Mapping[str, str], nodes: Collection[str]) -> list[str]:
    """Return which of ``nodes`` a new participant does not find that looks at the subnet, as ROS 2 does by default.

    Unlike one with the range of ``environment``, it is found by nodes that are limited to this machine only if these
    still announce themselves.
    """
    plain = {name: value for name, value in environment.items() if name not in _RANGE_VARIABLES}
    sight = _sight(_looking({**plain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, nodes))
    return [] if sight.graph is None else sorted(set(nodes) - set(sight.graph["nodes"]))


def _looking(environment: Mapping[str, str], awaited: Collection[str] = ()) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "handsteer.plugins.dds.look", *awaited]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def _sight(process: subprocess.Popen[str]) -> Sight:
    try:
        out, words = process.communicate(timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return Sight(None, f"there was no answer within {_TIMEOUT_S:.0f} s")
    if process.returncode == 0:
        return Sight(json.loads(out))
    problems = _ENGINE_LINE.findall(words) or words.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
    return Sight(None, "; ".join(problems))


def examine_ros2(environment: Mapping[str, str]) -> list[Finding]:
    """Check the ROS 2 variables in ``environment``, the DDS engine, the network and the domain."""
    try:
        here = network(environment)
    except TransportError as error:
        return [_wrong(f"{error}; ROS 2 cannot be joined over DDS until this is fixed")]
    odd = [_wrong(words) for words in _unusual_settings(environment, here)]
    if importlib.util.find_spec("cyclonedds") is None:
        return [*odd, Finding(_NAME, "optional", _no_engine())]
    return [*odd, *_multicast(here), *_domain(environment, here)]


def _wrong(words: str) -> Finding:
    return Finding(_NAME, "wrong", words)


def _no_engine() -> str:
    if tuple(map(int, platform.python_version_tuple()[:2])) > _NEWEST_PYTHON:
        return (
            f"no cyclonedds, which --transport dds needs: there is none for Python {platform.python_version()}; "
            "use Python 3.11 to 3.13"
        )
    if platform.system() == "Linux" and platform.machine() != "x86_64":
        return f"no cyclonedds, which --transport dds needs: there is none for Linux on {platform.machine()}"
    return f"no cyclonedds, which --transport dds needs: {install_command('dds')}"


def _unusual_settings(environment: Mapping[str, str], here: Network) -> list[str]:
    problems = []
    if here.domain > _LARGEST_SAFE_DOMAIN:
        problems.append(
            f"ROS_DOMAIN_ID is {here.domain}: above {_LARGEST_SAFE_DOMAIN} other programs may be using "
            "the domain's ports; choose a smaller one"
        )
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    if environment.get("ROS_LOCALHOST_ONLY") == "1" and reach.upper() not in {"", "LOCALHOST"}:
        problems.append(f"ROS_LOCALHOST_ONLY is 1, so ROS_AUTOMATIC_DISCOVERY_RANGE={reach} is ignored: unset one")
    if environment.get("ROS_STATIC_PEERS") and here.reach in {"LOCALHOST", "OFF"}:
        problems.append(
            "ROS_STATIC_PEERS is ignored, as discovery is limited to this machine: unset ROS_LOCALHOST_ONLY or OFF"
        )
    if environment.get("ROS_DISCOVERY_SERVER"):
        problems.append(
            "ROS_DISCOVERY_SERVER is set: nodes that use only a discovery server are not found; unset it there"
        )
    middleware = environment.get("RMW_IMPLEMENTATION", "")
    if middleware and not middleware.startswith(("rmw_cyclonedds", "rmw_fastrtps", "rmw_connextdds")):
        problems.append(f"RMW_IMPLEMENTATION is {middleware}: ROS 2 nodes then do not use DDS, and are not found")
    return problems


def _multicast(here: Network) -> list[Finding]:
    if here.reach != "SUBNET":
        return []
    works = multicast_interfaces()
    if any(works.values()):
        heard = ", ".join(name for name, does in works.items() if does)
        return [Finding(_NAME, "ok", f"multicast works on {heard}, as far as one machine can check")]
    why = f"{', '.join(works)} blocks it (a firewall?)" if works else "no network interface supports it"
    return [
        _wrong(
            f"no multicast, which finds the nodes on the subnet: {why}; name the other machines in "
            "ROS_STATIC_PEERS instead, with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
        )
    ]


def _domain(environment: Mapping[str, str], here: Network) -> list[Finding]:
    taken = taken_ports()
    in_use = domains_in_use(taken, PLACES_BY_MULTICAST)
    elsewhere = [domain for domain in in_use if domain != here.domain]
    if here.reach != "LOCALHOST" and here.domain != 0 and 0 not in elsewhere:
        elsewhere.append(0)  # ROS 2's default domain, which other machines may use
    sights = look(dict.fromkeys([here.domain, *elsewhere[:_DOMAINS_AT_ONCE]], environment))
    ours = sights.pop(here.domain)
    if ours.graph is None:
        return [_wrong(_not_joined(ours.problem, here, taken))]
    found = [_wrong(warning) for warning in ours.graph["warnings"]]
    if ours.others:
        return [Finding(_NAME, "ok", f"{here.place}: {_some(ours.others)}"), *found, *_hidden(environment, here, ours)]
    return [_no_others(here, here.domain in in_use, sights)]


def _hidden(environment: Mapping[str, str], here: Network, ours: Sight) -> list[Finding]:
    nodes = (ours.graph or {"nodes": []})["nodes"]
    is_alone = environment.get("ROS_LOCALHOST_ONLY") == "1" or not multicast_addresses()
    if here.reach != "LOCALHOST" or is_alone or not nodes:
        return []
    hidden = not_found_by_others(environment, nodes)
    return [_wrong(f"{here.place}: {_some(hidden)} {_HIDDEN}")] if hidden else []


def _not_joined(problem: str, here: Network, taken: set[int]) -> str:
    if here.reach == "CYCLONEDDS_URI":
        return f"CYCLONEDDS_URI cannot be used: {problem}; fix or unset it"
    if here.places and taken and not places_left(here.domain, taken, here.places):
        ports = _places(here.domain, here.places)
        return (
            f"all {here.places} places in domain {here.domain} on this machine are taken (UDP ports {ports.start} to "
            f"{ports.stop - 1}): end some nodes, or choose another ROS_DOMAIN_ID"
        )
    return f"{here.place} cannot be joined: {problem}"


def _no_others(here: Network, is_inhabited: bool, elsewhere: Mapping[int, Sight]) -> Finding:
    seen = {domain: sight.others for domain, sight in elsewhere.items() if sight.others}
    if is_inhabited and here.reach != "SUBNET":
        return _wrong(
            f"{here.place}: another node on this machine is in this domain, but was not found; it may use another "
            "network interface, or none: unset ROS_LOCALHOST_ONLY, and set ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET in both"
        )
    if seen:
        others = "; ".join(f"domain {domain} has {_some(nodes)}" for domain, nodes in seen.items())
        return _wrong(
            f"{here.place}: no other nodes; but {others}. To reach them, set ROS_DOMAIN_ID={next(iter(seen))} here, or "
            f"{here.domain} there"
        )
    return Finding(_NAME, "ok", f"{here.place}: no other nodes yet")


def _some(nodes: list[str], most: int = 4) -> str:
    return ", ".join(nodes[:most]) + (f" and {len(nodes) - most} more" if len(nodes) > most else "")
