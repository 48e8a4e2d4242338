"""Whether this machine still has the addresses from which Cyclone DDS sends: it selects them once, when it starts."""

import contextlib
import errno
import math
import socket
import struct
import time
from pathlib import Path

from handsteer.errors import TransportError
from handsteer.plugins.dds.network import multicast_addresses

_LOOK_S = 1.0
_SOCKETS, _UDP = Path("/proc/self/fd"), Path("/proc/self/net/udp")
_LOCAL, _INODE = 1, 9
_ANY, _LOOPBACK = "0.0.0.0", "127."


class AddressWatch:
    """Ends a session whose addresses have been replaced, as by DHCP or in another Wi-Fi: what it sends goes nowhere.

    Made when this process has joined the domain. An address that was there by then does not replace them: with that of
    a scanner's own network or of a bridge for containers, a node started again would miss the return of a Wi-Fi.
    """

    def __init__(self) -> None:
        self._used = sending_addresses()
        self._known = {*self._used, *multicast_addresses().values()}
        self._looked_s = -math.inf

    def check(self) -> None:
        """Look whether the addresses have been replaced, once a second at most.

        Raises:
            TransportError: They have.
        """
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_S:
            self._looked_s = now_s
            self.look()

    def look(self) -> None:
        """Look whether the addresses have been replaced: none is left, and there is a new one.

        Raises:
            TransportError: They have.
        """
        if not self._used or any(map(_is_ours, self._used)):
            return
        new = [address for address in multicast_addresses().values() if address not in self._known]
        if new:
            raise TransportError(
                f"the address of this machine has changed from {', '.join(sorted(self._used))} to {', '.join(new)}: "
                "start handsteer again"
            )


def sending_addresses() -> set[str]:
    """Return the IPv4 addresses from which the UDP sockets of this process send, without loopback.

    Empty where the system does not provide them (all but Linux).
    """
    if not _UDP.exists():
        return set()
    own = set()
    for each in _SOCKETS.iterdir():
        with contextlib.suppress(OSError):  # closed since it was listed
            own.add(str(each.readlink()))
    rows = [row.split() for row in _UDP.read_text().splitlines()[1:]]
    found = {_address(row[_LOCAL]) for row in rows if f"socket:[{row[_INODE]}]" in own}
    return {address for address in found if address != _ANY and not address.startswith(_LOOPBACK)}


def _address(local: str) -> str:
    return socket.inet_ntoa(struct.pack("=I", int(local.partition(":")[0], 16)))


def _is_ours(address: str) -> bool:
    """Return whether this machine has ``address``, on an interface that is up or down."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError as error:
            return error.errno != errno.EADDRNOTAVAIL
    return True
