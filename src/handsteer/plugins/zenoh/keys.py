"""The wire format of rmw_zenoh: key expressions, liveliness tokens, identifiers and attachments.

Source of the formats: ros2/rmw_zenoh, docs/design.md, and ``liveliness_utils.cpp`` and ``attachment_helpers.cpp`` of
rmw_zenoh_cpp 0.2.4 (Jazzy) and newer; older ones had another attachment.
"""

import struct
from dataclasses import dataclass

import xxhash

from handsteer.plugins.ros2.base_transport import Profile
from handsteer.plugins.ros2.names import NodeName, dds_type_name, ros_type_name
from handsteer.transports.encoding import type_hash

_ROOT = "@ros2_lv"
_NODE = "NN"
_KINDS = {"MP": "publisher", "MS": "subscriber", "SS": "service", "SC": "client"}
_LETTERS = {words: letters for letters, words in _KINDS.items()}
# Default values of a profile are omitted from its text; rmw_zenoh's default depth is 42.
_DEFAULT_DEPTH = 42
_ATTACHMENT = struct.Struct("<qqB16s")
_GID_BYTES = 16
_ENDPOINT_PARTS = 13


@dataclass(frozen=True)
class Endpoint:
    """A publisher, subscriber, service or client of a node.

    Attributes:
        kind: ``publisher``, ``subscriber``, ``service`` or ``client``.
        topic: Full name of the topic or service, such as ``/r1/image_raw``.
        type: Name of its type, such as ``sensor_msgs/msg/Image``.
        type_hash: Hash of its type, such as ``RIHS01_df66…``.
    """

    kind: str
    topic: str
    type: str
    type_hash: str


@dataclass(frozen=True)
class Place:
    """This process's node in the graph: the ROS 2 domain, the identifier of the Zenoh session, and the node's name."""

    domain: int
    zid: str
    node: NodeName


@dataclass(frozen=True)
class Entity:
    """An endpoint, the full name of its node, and the identifier of its Zenoh session."""

    zid: str
    node: str
    endpoint: Endpoint


def topic_key(domain: int, name: str, type_name: str) -> str:
    """Return the key expression of the messages or requests of a topic or service, by its full name and its type."""
    return f"{domain}{name}/{dds_type_name(type_name)}/{type_hash(type_name)}"


def all_tokens(domain: int) -> str:
    """Return the key expression that matches all liveliness tokens of a domain."""
    return f"{_ROOT}/{domain}/**"


def node_token(place: Place) -> str:
    """Return the liveliness token of a node."""
    return f"{_ROOT}/{place.domain}/{place.zid}/0/0/{_NODE}/{_name(place.node)}"


def endpoint_token(place: Place, number: int, endpoint: Endpoint, profile: Profile) -> str:
    """Return the liveliness token of an endpoint of a node; ``number``, from 1, identifies it within its session."""
    who = f"{_ROOT}/{place.domain}/{place.zid}/0/{number}/{_LETTERS[endpoint.kind]}/{_name(place.node)}"
    what = (_mangled(endpoint.topic), dds_type_name(endpoint.type), endpoint.type_hash, _quality(profile))
    return f"{who}/{'/'.join(what)}"


def read_token(token: str) -> Entity | None:
    """Return the endpoint that a liveliness token announces; None if it announces something else."""
    parts = token.split("/")
    if len(parts) < _ENDPOINT_PARTS or parts[0] != _ROOT or parts[5] not in _KINDS:
        return None
    node = f"{_demangled(parts[7]).rstrip('/')}/{parts[8]}"
    topic, dds_type, digest = parts[9:12]
    return Entity(parts[2], node, Endpoint(_KINDS[parts[5]], _demangled(topic), ros_type_name(dds_type), digest))


def gid(token: str) -> bytes:
    """Return an endpoint's identifier in ROS 2, 16 bytes: the XXH3 hash of its liveliness token."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(_GID_BYTES, "little")


def attachment(number: int, time_ns: int, source: bytes) -> bytes:
    """Return the attachment of a message, request or reply.

    It has a sequence number, from 1, the time of sending in nanoseconds of Unix time, and the sender's identifier.
    """
    return _ATTACHMENT.pack(number, time_ns, _GID_BYTES, source)


def read_attachment(raw: bytes) -> tuple[int, int, bytes]:
    """Return sequence number, time in nanoseconds and sender of an attachment.

    Raises:
        ValueError: It is not an attachment.
    """
    try:
        number, time_ns, length, source = _ATTACHMENT.unpack(raw)
    except struct.error:
        raise ValueError(f"an attachment has {_ATTACHMENT.size} bytes, not {len(raw)}") from None
    if length != _GID_BYTES:
        raise ValueError(f"the sender of a message has {_GID_BYTES} bytes, not {length}")
    return number, time_ns, source


def _name(node: NodeName) -> str:
    enclave = "/"
    return f"{_mangled(enclave)}/{_mangled(node.namespace)}/{node.name}"


def _quality(profile: Profile) -> str:
    reliability, durability = "" if profile.reliable else "2", "1" if profile.latched else ""
    depth = "" if profile.depth == _DEFAULT_DEPTH else profile.depth
    return f"{reliability}:{durability}:,{depth}:,:,:,,"


def _mangled(name: str) -> str:
    return name.replace("/", "%")


def _demangled(name: str) -> str:
    return name.replace("%", "/")
