"""Converts between our message classes (ROS 2 Jazzy) and those of rospy (ROS 1 Noetic), field by field.

Fields that only one of them has keep their defaults: the header's ``seq`` in ROS 1, textures of markers in ours.
"""

import dataclasses
import functools
import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys.stores import ros2_jazzy

from handsteer.errors import TransportError
from handsteer.messages import TurtlePose

_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_BYTES = ("uint8", "byte", "char", "octet")
_FLOAT32 = (Nodetype.BASE, ("float32", 0))
_EMPTY = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}

Convert = Callable[[Any], Any]


@functools.cache
def ros1_type(name: str) -> Any:
    """Return rospy's class for a message type such as ``std_msgs/msg/String``.

    Raises:
        TransportError: The package is not installed, or has no such message.
    """
    package, _, message = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), message)
    except (ImportError, AttributeError):
        debian = package.replace("_", "-")
        raise TransportError(
            f"ROS 1 has no {package}/{message} here: install it (Debian, Ubuntu: python3-{debian})"
        ) from None


def to_ros1(message: Any) -> Any:
    """Return one of our messages as rospy's."""
    return _writer(message.__msgtype__)(message)


def from_ros1(message: Any, name: str) -> Any:
    """Return rospy's message as our type ``name``; an array of bytes is shared, and read-only."""
    return _reader(name)(message)


@functools.cache
def _writer(name: str) -> Convert:
    there = ros1_type(name)
    steps = [(field, named, _write_as(kind)) for field, kind in _fields(name) if (named := _there(field, there))]

    def write(ours: Any) -> Any:
        # With values for all fields it constructs no defaults, which take most of the time for nested messages.
        return there(**{named: convert(getattr(ours, field)) for field, named, convert in steps})

    return write


@functools.cache
def _reader(name: str) -> Convert:
    here, there = _ours(name), ros1_type(name)
    steps = [(field, named, _read_as(kind)) for field, kind in _fields(name) if (named := _there(field, there))]
    absent = [(field, kind) for field, kind in _fields(name) if not _there(field, there)]

    def read(theirs: Any) -> Any:
        values = {field: convert(getattr(theirs, named)) for field, named, convert in steps}
        return here(**values, **{field: _default(kind) for field, kind in absent})

    return read


def _there(field: str, kind: Any) -> str:
    """Return the name of our ``field`` in rospy's class, where calibrations have upper case; empty if none."""
    return next((name for name in (field, field.upper()) if name in kind.__slots__), "")


def _fields(name: str) -> list[tuple[str, Any]]:
    if name == TurtlePose.__msgtype__:
        return [(part.name, _FLOAT32) for part in dataclasses.fields(TurtlePose)]
    return list(ros2_jazzy.FIELDDEFS[name][1])


def _ours(name: str) -> Any:
    return TurtlePose if name == TurtlePose.__msgtype__ else getattr(ros2_jazzy, name.replace("/", "__"))


def _write_as(kind: Any) -> Convert:
    node, what = kind
    if node == Nodetype.NAME:
        return _write_time(what) if what in _TIMES else _writer(what)
    if node == Nodetype.BASE:
        return _same
    element = what[0]
    if element[0] == Nodetype.NAME:
        return _each(_write_as(element))
    return _to_bytes if element[1][0] in _BYTES else _to_list


def _read_as(kind: Any) -> Convert:
    node, what = kind
    if node == Nodetype.NAME:
        return _read_time(what) if what in _TIMES else _reader(what)
    if node == Nodetype.BASE:
        return _same
    element = what[0]
    if element[0] == Nodetype.NAME:
        return _each(_read_as(element))
    name = element[1][0]
    if name in _BYTES:
        return _from_bytes
    return list if name == "string" else functools.partial(np.array, dtype=name)


def _default(kind: Any) -> Any:
    node, what = kind
    if node == Nodetype.BASE:
        return _EMPTY.get(what[0], 0)
    if node == Nodetype.NAME:
        here = _ours(what)
        return here(**{field: _default(of) for field, of in _fields(what)})
    element, length = what
    if element[0] == Nodetype.NAME or element[1][0] == "string":
        return [_default(element) for _ in range(length)]
    return np.zeros(length, "uint8" if element[1][0] in _BYTES else element[1][0])


def _write_time(name: str) -> Convert:
    genpy = importlib.import_module("genpy")
    there = genpy.Time if name == _TIMES[0] else genpy.Duration
    return lambda ours: there(ours.sec, ours.nanosec)


def _read_time(name: str) -> Convert:
    here = _ours(name)
    return lambda theirs: here(sec=theirs.secs, nanosec=theirs.nsecs)


def _each(convert: Convert) -> Convert:
    return lambda values: [convert(value) for value in values]


def _same(value: Any) -> Any:
    return value


def _to_list(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _to_bytes(values: Any) -> bytes:
    return values.tobytes() if isinstance(values, np.ndarray) else bytes(values)


def _from_bytes(values: Any) -> Any:
    return np.frombuffer(values, np.uint8)
