"""ROS 2's topics and services in DDS: their types and quality of service, and why two endpoints do not match.

DDS needs the definition of a type to match endpoints; the messages themselves are passed in encoded form, which is much
faster than cyclonedds's own encoder for large ones.

A writer never waits for a slow reader. Commands and signs have a lifespan, so that old ones are not delivered after a
loss of connection; the log has one, so that a late subscriber gets recent records only.
"""

import functools
from typing import Any

import cyclonedds.idl.types
from cyclonedds.core import Policy, Qos
from cyclonedds.idl import make_idl_struct
from rosbags.interfaces import Nodetype

from handsteer.messages import Topic, type_name
from handsteer.plugins.ros2.base_transport import NO_DEADLINE, NO_LIVELINESS, Profile, offered, requested
from handsteer.plugins.ros2.names import dds_type_name
from handsteer.transports.encoding import type_hash, types

_RELIABLE = Policy.Reliability.Reliable(0)
_BEST_EFFORT = Policy.Reliability.BestEffort
_VOLATILE, _TRANSIENT_LOCAL = Policy.Durability.Volatile, Policy.Durability.TransientLocal
_DURABILITIES = (_VOLATILE, _TRANSIENT_LOCAL, Policy.Durability.Transient, Policy.Durability.Persistent)
_ORDERS = (Policy.DestinationOrder.ByReceptionTimestamp, Policy.DestinationOrder.BySourceTimestamp)
_LIVELINESS = (
    Policy.Liveliness.Automatic,
    Policy.Liveliness.ManualByParticipant,
    Policy.Liveliness.ManualByTopic,
)
_NEVER_NS = 2**63 - 1
_NS_PER_S = 1_000_000_000
_REQUESTS = 1000


def writer_qos(topic: Topic[Any]) -> Qos:
    """Return the QoS offered by a publisher of ``topic``."""
    policies = list(_qos(topic, offered(topic)))
    if topic.latched:  # late subscribers get all kept messages
        policies.append(Policy.DurabilityService(0, Policy.History.KeepLast(topic.depth), -1, -1, -1))
    if topic.lifespan_s is not None:
        policies.append(Policy.Lifespan(round(topic.lifespan_s * _NS_PER_S)))
    return Qos(*policies)


def reader_qos(topic: Topic[Any], profile: Profile | None = None) -> Qos:
    """Return the QoS requested by a subscriber of ``topic``, by ``profile`` if it is not the usual one."""
    return _qos(topic, profile or requested(topic))


def discovery_qos(name: str, depth: int) -> Qos:
    """Return ROS 2's QoS for ``ros_discovery_info``, whose messages have the type ``name``; ``depth`` are kept."""
    history = Policy.History.KeepLast(depth)
    return Qos(_RELIABLE, _TRANSIENT_LOCAL, history, _CDR, Policy.IgnoreLocal.Participant, _user_data(name))


def service_qos(name: str, service: str) -> Qos:
    """Return ROS 2's QoS for the requests or replies of a parameter service, by their type.

    ``service`` identifies it, and is the same for its reader and its writer.
    """
    data = Policy.Userdata(f"serviceid={service};typehash={type_hash(name)};".encode())
    return Qos(_RELIABLE, _VOLATILE, Policy.History.KeepLast(_REQUESTS), _CDR, data)


def user_data(qos: Qos) -> dict[str, str]:
    """Return ROS 2's entries in the user data: ``typehash``, ``clientid`` and others."""
    data = _find(qos, "Userdata")
    text = data.data.decode("utf-8", "replace") if data is not None else ""
    return {name: value for name, equals, value in (part.partition("=") for part in text.split(";")) if equals}


def host(qos: Qos) -> str | None:
    """Return the host name in the announcement of a participant of Cyclone DDS; None if it has none."""
    found = _find(qos, "Property<__Hostname>")
    return found.value if found is not None else None


def describe(qos: Qos) -> str:
    """Return the profile in words, as ``reliable, volatile, keep last 1``; the depth of others is unknown."""
    words = [_reliability(qos), _durability(qos)]
    history = _find(qos, "History")
    if isinstance(history, Policy.History.KeepLast):
        words.append(f"keep last {history.depth}")
    return ", ".join(words)


def keeps(qos: Qos) -> bool:
    """Return whether a publisher keeps messages for later subscribers."""
    return _rank(qos, "Durability", _DURABILITIES) > 0


def misfits(offered: Qos, requested: Qos) -> list[str]:
    """Return why an offer does not satisfy a request, in words; empty if it does (DDS 1.4, section 2.2.3)."""
    found = []
    if _reliability(requested) == "reliable" and _reliability(offered) != "reliable":
        found.append("the publisher is best effort, the subscriber wants reliable")
    if _rank(offered, "Durability", _DURABILITIES) < _rank(requested, "Durability", _DURABILITIES):
        found.append(f"the publisher is {_durability(offered)}, the subscriber wants {_durability(requested)}")
    if _time_ns(offered, "Deadline", "deadline") > _time_ns(requested, "Deadline", "deadline"):
        found.append(NO_DEADLINE)
    if _liveliness(offered) < _liveliness(requested) or (
        _time_ns(offered, "Liveliness", "lease_duration") > _time_ns(requested, "Liveliness", "lease_duration")
    ):
        found.append(NO_LIVELINESS)
    if _find(offered, "Ownership", Policy.Ownership.Shared) != _find(requested, "Ownership", Policy.Ownership.Shared):
        found.append("one has exclusive ownership, the other shared")
    if _rank(offered, "DestinationOrder", _ORDERS) < _rank(requested, "DestinationOrder", _ORDERS):
        found.append("the subscriber wants the order of the sending, the publisher has that of the arrival")
    return found


# ROS 2's nodes use the first version of CDR, but newer Cyclone DDS might select the second.
_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)


def _qos(topic: Topic[Any], profile: Profile) -> Qos:
    return Qos(
        _RELIABLE if profile.reliable else _BEST_EFFORT,
        _TRANSIENT_LOCAL if profile.latched else _VOLATILE,
        Policy.History.KeepLast(profile.depth),
        _CDR,
        _user_data(type_name(topic.type)),
    )


def _user_data(name: str) -> Any:
    return Policy.Userdata(f"typehash={type_hash(name)};".encode())


def _find(qos: Qos, scope: str, default: Any = None) -> Any:
    return next((policy for policy in qos if policy.__scope__ == scope), default)


def _reliability(qos: Qos) -> str:
    return "reliable" if isinstance(_find(qos, "Reliability"), Policy.Reliability.Reliable) else "best effort"


def _durability(qos: Qos) -> str:
    return ("volatile", "transient local", "transient", "persistent")[_rank(qos, "Durability", _DURABILITIES)]


def _rank(qos: Qos, scope: str, order: tuple[Any, ...]) -> int:
    return order.index(_find(qos, scope, order[0]))


def _liveliness(qos: Qos) -> int:
    policy = _find(qos, "Liveliness")
    return next((rank for rank, kind in enumerate(_LIVELINESS) if isinstance(policy, kind)), 0)


def _time_ns(qos: Qos, scope: str, attribute: str) -> int:
    return int(getattr(_find(qos, scope), attribute, _NEVER_NS))


idl: Any = cyclonedds.idl.types

_BASES: dict[str, Any] = {
    "bool": bool,
    "byte": idl.byte,
    "char": idl.uint8,
    "octet": idl.byte,
    "float32": idl.float32,
    "float64": idl.float64,
    **{f"{sign}int{bits}": getattr(idl, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
}


@functools.cache
def dds_type(name: str, distribution: str = "jazzy") -> Any:
    """Return the DDS type for the message type ``name``; its instances hold encoded messages in ``raw``."""
    return _struct(name, distribution, {})


@functools.cache
def service_dds_type(name: str) -> Any:
    """Return the DDS type for ``name``, a request or a reply, including the 16 bytes of its header.

    Cyclone DDS checks sent and received data, and rejects what does not fit the type.
    """
    return _struct(name, "jazzy", {"client": idl.uint64, "number": idl.int64})


def _struct(name: str, distribution: str, before: dict[str, Any]) -> Any:
    _, fields = types(distribution).fielddefs[name]
    members = {**before, **{field: _idl(kind, distribution) for field, kind in fields}}
    struct = make_idl_struct(name.rpartition("/")[2], dds_type_name(name), members, dataclassify=False)
    return _passing(struct)


def opaque_type(name: str) -> Any:
    """Return a DDS type that accepts the bytes of any message; ``name`` is as ``std_msgs::msg::dds_::String_``."""
    return _passing(make_idl_struct("Opaque", name, {"raw": idl.uint8}, dataclassify=False))


def _passing(struct: Any) -> Any:
    for method, passing in _PASSING.items():
        setattr(struct, method, passing)
    return struct


def _idl(kind: Any, distribution: str) -> Any:
    node, what = kind
    if node == Nodetype.NAME:
        return dds_type(what, distribution)
    if node == Nodetype.BASE:
        base, bound = what
        if base == "string":
            return idl.bounded_str[bound] if bound else str
        return _BASES[base]
    element, length = what
    if node == Nodetype.ARRAY:
        return idl.array[_idl(element, distribution), length]
    return idl.sequence[_idl(element, distribution), length] if length else idl.sequence[_idl(element, distribution)]


def _init(self: Any, raw: bytes) -> None:
    self.raw = raw


def _serialize(self: Any, *_: Any, **__: Any) -> bytes:
    return self.raw  # type: ignore[no-any-return]


def _deserialize(cls: Any, data: bytes, *_: Any, **__: Any) -> Any:
    return cls(data)


_PASSING = {
    "__init__": _init,
    "serialize": _serialize,
    "deserialize": classmethod(_deserialize),
    "deserialize_key": classmethod(_deserialize),
}
