"""The socket and the thread of a participant of RTPS."""

import contextlib
import logging
import secrets
import selectors
import socket
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from handsteer.transports.dds.interfaces import multicast_addresses
from handsteer.transports.dds.rtps.discovery import Address
from handsteer.transports.dds.rtps.participant import Outgoing, RtpsParticipant
from handsteer.transports.dds.rtps.wire import PREFIX_BYTES, VENDOR_UNKNOWN

log = logging.getLogger(__name__)

_LOOPBACK = "127.0.0.1"
_GROUP = "239.255.0.1"
# RTPS 2.5, section 9.6.1.1: the ports of a domain, and of a participant in it.
_BASE, _PER_DOMAIN, _PER_PARTICIPANT, _OWN = 7400, 250, 2, 10
_LARGEST = 65536
# The ports of this place and those above belong to the next domain.
_LAST_PLACE = 120
_AT_ONCE = 64
_SENT_TO = 4
_LEAVE_TIMEOUT_S = 1.0
_AFTER_FAILURE_S = 0.1


@dataclass(frozen=True)
class Surroundings:
    """Where clients may be.

    Attributes:
        domain: Number of the domain.
        is_local: Whether only this machine is looked at.
        uses_multicast: Whether the subnet is looked at by multicast.
        peers: Further machines that are looked at, by name or IPv4 address.
        places: How many participants of the domain are looked for on each machine.
    """

    domain: int
    is_local: bool
    uses_multicast: bool
    peers: tuple[str, ...]
    places: int


class Responder:
    """Answers clients on Fast DDS, on a thread of its own.

    Args:
        surroundings: Where clients may be.

    Raises:
        OSError: There is no socket to be had.
    """

    def __init__(self, surroundings: Surroundings) -> None:
        self._socket = _bound(surroundings)
        self._socket.setblocking(False)
        self._wake, self._woken = socket.socketpair()
        self._woken.setblocking(False)
        port = self._socket.getsockname()[1]
        self._hosts = _hosts(surroundings)
        self._participant = RtpsParticipant(
            VENDOR_UNKNOWN + secrets.token_bytes(PREFIX_BYTES - len(VENDOR_UNKNOWN)),
            surroundings.domain,
            tuple((host, port) for host in self._hosts),
            _places(surroundings),
            _only_here if surroundings.is_local else _anywhere,
        )
        self._lock = threading.Lock()
        self._is_closing = False
        self._thread = threading.Thread(target=self._run, name="rtps", daemon=True)
        self._thread.start()

    def add(
        self, name: str, types: tuple[str, str], user_data: tuple[bytes, bytes], answer: Callable[[bytes], bytes]
    ) -> tuple[bytes, bytes]:
        """Add a service, as :meth:`RtpsParticipant.add` tells."""
        with self._lock:
            guids = self._participant.add(name, types, user_data, answer)
        self._hurry()
        return guids

    def seek(self, prefixes: Iterable[bytes]) -> None:
        """Look for the participants of these prefixes, which are there, until they answer."""
        with self._lock:
            self._participant.seek(prefixes)
        self._hurry()

    def close(self) -> None:
        """Tell all others that it is gone, and end; may be called twice."""
        if self._is_closing:
            return
        self._is_closing = True
        self._hurry()
        self._thread.join(_LEAVE_TIMEOUT_S)

    def _hurry(self) -> None:
        with contextlib.suppress(OSError):
            self._wake.send(b"\0")

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector, self._socket, self._wake, self._woken:
            selector.register(self._socket, selectors.EVENT_READ)
            selector.register(self._woken, selectors.EVENT_READ)
            while not self._is_closing:
                try:
                    self._turn(selector)
                except Exception:
                    log.exception("RTPS: a message could not be served")
                    time.sleep(_AFTER_FAILURE_S)  # what fails again and again must not take the whole machine
            with self._lock:
                self._send(self._participant.leave())

    def _turn(self, selector: selectors.BaseSelector) -> None:
        with self._lock:
            pause_s = self._participant.pause_s(time.monotonic())
        selector.select(pause_s)
        with contextlib.suppress(BlockingIOError):
            self._woken.recv(_LARGEST)
        for _ in range(_AT_ONCE):
            try:
                datagram = self._socket.recv(_LARGEST)
            except BlockingIOError:
                break
            except OSError:
                continue  # on some systems, that somebody whom we have told something is gone
            with self._lock:
                self._send(self._participant.receive(datagram, time.monotonic()))
        with self._lock:
            self._send(self._participant.tick(time.monotonic()))

    def _send(self, outgoing: Outgoing) -> None:
        for datagram, address in outgoing:
            for host in self._hosts if address[0] == _GROUP else (None,):
                with contextlib.suppress(OSError):  # what is lost is repeated
                    if host is not None:
                        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(host))
                    self._socket.sendto(datagram, address)


def _bound(surroundings: Surroundings) -> socket.socket:
    """Return a socket at a port of the domain that no other participant wants, which firewalls know; else at any."""
    first = _BASE + _PER_DOMAIN * surroundings.domain + _OWN + 1
    wanted = (first + _PER_PARTICIPANT * place for place in reversed(range(surroundings.places, _LAST_PLACE)))
    for port in (*(port for port in wanted if port < _LARGEST), 0):
        found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            found.bind((_LOOPBACK if surroundings.is_local else "", port))
        except OSError:
            found.close()
            if port == 0:
                raise
        else:
            return found
    raise AssertionError("the last port is 0")


def _hosts(surroundings: Surroundings) -> tuple[str, ...]:
    """Return the addresses of this machine at which others reach it."""
    if surroundings.is_local:
        return (_LOOPBACK,)
    asked = ([_GROUP] if surroundings.uses_multicast else []) + list(surroundings.peers)
    found = [*(multicast_addresses().values() if surroundings.uses_multicast else ()), *map(_own_address, asked)]
    beyond = tuple(dict.fromkeys(host for host in found if host not in {None, _LOOPBACK}))
    return tuple(host for host in beyond if host is not None) or (_LOOPBACK,)


def _own_address(peer: str) -> str | None:
    """Return the address that packets to ``peer`` come from; None when there is no way to it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, contextlib.suppress(OSError):
        probe.connect((peer, _BASE))  # sends nothing
        return str(probe.getsockname()[0])
    return None


def _places(surroundings: Surroundings) -> list[Address]:
    first = _BASE + _PER_DOMAIN * surroundings.domain
    hosts = [_LOOPBACK]
    for peer in surroundings.peers:
        with contextlib.suppress(OSError):
            hosts.append(socket.gethostbyname(peer))
    found = [
        (host, first + _OWN + _PER_PARTICIPANT * place)
        for host in dict.fromkeys(hosts)
        for place in range(surroundings.places)
    ]
    return [(_GROUP, first), *found] if surroundings.uses_multicast else found


def _only_here(addresses: tuple[Address, ...]) -> tuple[Address, ...]:
    """Return where to send on this machine; others may name any of its addresses."""
    return tuple(dict.fromkeys((_LOOPBACK, port) for _, port in addresses))


def _anywhere(addresses: tuple[Address, ...]) -> tuple[Address, ...]:
    beyond = tuple(address for address in addresses if not address[0].startswith("127."))
    return (beyond or addresses)[:_SENT_TO]
