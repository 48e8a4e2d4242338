"""The other nodes of the graph, from their liveliness tokens, and warnings about mismatched types."""

import logging
import threading

import zenoh

from handsteer.transports.zenoh.keys import Endpoint, Entity, all_tokens, read_token

log = logging.getLogger(__name__)

_OPPOSITE = {"publisher": "subscriber", "subscriber": "publisher"}


class Neighbours:
    """Compares our publishers and subscribers with those of others, because Zenoh does not report mismatched types."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        self._own = str(session.zid())
        self._lock = threading.Lock()
        self._ours: dict[tuple[str, str], tuple[Endpoint, str | None]] = {}
        self._theirs: dict[str, Entity] = {}
        self._watch = session.liveliness().declare_subscriber(all_tokens(domain), self._note, history=True)

    def add(self, endpoint: Endpoint, or_type: str | None = None) -> None:
        """Compare our publisher or subscriber, which may change to ``or_type``, with others, now and later."""
        with self._lock:
            self._ours[endpoint.topic, endpoint.kind] = endpoint, or_type
            theirs = list(self._theirs.values())
        for entity in theirs:
            self._compare(entity)

    def publishers_of(self, topic: str) -> list[str]:
        """Return the node of each publisher of the topic of this full name in other processes."""
        return [node for node, _ in self._others("publisher", topic)]

    def subscribed_types(self, topic: str) -> set[str]:
        """Return the types of the subscribers of the topic of this full name in other processes."""
        return {end.type for _, end in self._others("subscriber", topic)}

    def close(self) -> None:
        """Stop comparing."""
        self._watch.undeclare()

    def _others(self, kind: str, topic: str) -> list[tuple[str, Endpoint]]:
        with self._lock:
            theirs = [(entity.node, entity.endpoint) for entity in self._theirs.values()]
        return [(node, end) for node, end in theirs if end and (end.kind, end.topic) == (kind, topic)]

    def _note(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        entity = read_token(token)
        if entity is None or entity.zid == self._own:
            return
        came = sample.kind == zenoh.SampleKind.PUT
        with self._lock:
            known = token in self._theirs
            if came:
                self._theirs[token] = entity
            else:
                self._theirs.pop(token, None)
        if came and not known:
            self._compare(entity)

    def _compare(self, entity: Entity) -> None:
        theirs = entity.endpoint
        if theirs is None:
            return
        with self._lock:
            ours, or_type = self._ours.get((theirs.topic, _OPPOSITE.get(theirs.kind, "")), (None, None))
        if ours is None or theirs.type == or_type:
            return
        if (ours.type, ours.type_hash) != (theirs.type, theirs.type_hash):
            log.warning("%s", explain(ours, theirs, entity.node))


def explain(ours: Endpoint, theirs: Endpoint, node: str) -> str:
    """Return one line on why two endpoints of a topic exchange no messages."""
    if ours.type != theirs.type:
        why = f"ours has the type {ours.type}, theirs {theirs.type}"
    else:
        hashes = f"ours: {ours.type_hash}; theirs: {theirs.type_hash}"
        why = f"both have the type {ours.type}, but it is defined differently ({hashes})"
    return f"{ours.topic}: nothing passes between our {ours.kind} and the {theirs.kind} of {node}: {why}"
