"""Addresses of this machine, on which handsteer serves what people look at."""

import errno
import ipaddress
import os
import socket

from handsteer.errors import HandsteerError


def is_loopback(host: str) -> bool:
    """Return whether ``host``, a name or an address, is this machine's loopback, which no other machine can reach."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def listen(
    host: str, port: int, buffer_bytes: int, *, options: tuple[str, str], error: type[HandsteerError]
) -> socket.socket:
    """Return a socket that listens on ``host`` and ``port``; port 0 picks a free one.

    Args:
        host: A name or an address of this machine.
        port: 0 to 65535.
        buffer_bytes: How much the system buffers for a slow client; what it buffers is not the newest any more.
        options: The options for host and port, named in messages.
        error: The type of the error to raise.

    Raises:
        HandsteerError: This machine has no such address, or the port cannot be used; of the type ``error``.
    """
    for_host, for_port = options
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except OSError as problem:
        raise error(f"{for_host} {host} is not an address of this machine: {problem.strerror}") from None
    listener = socket.socket(family, socket.SOCK_STREAM)
    if os.name == "posix":  # on other systems, this option lets two programs use the same port
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, buffer_bytes)
    try:
        listener.bind(address)
        listener.listen()
    except OSError as problem:
        listener.close()
        if problem.errno == errno.EADDRNOTAVAIL:
            raise error(f"{for_host} {host} is not an address of this machine: 0.0.0.0 stands for all it has") from None
        what = "is in use" if problem.errno == errno.EADDRINUSE else f"cannot be used ({problem.strerror})"
        raise error(f"port {port} on {host} {what}: choose another with {for_port} N (0: a free one)") from None
    return listener


def host_for_others(host: str) -> str:
    """Return ``host`` as others write it in an address: one of this machine's addresses for 0.0.0.0."""
    if host in {"0.0.0.0", "::", ""}:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.connect(("203.0.113.1", 9))  # sends nothing; only determines the route
                host = str(probe.getsockname()[0])
            except OSError:  # no network
                host = socket.gethostname()
    return f"[{host}]" if ":" in host else host
