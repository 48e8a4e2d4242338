import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import TransportError
from handsteer.messages import CAMERA_INFO, CLOCK, CMD_VEL, IMAGE_COMPRESSED, IMAGE_RAW, TF
from handsteer.plugins.ros2.names import NodeName, Remap, dds_type_name, identify, ros_type_name

TOKENS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
FULL = st.lists(TOKENS, min_size=1, max_size=4).map(lambda parts: "".join(f"/{part}" for part in parts))
NAMESPACES = st.just("/") | FULL
NODES = st.builds(NodeName, TOKENS, NAMESPACES)
VALID = re.compile(r"(/[A-Za-z_]\w*)+", re.ASCII)


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("image_raw", "/r1/image_raw"),
        ("/image_raw", "/image_raw"),
        ("camera/image", "/r1/camera/image"),
        ("~", "/r1/cam"),
        ("~/image", "/r1/cam/image"),
        ("{node}/image", "/r1/cam/image"),
        ("{ns}/image", "/r1/image"),
        ("/all/{node}", "/all/cam"),
    ],
)
def test_expansion(name: str, full: str) -> None:
    assert NodeName("cam", "/r1").expand(name) == full


def test_compressed_images_are_renamed_with_the_raw_ones_unless_they_have_a_rule_of_their_own() -> None:
    eye = NodeName("cam", "/r1", (Remap("image_raw", "/x"),))
    assert (eye.topic(IMAGE_RAW), eye.topic(IMAGE_COMPRESSED)) == ("/x", "/x/compressed")
    eye = NodeName("cam", "/r1", (Remap("image_raw", "/x"), Remap("image_raw/compressed", "jpeg")))
    assert (eye.topic(IMAGE_RAW), eye.topic(IMAGE_COMPRESSED)) == ("/x", "/r1/jpeg")
    assert NodeName("cam", "/r1").topic(IMAGE_COMPRESSED) == "/r1/image_raw/compressed"


@pytest.mark.parametrize(
    ("rules", "name"),
    [
        ({}, "/r1/camera_info"),
        ({"image_raw": "/front/image"}, "/front/camera_info"),
        ({"image_raw": "front/image"}, "/r1/front/camera_info"),
        ({"image_raw": "/image"}, "/camera_info"),
        ({"image_raw": "/front/image", "camera_info": "info"}, "/r1/info"),
    ],
)
def test_camera_info_lies_beside_the_images_unless_it_has_a_rule_of_its_own(rules: dict[str, str], name: str) -> None:
    assert NodeName("cam", "/r1", tuple(Remap(*rule) for rule in rules.items())).topic(CAMERA_INFO) == name


@pytest.mark.parametrize("name", ["", "/", "a//b", "a/", "1a", "a/2b", "a b", "~a", "a-b", "é", "{wrong}/a", "a" * 300])
def test_names_that_are_not_allowed(name: str) -> None:
    with pytest.raises(TransportError, match="is not a valid topic name in ROS 2"):
        NodeName("cam", "/r1").expand(name)


@given(NODES, st.text(max_size=12))
def test_an_expanded_name_is_full_or_refused(node: NodeName, name: str) -> None:
    try:
        full = node.expand(name)
    except TransportError:
        return
    assert VALID.fullmatch(full)
    assert node.expand(full) == full


@given(NODES, FULL)
def test_full_names_stay_and_relative_ones_move_with_the_namespace(node: NodeName, name: str) -> None:
    assert node.expand(name) == name
    assert node.expand(name[1:]) == node.namespace.rstrip("/") + name
    assert node.expand(f"~{name}") == node.full + name


def test_topics_move_with_the_namespace_but_global_ones_stay() -> None:
    node = NodeName("cam", "/r1")
    assert node.topic(IMAGE_RAW) == "/r1/image_raw"
    assert node.topic(TF) == "/tf"
    assert node.topic(CLOCK) == "/clock"


@pytest.mark.parametrize(
    ("source", "target", "full"),
    [
        ("image_raw", "front/image", "/r1/front/image"),
        ("image_raw", "/front/image", "/front/image"),
        ("/r1/image_raw", "image", "/r1/image"),
        ("/image_raw", "/image", "/r1/image_raw"),
        ("image_raw", "~/image", "/r1/cam/image"),
    ],
)
def test_a_rule_is_compared_with_the_full_name(source: str, target: str, full: str) -> None:
    assert NodeName("cam", "/r1", (Remap(source, target),)).topic(IMAGE_RAW) == full


def test_the_first_rule_that_fits_counts_and_rules_do_not_chain() -> None:
    rules = (Remap("image_raw", "a"), Remap("image_raw", "b"), Remap("a", "c"))
    assert NodeName("cam", "/", rules).topic(IMAGE_RAW) == "/a"


def test_a_rule_may_hold_for_one_node_only() -> None:
    rules = (Remap("image_raw", "a", "other"), Remap("image_raw", "b", "cam"))
    assert identify("cam", rules).topic(IMAGE_RAW) == "/b"


def test_node_and_namespace_are_renamed() -> None:
    node = identify("my_camera", [Remap("__ns", "/r1"), Remap("__node", "eye"), Remap("__node", "late")])
    assert node.full == "/r1/eye"
    assert identify("my_camera", [Remap("__ns", "/r1", "eye"), Remap("__node", "eye")]).full == "/r1/eye"
    assert identify("my_camera", [Remap("__ns", "/")]).full == "/my_camera"


@given(TOKENS, TOKENS, NAMESPACES, FULL)
def test_a_remapped_topic_has_its_target_in_every_namespace(name: str, new: str, namespace: str, target: str) -> None:
    rules = [Remap("__node", new), Remap("__ns", namespace), Remap(CMD_VEL.ros_name, target)]
    node = identify(name, rules)
    assert node.full == f"{namespace.rstrip('/')}/{new}"
    assert node.topic(CMD_VEL) == target


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (Remap("__node", "a/b"), "__node:=a/b: the name of a node has letters"),
        (Remap("__node", ""), "__node:=: the name of a node"),
        (Remap("__ns", "r1"), "__ns:=r1: a namespace starts with a slash"),
        (Remap("__ns", "/r1/"), "__ns:=/r1/: a namespace"),
        (Remap("image_raw", "a b"), "'a b' is not a valid topic name"),
    ],
)
def test_wrong_names_are_refused_at_the_start(rule: Remap, message: str) -> None:
    with pytest.raises(TransportError, match=f"^{re.escape(message)}"):
        identify("cam", [rule])


def test_names_in_dds() -> None:
    assert dds_type_name("geometry_msgs/msg/Twist") == "geometry_msgs::msg::dds_::Twist_"
    assert ros_type_name("geometry_msgs::msg::dds_::Twist_") == "geometry_msgs/msg/Twist"
