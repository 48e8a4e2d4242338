"""Messages on ROS 1's wire: as bytes for rospy, and converted to and from our classes, which are those of ROS 2.

rosbags has the definitions of both, so no message package of ROS 1 is needed. Fields that only one of them has keep
their defaults: the header's ``seq``, which is 0 in messages within others, and textures and mesh files of markers.
"""

import functools
import struct
from typing import Any, ClassVar

import genpy
import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from handsteer.messages import CompressedImage, Header, Log, Marker, MeshFile, Time, type_name
from handsteer.transports.encoding import message_types

_HEADER, _MARKER = "std_msgs/msg/Header", "visualization_msgs/msg/Marker"
_LOG, _ROS1_LOG = "rcl_interfaces/msg/Log", "rosgraph_msgs/msg/Log"
_SEQ_BYTES = 4
_NO_BYTES = np.zeros(0, np.uint8)
_NO_HEADER = Header(Time(0, 0), "")


class RawMessage(genpy.Message):  # type: ignore[misc]
    """A message of rospy that consists of its bytes; :func:`ros1_type` returns the class of each type."""

    _type: ClassVar[str]
    _md5sum: ClassVar[str]
    _full_text: ClassVar[str]
    _slot_types: ClassVar[list[str]] = []
    has_header: ClassVar[bool]
    __slots__ = ("raw",)

    def __init__(self, raw: bytes | memoryview = b"") -> None:
        self.raw = raw

    def serialize(self, buffer: Any) -> None:
        """Write the message to a file-like object."""
        buffer.write(self.raw)

    def deserialize(self, raw: bytes) -> "RawMessage":
        """Take the message from ``raw``."""
        self.raw = raw
        return self


@functools.cache
def ros1_type(name: str) -> type[RawMessage]:
    """Return rospy's class for a message type such as ``std_msgs/msg/String``."""
    name = _ROS1_LOG if name == _LOG else name
    store = message_types(Stores.ROS1_NOETIC)
    if name not in store.fielddefs:  # those that rosbags has for ROS 2 only are the same in ROS 1
        store.register({name: _written_types().fielddefs[name]})
    for used in (store,) if name == _ROS1_LOG else (_written_types(), _read_types()):
        used.get_msgdef(name)  # compiles it before the first message
    definition, md5 = store.generate_msgdef(name)
    package, _, message = name.split("/")
    fields = store.fielddefs[name][1]
    has_header = bool(fields) and fields[0][1] == (Nodetype.NAME, _HEADER)
    attributes = {"_type": f"{package}/{message}", "_md5sum": md5, "_full_text": definition, "has_header": has_header}
    return type(message, (RawMessage,), {**attributes, "__slots__": ()})


def to_ros1(message: Any, number: int = 0) -> RawMessage:
    """Return one of our messages for rospy; ``number`` is the ``seq`` of its header, if it has one."""
    if isinstance(message, Log):
        return _to_ros1_log(message, number)
    name, store = type_name(type(message)), _written_types()
    raw = store.cdr_to_ros1(store.serialize_cdr(message, name), name)
    kind = ros1_type(name)
    return kind(b"".join((struct.pack("<I", number), raw[_SEQ_BYTES:])) if kind.has_header else raw)


def from_ros1(raw: bytes | memoryview, name: str) -> Any:
    """Return the message in the bytes of rospy's as our type ``name``; its arrays are read-only views of ``raw``.

    Raises:
        Exception: ``raw`` is not such a message; the type depends on where rosbags fails.
    """
    if name == _LOG:
        return _from_ros1_log(_ros1_types().deserialize_ros1(raw, _ROS1_LOG))
    return _read_types().deserialize_ros1(raw, name)


@functools.cache
def _ros1_types() -> Typestore:
    return get_typestore(Stores.ROS1_NOETIC)


def _to_ros1_log(message: Log, number: int) -> RawMessage:
    """Return a log message of ROS 2 as one of ROS 1, whose levels are 1, 2, 4, 8 and 16, not 10 to 50."""
    types = _ros1_types().types
    header = types[_HEADER](number, types["builtin_interfaces/msg/Time"](message.stamp.sec, message.stamp.nanosec), "")
    texts = {name: getattr(message, name) for name in ("name", "msg", "file", "function", "line")}
    theirs = types[_ROS1_LOG](header=header, level=1 << (message.level // 10 - 1), topics=[], **texts)
    return ros1_type(_LOG)(bytes(_ros1_types().serialize_ros1(theirs, _ROS1_LOG)))


def _from_ros1_log(theirs: Any) -> Log:
    stamp = Time(theirs.header.stamp.sec, theirs.header.stamp.nanosec)
    texts = {name: getattr(theirs, name) for name in ("name", "msg", "file", "function", "line")}
    return Log(stamp=stamp, level=10 * max(1, int(theirs.level).bit_length()), **texts)


@functools.cache
def _written_types() -> Typestore:
    """Return our types without the fields that ROS 1 does not have; rosbags adds ``seq`` to headers."""
    store = message_types()
    there = {field for field, _ in _ros1_types().fielddefs[_MARKER][1]}
    constants, fields = store.fielddefs[_MARKER]
    store.fielddefs[_MARKER] = (constants, [(field, kind) for field, kind in fields if field in there])
    return store


@functools.cache
def _read_types() -> Typestore:
    """Return types with the fields of ROS 1, whose messages are instances of our classes."""
    store = message_types()
    store.fielddefs[_MARKER] = _written_types().fielddefs[_MARKER]
    store.fielddefs[_HEADER] = _ros1_types().fielddefs[_HEADER]
    makers: dict[str, Any] = {_MARKER: _make_marker, _HEADER: lambda _seq, stamp, frame_id: Header(stamp, frame_id)}
    store.types |= makers
    return store


def _make_marker(*values: Any) -> Marker:
    names = [field for field, _ in _written_types().fielddefs[_MARKER][1]]
    return Marker(
        **dict(zip(names, values, strict=True)),
        texture_resource="",
        texture=CompressedImage(_NO_HEADER, "", _NO_BYTES),
        uv_coordinates=[],
        mesh_file=MeshFile("", _NO_BYTES),
    )
