"""DDS types for ROS 2's messages, generated from the field definitions of rosbags.

DDS needs the definition to match topics; the messages themselves are passed in encoded form, which is much faster than
cyclonedds's own encoder for large ones.
"""

import functools
from typing import Any

import cyclonedds.idl.types
from cyclonedds.idl import make_idl_struct
from rosbags.interfaces import Nodetype

from handsteer.transports.ros2.encoding import dds_type_name, types

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
