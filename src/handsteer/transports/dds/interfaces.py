"""The network interfaces of this machine."""

import contextlib
import socket
import struct

try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None  # type: ignore[assignment]

_UP, _LOOPBACK, _POINT_TO_POINT, _MULTICAST = 0x1, 0x8, 0x10, 0x1000
_GET_FLAGS, _GET_ADDRESS = 0x8913, 0x8915


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
