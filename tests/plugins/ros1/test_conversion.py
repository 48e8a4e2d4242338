"""Messages to ROS 1 and back; the types differ, and neither side may lose what both have."""

import dataclasses
import importlib
import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.typesys.stores import ros2_jazzy

from handsteer.clock import to_stamp
from handsteer.messages import Header, JointState, Log, Time
from handsteer.nodes.world_markers import world_markers
from handsteer.robots import Obstacle

pytestmark = pytest.mark.ros1

SENT = [
    "std_msgs/msg/String",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/LaserScan",
    "geometry_msgs/msg/Twist",
    "nav_msgs/msg/Odometry",
    "tf2_msgs/msg/TFMessage",
    "rosgraph_msgs/msg/Clock",
    "diagnostic_msgs/msg/DiagnosticArray",
    "visualization_msgs/msg/MarkerArray",
]
"""Every type that the graph speaks."""

ONLY_IN_ROS2 = {"texture_resource", "texture", "uv_coordinates", "mesh_file"}
WHOLE = {
    "int8": (-(2**7), 2**7),
    "uint8": (0, 2**8),
    "byte": (0, 2**7),
    "int32": (-(2**31), 2**31),
    "uint32": (0, 2**32),
}
TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")


def values(name: str) -> st.SearchStrategy[Any]:
    """Return messages of a type with anything in them that both sides can hold."""
    if name in TIMES:
        here = getattr(ros2_jazzy, name.replace("/", "__"))
        return st.builds(here, sec=st.integers(0, 2**31 - 1), nanosec=st.integers(0, 999_999_999))
    fields = {field: of(kind) for field, kind in ros2_jazzy.FIELDDEFS[name][1]}
    return st.builds(getattr(ros2_jazzy, name.replace("/", "__")), **fields)


def of(kind: Any) -> st.SearchStrategy[Any]:
    node, what = kind
    if node == Nodetype.NAME:
        return values(what)
    if node == Nodetype.BASE:
        return base(what[0])
    element, length = what
    shape = {"min_size": length, "max_size": length} if node == Nodetype.ARRAY else {"max_size": 3}
    if element[0] == Nodetype.NAME or element[1][0] == "string":
        return st.lists(of(element), **shape)
    return st.lists(base(element[1][0]), **shape).map(lambda items: np.array(items, element[1][0]))


def base(name: str) -> st.SearchStrategy[Any]:
    if name in WHOLE:
        low, end = WHOLE[name]
        return st.integers(low, end - 1)
    return {"string": st.text(max_size=5), "bool": st.booleans()}.get(
        name, st.floats(allow_nan=False, width=32 if name == "float32" else 64)
    )


def plain(message: Any) -> Any:
    """Return a message as plain values, without what only ROS 2 has."""
    if dataclasses.is_dataclass(message):
        names = [field.name for field in dataclasses.fields(message) if field.name not in ONLY_IN_ROS2]
        return {name: plain(getattr(message, name)) for name in names if name != "__msgtype__"}
    if isinstance(message, np.ndarray):
        return (message.dtype, message.tolist())
    return [plain(item) for item in message] if isinstance(message, list) else message


@pytest.mark.parametrize("name", SENT)
@given(data=st.data())
def test_there_on_the_wire_and_back(name: str, data: st.DataObject) -> None:
    """What ROS's own class makes of the bytes comes back too."""
    from handsteer.plugins.ros1.conversion import RawMessage, from_ros1, ros1_type, to_ros1  # noqa: PLC0415

    ours, wire = data.draw(values(name)), io.BytesIO()
    theirs = ros_class(name)
    to_ros1(ours).serialize(wire)
    back = from_ros1(ros1_type(name)().deserialize(wire.getvalue()).raw, name)
    assert type(back) is type(ours)
    assert plain(back) == plain(ours)
    again = io.BytesIO()
    theirs().deserialize(wire.getvalue()).serialize(again)
    assert again.getvalue() == wire.getvalue()
    assert isinstance(to_ros1(ours), RawMessage)


@pytest.mark.parametrize("name", SENT)
def test_each_type_has_the_name_and_checksum_of_ros(name: str) -> None:
    from handsteer.plugins.ros1.conversion import ros1_type  # noqa: PLC0415

    assert (ros1_type(name)._type, ros1_type(name)._md5sum) == (ros_class(name)._type, ros_class(name)._md5sum)


def test_a_header_has_its_number() -> None:
    from handsteer.plugins.ros1.conversion import from_ros1, to_ros1  # noqa: PLC0415

    ours = JointState(Header(stamp=to_stamp(1.5), frame_id="odom"), ["wheel"], np.ones(1), np.ones(1), np.zeros(0))
    sent = to_ros1(ours, 7)
    wire = io.BytesIO()
    sent.serialize(wire)
    assert ros_class("sensor_msgs/msg/JointState")().deserialize(wire.getvalue()).header.seq == 7
    assert plain(from_ros1(sent.raw, "sensor_msgs/msg/JointState")) == plain(ours)


def test_the_turtle_is_known_without_its_package() -> None:
    from handsteer.plugins.ros1.conversion import ros1_type  # noqa: PLC0415

    assert ros1_type("turtlesim/msg/Pose")._md5sum == "863b248d5016ca62ea2e895ae5265cf9"


def ros_class(name: str) -> Any:
    package, _, message = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), message)


def test_fields_that_ros_1_does_not_have_come_back_empty() -> None:
    from handsteer.plugins.ros1.conversion import from_ros1, to_ros1  # noqa: PLC0415

    header = Header(stamp=to_stamp(1.5), frame_id="odom")
    box = Obstacle("crate", "box", (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    sent = world_markers(header, [box])
    back = from_ros1(to_ros1(sent).raw, "visualization_msgs/msg/MarkerArray").markers[0]
    assert (back.ns, back.text, back.scale) == ("world", "", sent.markers[0].scale)
    assert back.texture.header.stamp == Time(0, 0)
    assert (back.uv_coordinates, back.mesh_file.filename, back.texture.data.size) == ([], "", 0)


@pytest.mark.parametrize("level", [10, 20, 30, 40, 50])
def test_a_log_message_is_one_of_ros1_there(level: int) -> None:
    from handsteer.plugins.ros1.conversion import from_ros1, to_ros1  # noqa: PLC0415

    sent = Log(Time(12, 5), level, "viewer 1", "pressed Stop", "/stop", "stop_pressed", 0)
    ours = to_ros1(sent, 7)
    theirs = importlib.import_module("rosgraph_msgs.msg").Log
    assert (ours._type, ours._md5sum) == (theirs._type, theirs._md5sum)
    read = theirs().deserialize(ours.raw)
    assert (read.header.seq, read.header.stamp.secs, read.level) == (7, 12, 1 << (level // 10 - 1))
    assert (read.name, read.msg, read.file, read.function) == ("viewer 1", "pressed Stop", "/stop", "stop_pressed")
    assert from_ros1(ours.raw, "rcl_interfaces/msg/Log") == sent
