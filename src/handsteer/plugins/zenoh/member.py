"""This process as a Zenoh session and a node of ROS 2, its router, and the other nodes that it knows."""

import itertools
import logging
import threading
import time
from collections import Counter
from typing import Any

import zenoh

from handsteer.errors import TransportError
from handsteer.plugins.ros2.base_transport import Other, Profile, unconnected
from handsteer.plugins.ros2.names import NodeName
from handsteer.plugins.zenoh.configuration import Network, reason, routers
from handsteer.plugins.zenoh.keys import (
    Endpoint,
    Entity,
    Place,
    all_tokens,
    endpoint_token,
    node_token,
    read_token,
    topic_key,
)
from handsteer.transports.encoding import type_hash

_LOOK_AGAIN_S = 1.0
_CHANGES_KEPT = 10_000
END_S = 0.5
"""How long to wait for a thread that reads from Zenoh, in seconds."""
_MOST_NAMED = 5
_OPPOSITE = {"publisher": "subscriber", "subscriber": "publisher"}

log = logging.getLogger(__name__)


class Member:
    """A session of a Zenoh network, known to ROS 2 as one node.

    Attributes:
        is_local: Whether this process connects to this machine only, as far as is known.
        neighbours: The other nodes.

    Raises:
        TransportError: The network cannot be joined.
    """

    def __init__(self, network: Network, name: NodeName) -> None:
        self.is_local = network.is_local
        self._network = network
        zenoh.try_init_log_from_env()
        try:
            self.session = zenoh.open(network.config)
        except zenoh.ZError as error:
            raise TransportError(
                f"cannot join Zenoh as {name.full}: looked for a router at {routers(network.config)}; "
                f"start handsteer zenoh-router, or look at ZENOH_SESSION_CONFIG_URI and ZENOH_CONFIG_OVERRIDE "
                f"({reason(error)})"
            ) from None
        self._had_router = True
        self._place = Place(network.domain, str(self.session.zid()), name)
        self._numbers = itertools.count(1)
        try:
            self._look_for_router()
            self.neighbours = Neighbours(self.session, network.domain)
            self._token = self.session.liveliness().declare_token(node_token(self._place))
        except BaseException:  # including interrupts: an open session would keep the process from ending
            self.session.close()
            raise

    def key(self, name: str, type_name: str) -> str:
        """Return the key expression of the topic or service of this full name and type."""
        return topic_key(self._place.domain, name, type_name)

    def introduce(
        self, kind: str, name: str, type_name: str, profile: Profile, or_type: str | None = None
    ) -> tuple[zenoh.LivelinessToken, str]:
        """Announce an endpoint of this node; return the liveliness token, which must be kept, and its text.

        Args:
            kind: ``publisher``, ``subscriber`` or ``service``.
            name: Full name of its topic or service.
            type_name: Type of the topic or service.
            profile: Its quality of service.
            or_type: Another type that it changes to if there is a subscriber of it.
        """
        endpoint = Endpoint(kind, name, type_name, type_hash(type_name))
        text = endpoint_token(self._place, next(self._numbers), endpoint, profile)
        token = self.session.liveliness().declare_token(text)
        self.neighbours.add(endpoint, or_type)
        return token, text

    def watch_router(self) -> None:
        """Log when the router is lost or found again; does nothing if none is used."""
        if self._network.attempts is None:
            return
        has_router = self._has_router()
        if has_router != self._had_router:
            if has_router:
                log.info("the Zenoh router is there")
            else:
                log.warning("%s", self._without_router("the Zenoh router has gone: those who come now are not found"))
        self._had_router = has_router

    def close(self) -> None:
        """Leave the network; may be called twice."""
        if not self.session.is_closed():
            self.neighbours.close()
            self.session.close()

    def _look_for_router(self) -> None:
        attempts = self._network.attempts
        if attempts is None:
            return
        self._had_router = self._has_router()
        if self._had_router:
            return
        waits = "it waits for one" if attempts == 0 else "until there is one, no other node is found"
        log.warning("%s", self._without_router(f"no Zenoh router answers: {waits}"))
        for tried in itertools.count(1):
            if tried == attempts:
                return
            time.sleep(_LOOK_AGAIN_S)
            if self._has_router():
                self.watch_router()
                return

    def _without_router(self, what: str) -> str:
        return (
            f"{what} (looked at {routers(self._network.config)}); start one with handsteer zenoh-router, "
            "or where ROS 2 is installed, ros2 run rmw_zenoh_cpp rmw_zenohd"
        )

    def _has_router(self) -> bool:
        return bool(self.session.info.routers_zid())


class Neighbours:
    """Compares our publishers and subscribers with those of others, because Zenoh does not report mismatched types."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        self._own = str(session.zid())
        self._lock = threading.Lock()
        self._ours: dict[tuple[str, str], tuple[Endpoint, str | None]] = {}
        self._theirs: dict[str, Entity] = {}
        self._misfits = Counter[str]()
        # Zenoh waits for who does not read its other kinds of queue, also while it holds Python's lock.
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(_CHANGES_KEPT)
        self._watch: Any = session.liveliness().declare_subscriber(all_tokens(domain), ring, history=True)
        self._thread = threading.Thread(target=self._run, name="zenoh neighbours", daemon=True)
        self._thread.start()

    def add(self, endpoint: Endpoint, or_type: str | None = None) -> None:
        """Compare our publisher or subscriber, which may change to ``or_type``, with others, now and later."""
        with self._lock:
            self._ours[endpoint.topic, endpoint.kind] = endpoint, or_type
            theirs = list(self._theirs.values())
        for entity in theirs:
            self._compare(entity)

    def of(self, topic: str) -> list[Other]:
        """Return the publishers and subscribers of the topic of this full name in other processes."""
        with self._lock:
            theirs = [(entity.node, entity.endpoint) for entity in self._theirs.values()]
        return [
            Other(node, end.type, end.kind == "publisher")
            for node, end in theirs
            if end.topic == topic and end.kind in _OPPOSITE
        ]

    def close(self) -> None:
        """Stop comparing."""
        self._watch.undeclare()
        # A thread that is inside Zenoh when Python ends aborts the process.
        self._thread.join(END_S)

    def _run(self) -> None:
        ring = self._watch.handler
        while True:
            try:
                sample = ring.recv()
            except zenoh.ZError:  # it has been closed
                return
            self._note(sample)

    def _note(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        entity = read_token(token)
        if entity is None or entity.zid == self._own:
            return
        with self._lock:
            is_known = self._theirs.pop(token, None) is not None
            is_there = sample.kind == zenoh.SampleKind.PUT
            if is_there:
                self._theirs[token] = entity
        if is_there and not is_known:
            self._compare(entity)

    def _compare(self, entity: Entity) -> None:
        theirs = entity.endpoint
        with self._lock:
            ours, or_type = self._ours.get((theirs.topic, _OPPOSITE.get(theirs.kind, "")), (None, None))
        if ours is None or theirs.type == or_type:
            return
        if (ours.type, ours.type_hash) != (theirs.type, theirs.type_hash):
            self._misfits[ours.topic] += 1
            if self._misfits[ours.topic] <= _MOST_NAMED:
                log.warning("%s", explain(ours, theirs, entity.node))
            elif self._misfits[ours.topic] == _MOST_NAMED + 1:
                log.warning("%s: there are more of these, which are not named", ours.topic)


def explain(ours: Endpoint, theirs: Endpoint, node: str) -> str:
    """Return one line on why two endpoints of a topic exchange no messages."""
    if ours.type != theirs.type:
        why = f"ours has the type {ours.type}, theirs {theirs.type}"
    else:
        hashes = f"ours: {ours.type_hash}; theirs: {theirs.type_hash}"
        why = f"both have the type {ours.type}, but it is defined differently ({hashes})"
    return unconnected(ours.topic, ours.kind, theirs.kind, node, why)
