from contextlib import suppress
from xml.sax.saxutils import escape

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import WorldError
from handsteer.plugins.page.urdf import joints, visuals
from handsteer.robots.description import robot_description

WHEELS = {
    "front_left_wheel_joint": (0.2, 0.225),
    "front_right_wheel_joint": (0.2, -0.225),
    "rear_left_wheel_joint": (-0.2, 0.225),
    "rear_right_wheel_joint": (-0.2, -0.225),
}


def test_joints_are_those_of_the_robot() -> None:
    tree = {joint.name: joint for joint in joints(robot_description())}
    wheels = {name: joint for name, joint in tree.items() if joint.type == "continuous"}
    assert {name: joint.xyz[:2] for name, joint in wheels.items()} == WHEELS
    assert all(joint.axis == (0.0, 1.0, 0.0) for joint in wheels.values())
    children = {joint.child for joint in tree.values()}
    assert {joint.parent for joint in tree.values()} - children == {"base_link"}


def test_visuals_are_those_of_the_robot() -> None:
    shapes = {visual.link: visual for visual in visuals(robot_description())}
    assert shapes["chassis"].size == (0.4, 0.4, 0.1)
    assert shapes["head"].size == (0.04, 0.04, 0.04)
    wheel = shapes["rear_left_wheel"]
    assert wheel.shape == "cylinder"
    assert wheel.size == (0.12, 0.12, 0.04)
    assert wheel.rpy[0] == pytest.approx(1.5708, abs=1e-4)
    assert len({visual.rgba for visual in shapes.values()}) == 3


def test_the_wheels_stand_on_the_floor_of_base_link() -> None:
    (chassis,) = (joint for joint in joints(robot_description()) if joint.child == "chassis")
    assert chassis.parent == "base_link"
    assert chassis.xyz[2] == 0.06


def test_colours_meshes_and_defaults_of_another_robot() -> None:
    (ball,) = visuals(
        """<robot name="r"><link name="l">
        <visual><geometry><mesh filename="m.stl"/></geometry></visual>
        <visual><geometry><sphere radius="2"/></geometry></visual></link></robot>"""
    )
    assert (ball.shape, ball.size, ball.xyz) == ("sphere", (4.0, 4.0, 4.0), (0.0, 0.0, 0.0))
    assert ball.rgba[3] == 1.0


def read(urdf: str) -> None:
    visuals(urdf)
    joints(urdf)


@pytest.mark.parametrize(
    ("urdf", "words"),
    [
        ("", "not valid XML"),
        ("<robot", "not valid XML"),
        ("<sdf/>", "<robot>"),
        ('<robot><link name="l"><visual><geometry><box size="1 2"/></geometry></visual></link></robot>', "size"),
        ('<robot><link name="l"><visual><geometry><sphere/></geometry></visual></link></robot>', "radius"),
        ('<robot><link name="l"><visual><geometry><sphere radius="nan"/></geometry></visual></link></robot>', "radius"),
        ('<robot><joint name="j"><parent link="a"/></joint></robot>', "'j'"),
    ],
)
def test_a_bad_description_is_refused_in_one_line(urdf: str, words: str) -> None:
    with pytest.raises(WorldError) as error:
        read(urdf)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(WorldError):
        read(text)
    with suppress(WorldError):
        read(f'<robot><link name="l"><visual><geometry><box size="{escape(text)}"/></geometry></visual></link></robot>')
