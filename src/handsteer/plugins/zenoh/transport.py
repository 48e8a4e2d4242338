"""Messages and services over Zenoh, as one node of a ROS 2 graph.

As in rmw_zenoh, a service is a queryable that receives CDR and an attachment, and replies with both. The attachment of
a reply has the number and the sender of its request, by which the client identifies it.
"""

import logging
import math
import os
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

from handsteer.clock import Clock
from handsteer.messages import Topic, type_name
from handsteer.plugins.ros2.base_transport import IMAGES, Other, Profile, Take, WireTransport, offered
from handsteer.plugins.ros2.names import NodeName
from handsteer.plugins.zenoh.configuration import network
from handsteer.plugins.zenoh.keys import attachment, gid, read_attachment
from handsteer.plugins.zenoh.member import END_S, Member

# Zenoh sends on its own threads and does not report when they are done.
_DELIVER_S = 0.1
_HEARTBEAT_S = 0.5
_LEAVE_S = 2.0
_SERVICE = Profile(reliable=True, latched=False, depth=1000)
"""The profile of ROS 2's parameter services."""

log = logging.getLogger(__name__)


class ZenohTransport(WireTransport):
    """A :class:`~handsteer.transports.base.Transport` over Zenoh, which delivers on one thread per topic."""

    errors = (zenoh.ZError,)
    connects_by_qos = False

    def __init__(self, name: NodeName, clock: Clock) -> None:
        super().__init__(name, clock)
        self._member = Member(network(os.environ), name)
        self._is_closed = False
        # Whether a router forwards to other machines is unknown.
        self.crosses_network = not self._member.is_local

    def check(self) -> None:
        """Hear the Stops that others have kept, and log when the router is lost or found again; called regularly."""
        super().check()
        self._member.watch_router()

    def close(self) -> None:
        """Leave the network, in a few seconds at most; may be called twice."""
        if self._is_closed:
            return
        self._is_closed = True
        # Zenoh may wait without end for what a network has left unanswered, such as a router that ends as well.
        leaving = threading.Thread(target=self._leave, name="zenoh leave", daemon=True)
        leaving.start()
        leaving.join(_LEAVE_S)
        if leaving.is_alive():
            log.warning("the Zenoh network does not let this node leave: it ends without")

    def _leave(self) -> None:
        super().close()
        self._member.close()

    def _open_writer(self, name: str, topic: Topic[Any]) -> "_Writer":
        return _Writer(self._member, name, topic)

    def _open_reader(self, name: str, topic: Topic[Any], profile: Profile, take: Take) -> Callable[[], None]:
        return _Reader(self._member, name, topic, profile, take).close

    def _open_service(self, name: str, kind: str, respond: Callable[[bytes], bytes]) -> Callable[[], None]:
        key = self._member.key(name, kind)

        def serve(query: zenoh.Query) -> None:
            with query:
                raw = b"" if query.payload is None else query.payload.to_bytes()
                try:
                    number, _, client = read_attachment(
                        b"" if query.attachment is None else query.attachment.to_bytes()
                    )
                    query.reply(key, respond(raw), attachment=attachment(number, time.time_ns(), client))
                except Exception as error:
                    # Invalid requests must not end the service.
                    log.warning("%s: a request of %d bytes cannot be answered: %s", name, len(raw), error)

        queryable = self._member.session.declare_queryable(key, serve, complete=True)
        token, _ = self._member.introduce("service", name, kind, _SERVICE)

        def close() -> None:
            token.undeclare()
            queryable.undeclare()

        return close

    def _others(self, name: str) -> list[Other]:
        return self._member.neighbours.of(name)

    def _has_keepers(self, topic: Topic[Any]) -> bool:
        return True  # programs of zenoh do not all announce their publishers, and none warns of subscribers


class _Writer:
    def __init__(self, member: Member, name: str, topic: Topic[Any]) -> None:
        profile, kind = offered(topic), type_name(topic.type)
        key = member.key(name, kind)
        options = _options(topic, profile)
        self._publisher = member.session.declare_publisher(key, **options)
        # It keeps messages for late subscribers but does not report subscribers, which the plain publisher does.
        self._keeper = _keeper(member.session, key, profile, options) if profile.latched else None
        or_type = type_name(topic.or_type) if topic.or_type else None
        self._token, text = member.introduce("publisher", name, kind, profile, or_type)
        self._gid = gid(text)
        self._number = 0
        self._written_s = -math.inf

    @property
    def has_readers(self) -> bool:
        status: Any = self._publisher.matching_status  # not a bool, despite its type hint
        return bool(status.matching)

    def write(self, raw: bytes) -> None:
        self._number += 1
        self._written_s = time.monotonic()
        put = self._publisher.put if self._keeper is None else self._keeper.put
        put(raw, attachment=attachment(self._number, time.time_ns(), self._gid))

    def flush(self, timeout_s: float) -> bool:
        time.sleep(max(0.0, min(timeout_s, self._written_s + _DELIVER_S - time.monotonic())))
        return True

    def close(self) -> None:
        self._token.undeclare()
        self._publisher.undeclare()
        if self._keeper is not None:
            self._keeper.undeclare()


def _options(topic: Topic[Any], profile: Profile) -> dict[str, Any]:
    """Return the publisher's options.

    As in rmw_zenoh, no publisher waits for a stalled subscriber: messages are dropped. Signs and commands have priority
    over images on the same link, and are not delayed for batching.
    """
    is_urgent = profile.reliable and topic.type not in IMAGES
    return {
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if profile.reliable else zenoh.Reliability.BEST_EFFORT,
        "priority": zenoh.Priority.INTERACTIVE_HIGH if is_urgent else zenoh.Priority.DATA,
        "express": is_urgent,
    }


def _keeper(session: zenoh.Session, key: str, profile: Profile, options: dict[str, Any]) -> zenoh.ext.AdvancedPublisher:
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(profile.depth),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S),
        publisher_detection=True,
        **options,
    )


class _Reader:
    """A subscriber, whose messages are taken by its own thread.

    Zenoh puts them into a ring that keeps the newest, so that no queue grows and no other subscriber is delayed.
    """

    def __init__(self, member: Member, name: str, topic: Topic[Any], profile: Profile, take: Take) -> None:
        self._take = take
        self._is_closed = False
        kind = type_name(topic.type)
        self._subscriber = _subscriber(member.session, member.key(name, kind), profile)
        self._token, _ = member.introduce("subscriber", name, kind, profile)
        self._thread = threading.Thread(target=self._run, name=f"zenoh {topic.name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._is_closed = True
        self._token.undeclare()
        self._subscriber.undeclare()
        if self._thread is not threading.current_thread():
            self._thread.join(END_S)

    def _run(self) -> None:
        ring = self._subscriber.handler
        while not self._is_closed:
            try:
                sample = ring.recv()
            except zenoh.ZError:  # it has been closed
                return
            if sample.kind == zenoh.SampleKind.PUT and not self._is_closed:
                self._take(sample.payload.to_bytes(), *_sending(sample.attachment))


def _sending(attached: zenoh.ZBytes | None) -> tuple[bytes, float | None]:
    """Return sender and time of a message; empty and None if it is not from ROS 2, or from an older one."""
    try:
        _, time_ns, sender = read_attachment(b"" if attached is None else attached.to_bytes())
    except ValueError:
        return b"", None
    return sender, time_ns / 1e9


def _subscriber(session: zenoh.Session, key: str, profile: Profile) -> Any:
    ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(profile.depth)
    if not profile.latched:
        return session.declare_subscriber(key, ring)
    return zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        ring,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=profile.depth),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        subscriber_detection=True,
    )
