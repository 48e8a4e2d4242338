import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.messages import Quaternion, yaw_of
from handsteer.plugins.page.scene import about_axis, css_colour, from_quaternion, from_rpy, parents_first
from handsteer.plugins.page.urdf import Joint, joints
from handsteer.robots.description import robot_description

ANGLES = st.floats(-math.pi, math.pi)
PARTS = st.floats(-1, 1)
NOWHERE = (0.0, 0.0, 0.0)


def joint(parent: str, child: str) -> Joint:
    return Joint(f"{parent}_{child}", "fixed", parent, child, NOWHERE, NOWHERE, (1.0, 0.0, 0.0))


@given(axis=st.tuples(PARTS, PARTS, PARTS), angle=ANGLES)
def test_a_rotation_keeps_its_axis_and_all_lengths(axis: tuple[float, float, float], angle: float) -> None:
    turn = about_axis(axis, angle)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-9)
    assert turn @ np.array(axis) == pytest.approx(np.array(axis), abs=1e-9)


def test_a_left_turn_brings_x_to_y() -> None:
    assert about_axis((0, 0, 5), math.pi / 2) @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-12)


def test_roll_goes_before_pitch_before_yaw() -> None:
    turn = from_rpy((math.pi / 2, 0.0, math.pi / 2))
    assert turn @ [0, 1, 0] == pytest.approx([0, 0, 1], abs=1e-12)
    assert turn @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-12)


@given(yaw=st.floats(-3.1, 3.1), length=st.floats(0.1, 10))
def test_a_quaternion_of_any_length_turns_as_its_yaw(yaw: float, length: float) -> None:
    quaternion = Quaternion(0.0, 0.0, length * math.sin(yaw / 2), length * math.cos(yaw / 2))
    assert from_quaternion(quaternion) == pytest.approx(from_rpy((0.0, 0.0, yaw)), abs=1e-9)
    assert yaw_of(quaternion) == pytest.approx(yaw)


def test_a_quaternion_that_was_left_empty_turns_nothing() -> None:
    assert from_quaternion(Quaternion(0.0, 0.0, 0.0, 0.0)) == pytest.approx(np.eye(3))


def test_colours_are_cut_to_what_css_knows() -> None:
    assert css_colour((0.0, 0.5, 1.0)) == "#0080ff"
    assert css_colour((-1.0, 2.0, 0.2)) == "#00ff33"


def test_joints_come_after_the_ones_that_hold_them() -> None:
    chain = [joint("arm", "hand"), joint("base", "arm"), joint("hand", "finger")]
    assert [found.child for found in parents_first(chain)] == ["arm", "hand", "finger"]


def test_joints_in_a_circle_are_left_out() -> None:
    assert [found.child for found in parents_first([joint("a", "b"), joint("b", "a"), joint("base", "c")])] == ["c"]


def test_keeps_all_joints_of_the_robot() -> None:
    found = joints(robot_description())
    assert {*parents_first(found)} == {*found}
