"""Selects the DDS domain and the network from ROS 2's environment variables; needs no package for DDS."""

import contextlib
import re
import socket
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from handsteer.errors import TransportError
from handsteer.plugins.ros2.names import domain_id

try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None  # type: ignore[assignment]

_UP, _LOOPBACK, _POINT_TO_POINT, _MULTICAST = 0x1, 0x8, 0x10, 0x1000
_GET_FLAGS, _GET_ADDRESS = 0x8913, 0x8915
_RANGES = ("LOCALHOST", "SUBNET", "OFF", "SYSTEM_DEFAULT")
_ADDRESS = re.compile(r"[A-Za-z0-9_.:%\[\]-]+")
# How soon others find us if they cannot reach us by their own announcements, or again after a loss of connection;
# Cyclone's default is half a minute.
_ANNOUNCE_S = 2
# Others may start at any time: by default, Cyclone drops an address at which no other was found for half a minute.
_KEEP_ADDRESSES = "inf"
# A packet per port is sent to each address. Participants of Cyclone DDS with range subnet use only one network card,
# the first suitable one.
_OWN_ADDRESSES = 3
# Every process uses the two UDP ports of its index, which firewalls and static peers rely on. If others are found by
# address, all ports are tried, so there are fewer.
PLACES, PLACES_BY_MULTICAST = 33, 120
# Four raw images: with the default of 1 MB, a process that stalls for a frame or two loses one. The system may give
# less (Linux: net.core.rmem_max), without any report.
_RECEIVE_BUFFER = "4MiB"
# No writer waits for a slow reader, however large its messages are: each keeps a few, and drops older ones for newer.
# With the default of 500 kB, one unconfirmed raw image would delay the next.
_UNCONFIRMED = "1GiB"
_PLACES = {
    "LOCALHOST": "this machine",
    "PEERS": "this machine and ROS_STATIC_PEERS",
    "SUBNET": "the subnet",
    "OFF": "no other node",
    "SYSTEM_DEFAULT": "as configured in Cyclone DDS",
    "CYCLONEDDS_URI": "as CYCLONEDDS_URI says",
}


@dataclass(frozen=True)
class Network:
    """Where to look for others.

    Attributes:
        domain: Number of the DDS domain, 0 to 232.
        config: Configuration of Cyclone DDS, as XML; None leaves it to the user's ``CYCLONEDDS_URI`` or its defaults.
        distribution: The ROS 2 distribution for discovery: ``humble``, or ``jazzy`` for all newer ones.
        reach: One of ROS 2's ranges, ``PEERS`` for this machine and static peers, or ``CYCLONEDDS_URI``.
        places: How many participants of the domain can have ports of their own on this machine; None if unknown.
    """

    domain: int
    config: str | None
    distribution: str = "jazzy"
    reach: str = "LOCALHOST"
    places: int | None = None

    @property
    def is_local(self) -> bool:
        """Whether it is certainly restricted to this machine."""
        return self.reach in {"LOCALHOST", "OFF"}

    @property
    def place(self) -> str:
        """Domain and range, in words."""
        return f"domain {self.domain}, {_PLACES[self.reach]}"


def network(environment: Mapping[str, str], addresses: Sequence[str] | None = None) -> Network:
    """Return the network configured by ``environment``; by default, only this machine.

    ``ROS_DOMAIN_ID``, ``ROS_LOCALHOST_ONLY``, ``ROS_AUTOMATIC_DISCOVERY_RANGE``, ``ROS_STATIC_PEERS`` and
    ``ROS_DISTRO`` have their meanings in ROS 2; the user's ``CYCLONEDDS_URI`` overrides all but the domain.

    Args:
        environment: Environment variables.
        addresses: Those of this machine's network cards, used by nodes with range subnet; None asks the system.

    Raises:
        TransportError: A variable has a value that is not allowed.
    """
    domain = domain_id(environment)
    distribution = "humble" if environment.get("ROS_DISTRO") == "humble" else "jazzy"
    reach = _range(environment)
    peers = _peers(environment.get("ROS_STATIC_PEERS", ""))
    if environment.get("ROS_LOCALHOST_ONLY") == "1" or reach == "OFF":
        peers = []
    if environment.get("CYCLONEDDS_URI"):
        return Network(domain, None, distribution, "CYCLONEDDS_URI")
    if reach == "SYSTEM_DEFAULT":
        return Network(domain, None, distribution, reach)
    places = PLACES_BY_MULTICAST if reach == "SUBNET" and not peers else PLACES
    found = "PEERS" if peers and reach == "LOCALHOST" else reach
    own: Sequence[str] = []
    if reach == "LOCALHOST" and not peers and environment.get("ROS_LOCALHOST_ONLY") != "1":
        own = list(multicast_addresses().values()) if addresses is None else addresses
    config = _config(reach, peers, places, own[:_OWN_ADDRESSES])
    return Network(domain, config, distribution, found, places)


def _range(environment: Mapping[str, str]) -> str:
    only = environment.get("ROS_LOCALHOST_ONLY", "")
    if only not in {"", "0", "1"}:
        raise TransportError(f"ROS_LOCALHOST_ONLY is {only!r}: it should be 0 or 1")
    if only == "1":
        return "LOCALHOST"
    default = "SUBNET" if only == "0" else "LOCALHOST"
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or default
    if reach.upper() not in _RANGES:
        raise TransportError(f"ROS_AUTOMATIC_DISCOVERY_RANGE is {reach!r}: it should be {' or '.join(_RANGES)}")
    return reach.upper()


def _peers(text: str) -> list[str]:
    peers = [peer.strip() for peer in text.split(";") if peer.strip()]
    for peer in peers:
        if not _ADDRESS.fullmatch(peer):
            raise TransportError(f"ROS_STATIC_PEERS has {peer!r}: it should be addresses with ; between them")
    return peers


def _config(reach: str, peers: Sequence[str], places: int, own: Sequence[str]) -> str:
    multicast = "true" if reach == "SUBNET" else "false"
    everyone = [*(["127.0.0.1"] if reach == "LOCALHOST" else []), *own, *peers]
    found = "".join(f'<Peer address="{peer}"/>' for peer in everyone)
    index = f"<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{places - 1}</MaxAutoParticipantIndex>"
    announce = f"<SPDPInterval>{_ANNOUNCE_S} s</SPDPInterval>"
    keep = f"<InitialLocatorPruneDelay>{_KEEP_ADDRESSES}</InitialLocatorPruneDelay>"
    within = reach in {"LOCALHOST", "OFF"} and not peers
    return (
        "<CycloneDDS><Domain>"
        f"<General>{_interfaces(own) if within else ''}<AllowMulticast>{multicast}</AllowMulticast></General>"
        f"<Discovery>{index}{announce if own or not within else ''}{keep}<Peers>{found}</Peers></Discovery>"
        f'<Internal><SocketReceiveBufferSize min="default" max="{_RECEIVE_BUFFER}"/>'
        f"<Watermarks><WhcHigh>{_UNCONFIRMED}</WhcHigh></Watermarks></Internal>"
        "</Domain></CycloneDDS>"
    )


def _interfaces(own: Sequence[str]) -> str:
    """Return the network interfaces of a participant that is restricted to this machine.

    Participants of Cyclone DDS with range subnet do not use loopback, so they are reached on the card that both select.
    Without multicast, other machines are neither sent nor received from. Our own nodes use loopback, which does not
    depend on the card.
    """
    card = '<NetworkInterface autodetermine="true"/>' if own else ""
    return f'<Interfaces>{card}<NetworkInterface address="127.0.0.1"/></Interfaces>'


def multicast_addresses() -> dict[str, str]:
    """Return the IPv4 address of each network interface that is up and has multicast, without loopback and tunnels.

    Empty where the system does not provide them (Windows).
    """
    found = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _, name in socket.if_nameindex() if fcntl else ():
            request = struct.pack("256s", name.encode()[:15])
            with contextlib.suppress(OSError):
                (flags,) = struct.unpack_from("H", fcntl.ioctl(asking, _GET_FLAGS, request), 16)
                address = socket.inet_ntoa(fcntl.ioctl(asking, _GET_ADDRESS, request)[20:24])
                if flags & _UP and flags & _MULTICAST and not flags & (_LOOPBACK | _POINT_TO_POINT):
                    found[name] = address
    return found
