"""What the system tells of UDP: which ports are taken, and whether multicast works."""

import contextlib
import socket
from pathlib import Path

from handsteer.transports.dds.interfaces import multicast_addresses

# RTPS 2.3, section 9.6.1.1: the ports of a domain, and of a participant in it.
_BASE, _PER_DOMAIN, _PER_PARTICIPANT, _OWN, _LARGEST_DOMAIN = 7400, 250, 2, 10, 232
_TABLES = ("/proc/net/udp", "/proc/net/udp6")
_GROUP = "239.255.0.1"
_ANSWER_S = 0.3


def taken_ports() -> set[int]:
    """Return the UDP ports that are taken on this machine; empty where the system does not tell (all but Linux)."""
    taken: set[int] = set()
    for table in _TABLES:
        with contextlib.suppress(OSError):
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
            taken |= {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    return taken


def domains_in_use(taken: set[int], participants: int) -> list[int]:
    """Return the DDS domains that have participants on this machine.

    A participant takes two neighbouring ports of its own (unicast), or it shares the two of its domain (multicast).

    Args:
        taken: UDP ports.
        participants: How many places are looked at in each domain.
    """
    return [
        domain
        for domain in range(_LARGEST_DOMAIN + 1)
        if any({port, port + 1} <= taken for port in (_BASE + _PER_DOMAIN * domain, *_places(domain, participants)))
    ]


def places_left(domain: int, taken: set[int], participants: int) -> int:
    """Return how many more participants find a port of their own in ``domain`` on this machine."""
    return sum(not {port, port + 1} & taken for port in _places(domain, participants))


def _places(domain: int, participants: int) -> range:
    first = _BASE + _PER_DOMAIN * domain + _OWN
    return range(first, first + _PER_PARTICIPANT * participants, _PER_PARTICIPANT)


def multicast_interfaces() -> dict[str, bool]:
    """Return whether each network interface lets a multicast packet through that this machine sends to itself.

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
