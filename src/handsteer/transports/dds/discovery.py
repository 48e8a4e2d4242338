"""Discovery of ROS 2 nodes by the topic ``ros_discovery_info``, because DDS itself has no concept of nodes."""

import threading
import uuid
from typing import Any

import numpy as np
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from handsteer.transports.dds.topics import dds_type, discovery_qos
from handsteer.transports.ros2.encoding import types
from handsteer.transports.ros2.names import NodeName

_INFO = "rmw_dds_common/msg/ParticipantEntitiesInfo"
DISCOVERY_TOPIC = "ros_discovery_info"
"""Name of the topic in DDS, where ROS 2's own topics begin with ``rt/``."""
_AT_ONCE = 256
# All identifiers of a participant begin with the same bytes.
_PREFIX_BYTES = 12


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
        topic = Topic(participant, DISCOVERY_TOPIC, self._type)
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
