"""The nodes of other processes, their publishers and subscribers, and why these are not connected to ours.

DDS has no concept of nodes, which ROS 2 announces on the topic ``ros_discovery_info``; and it does not report endpoints
that do not match. Raw images to a subscriber that will lose many of them are reported too, if they are sent as JPEG.
"""

import logging
import threading
import time
import uuid
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from handsteer.messages import Image, type_name
from handsteer.plugins.dds.topics import dds_type, describe, discovery_qos, host, misfits
from handsteer.plugins.ros2.base_transport import unconnected
from handsteer.plugins.ros2.names import NodeName, dds_type_name, ros_type_name
from handsteer.transports.base import UNNAMED
from handsteer.transports.encoding import types

_INFO = "rmw_dds_common/msg/ParticipantEntitiesInfo"
_DISCOVERY = "ros_discovery_info"
_AT_ONCE = 256
# Nodes announce their names after their publishers and subscribers: Cyclone DDS at once, Fast DDS within three seconds.
_NAME_DUE_S = 4.0
_IMAGE = dds_type_name(type_name(Image))
_COMPRESSED = "/compressed"
# Identifiers begin with the number of the vendor, and with twelve bytes common to a participant (RTPS 2.5, 9.3).
_FAST_DDS = b"\x01\x0f"
_PREFIX_BYTES = 12
_PARTICIPANTS = 1000

log = logging.getLogger(__name__)


class RosGraph:
    """Announces which publishers and subscribers belong to our node, and learns those of other nodes.

    Args:
        participant: The participant of this process.
        name: Name of this process's node; None to observe without announcing anything.
        distribution: The ROS 2 distribution of the other nodes: identifiers have 24 bytes in ``humble``, 16 since.
    """

    def __init__(self, participant: DomainParticipant, name: NodeName | None, distribution: str) -> None:
        self._guid = participant.guid
        self._name = name
        self._store = types(distribution)
        self._lock = threading.Lock()
        self._writers: list[uuid.UUID] = []
        self._readers: list[uuid.UUID] = []
        # The nodes of each other participant, with the identifiers of their publishers and subscribers.
        self._nodes: dict[bytes, list[tuple[str, set[bytes]]]] = {}
        self._type = dds_type(_INFO, distribution)
        topic = Topic(participant, _DISCOVERY, self._type)
        self.reader: Any = DataReader(participant, topic, qos=discovery_qos(_INFO, _AT_ONCE))
        self._writer: Any = DataWriter(participant, topic, qos=discovery_qos(_INFO, 1)) if name else None
        self._announce()

    def add(self, endpoint: DataWriter[Any] | DataReader[Any]) -> None:
        """Announce that ``endpoint`` belongs to our node."""
        with self._lock:
            self._list_of(endpoint).append(endpoint.guid)
            self._announce()

    def remove(self, endpoint: DataWriter[Any] | DataReader[Any]) -> None:
        """Announce that ``endpoint`` is gone."""
        with self._lock:
            self._list_of(endpoint).remove(endpoint.guid)
            self._announce()

    def node_of(self, endpoint: uuid.UUID) -> str | None:
        """Return the full name of the node of a publisher or subscriber; None if it was not announced yet."""
        with self._lock:
            known = [node for nodes in self._nodes.values() for node in nodes]
        return next((name for name, ends in known if endpoint.bytes in ends), None)

    def nodes(self) -> list[str]:
        """Return the full names of other nodes; two nodes of one name are listed twice."""
        with self._lock:
            return [name for nodes in self._nodes.values() for name, _ in nodes]

    def serve(self) -> None:
        """Read announcements of other nodes."""
        for sample in self.reader.take(_AT_ONCE):
            if isinstance(sample, InvalidSample):
                continue
            info: Any = self._store.deserialize_cdr(sample.raw, _INFO)
            nodes = [
                (_full_name(node), {_bytes(gid) for gid in (*node.reader_gid_seq, *node.writer_gid_seq)})
                for node in info.node_entities_info_seq
            ]
            with self._lock:
                self._nodes[_bytes(info.gid)] = nodes

    def forget(self, endpoint: uuid.UUID) -> None:
        """Forget the nodes of the participant that had ``endpoint``."""
        with self._lock:
            for gid in [gid for gid in self._nodes if gid[:_PREFIX_BYTES] == endpoint.bytes[:_PREFIX_BYTES]]:
                del self._nodes[gid]

    def close(self) -> None:
        """Leave the topic; may be called twice."""
        self._writer = self.reader = None

    def _list_of(self, endpoint: DataWriter[Any] | DataReader[Any]) -> list[uuid.UUID]:
        return self._writers if isinstance(endpoint, DataWriter) else self._readers

    def _announce(self) -> None:
        if self._name is None or self._writer is None:
            return
        kinds = self._store.types
        node = kinds["rmw_dds_common/msg/NodeEntitiesInfo"](
            node_namespace=self._name.namespace,
            node_name=self._name.name,
            reader_gid_seq=[self._gid(guid) for guid in self._readers],
            writer_gid_seq=[self._gid(guid) for guid in self._writers],
        )
        info = kinds[_INFO](gid=self._gid(self._guid), node_entities_info_seq=[node])
        self._writer.write(self._type(bytes(self._store.serialize_cdr(info, _INFO))))

    def _gid(self, guid: uuid.UUID) -> Any:
        kind = "rmw_dds_common/msg/Gid"
        fields: Any = self._store.fielddefs[kind][1]
        _, length = fields[0][1][1]
        return self._store.types[kind](data=np.frombuffer(guid.bytes.ljust(length, b"\0"), np.uint8))


def _full_name(node: Any) -> str:
    return f"{node.node_namespace.rstrip('/')}/{node.node_name}"


def _bytes(gid: Any) -> bytes:
    return bytes(gid.data[:16])


@dataclass(frozen=True)
class Endpoint:
    """A publisher or subscriber.

    Attributes:
        topic: Its name in DDS, such as ``rt/image_raw``; ``type`` is the type's name there.
        qos: The QoS offered or requested.
        publishes: Whether it is a publisher.
        or_type: Another type that it changes to if there is a subscriber of it.
    """

    topic: str
    type: str
    qos: Qos
    publishes: bool
    or_type: str | None = None

    @property
    def kind(self) -> str:
        """``publisher`` or ``subscriber``, for messages."""
        return "publisher" if self.publishes else "subscriber"


class Matching:
    """Compares our publishers and subscribers with those of others.

    Args:
        participant: The participant of this process; its own endpoints are assumed to match.
        graph: Provides the names of nodes, as far as they were announced.

    Attributes:
        readers: Readers of the announcements of publishers and subscribers, and what processes them.
    """

    def __init__(self, participant: DomainParticipant, graph: RosGraph) -> None:
        self._own = participant.guid
        self._graph = graph
        self._lock = threading.Lock()
        self._ours: dict[tuple[str, bool], Endpoint] = {}
        self._theirs: dict[uuid.UUID, Endpoint] = {}
        self._pending: dict[uuid.UUID, float] = {}
        self._reported: set[uuid.UUID] = set()
        self._advised = False
        self._participants: Any = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
        ends = ((BuiltinTopicDcpsPublication, True), (BuiltinTopicDcpsSubscription, False))
        readers: list[Any] = [(BuiltinDataReader(participant, kind), publishes) for kind, publishes in ends]
        self.readers = [(reader, partial(self._serve, reader, publishes=publishes)) for reader, publishes in readers]

    def add(self, endpoint: Endpoint) -> None:
        """Compare our publisher or subscriber with those of others, now and later."""
        with self._lock:
            self._ours[endpoint.topic, endpoint.publishes] = endpoint
            for key in self._theirs:
                self._compare(key)

    def others(self) -> dict[uuid.UUID, Endpoint]:
        """Return the publishers and subscribers of other processes."""
        with self._lock:
            return dict(self._theirs)

    def tick(self) -> None:
        """Report mismatches, once the other node's name is known, or after a while without it."""
        now = time.monotonic()
        with self._lock:
            due = [key for key, due_s in self._pending.items() if due_s <= now or self._graph.node_of(key)]
            lines = [line for key in due if (line := self._line(key))]
            for key in due:
                del self._pending[key]
        for line in lines:
            log.warning("%s", line)

    def close(self) -> None:
        """Stop comparing; may be called twice."""
        self.readers.clear()
        self._participants = None

    def _serve(self, reader: Any, *, publishes: bool) -> None:
        for seen in reader.take(_AT_ONCE):
            if seen.participant_key == self._own:
                continue
            with self._lock:
                if seen.sample_info.valid_data and seen.qos is not None:
                    self._theirs[seen.key] = Endpoint(seen.topic_name, seen.type_name, seen.qos, publishes)
                    self._compare(seen.key)
                else:
                    self._forget(seen.key)

    def _ours_for(self, key: uuid.UUID) -> Endpoint | None:
        """Return our endpoint on the topic of another's publisher or subscriber."""
        theirs = self._theirs[key]
        return self._ours.get((theirs.topic, not theirs.publishes))

    def _compare(self, key: uuid.UUID) -> None:
        ours = self._ours_for(key)
        if ours is None or key in self._reported:
            return
        if reasons(ours, self._theirs[key]) or (ours.type == _IMAGE and ours.publishes):
            self._reported.add(key)
            self._pending[key] = time.monotonic() + _NAME_DUE_S

    def _line(self, key: uuid.UUID) -> str | None:
        ours = self._ours_for(key)
        assert ours is not None
        node = self._graph.node_of(key)
        if reasons(ours, self._theirs[key]):
            return None if self._is_reached(key) else explain(ours, self._theirs[key], node)
        has_compressed = (f"{ours.topic}{_COMPRESSED}", True) in self._ours
        if self._advised or not has_compressed or not self._loses_images(key):
            return None
        self._advised = True
        name = ours.topic.removeprefix("rt")
        return (
            f"{name}: {node or UNNAMED} takes raw images, many of which are lost on the way to another "
            f"machine or to Fast DDS: let it take {name}{_COMPRESSED}"
        )

    def _is_reached(self, key: uuid.UUID) -> bool:
        """Return whether another endpoint of the same participant exchanges messages with ours on this topic."""
        ours, theirs = self._ours_for(key), self._theirs[key]
        assert ours is not None
        return any(
            other.bytes[:_PREFIX_BYTES] == key.bytes[:_PREFIX_BYTES]
            and (end.topic, end.publishes) == (theirs.topic, theirs.publishes)
            and not reasons(ours, end)
            for other, end in self._theirs.items()
        )

    def _loses_images(self, key: uuid.UUID) -> bool:
        """Return whether raw images may be lost on the way to another's subscriber."""
        if key.bytes.startswith(_FAST_DDS):
            return True
        hosts = {
            seen.key.bytes[:_PREFIX_BYTES]: host(seen.qos)
            for seen in self._participants.read(_PARTICIPANTS)
            if seen.sample_info.valid_data
        }
        theirs, ours = (hosts.get(one.bytes[:_PREFIX_BYTES]) for one in (key, self._own))
        return theirs is not None and theirs != ours

    def _forget(self, key: uuid.UUID) -> None:
        gone = self._theirs.pop(key, None)
        if gone is not None and gone.publishes and gone.topic == _DISCOVERY:
            self._graph.forget(key)
        self._reported.discard(key)
        self._pending.pop(key, None)


def reasons(ours: Endpoint, theirs: Endpoint) -> list[str]:
    """Return why a publisher and a subscriber of one topic are not connected, in words; empty if they are."""
    if theirs.type == ours.or_type:
        return []
    if ours.type != theirs.type:
        return [f"ours has the type {ros_type_name(ours.type)}, theirs {ros_type_name(theirs.type)}"]
    return misfits(ours.qos, theirs.qos) if ours.publishes else misfits(theirs.qos, ours.qos)


def explain(ours: Endpoint, theirs: Endpoint, node: str | None) -> str:
    """Return one line with the two endpoints that are not connected, the reasons, and both profiles."""
    why = f"{'; '.join(reasons(ours, theirs))} (ours: {describe(ours.qos)}; theirs: {describe(theirs.qos)})"
    return unconnected(ours.topic.removeprefix("rt"), ours.kind, theirs.kind, node or UNNAMED, why)
