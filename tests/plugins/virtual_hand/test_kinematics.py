import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from handsteer.plugins.virtual_hand.kinematics import (
    ANGLES,
    BONE_LENGTHS_M,
    LIMITS,
    angles_of,
    clamp,
    pose_joints,
    pose_skeleton,
)
from handsteer.recognition.hand import CONNECTIONS

SHARES = hnp.arrays(float, (3, len(ANGLES)), elements=st.floats(0, 1))
LENGTHS = hnp.arrays(float, (3, 20), elements=st.floats(0.005, 0.15))
PARENTS = {child: parent for parent, child in CONNECTIONS if (parent, child) not in {(5, 9), (9, 13), (13, 17)}}
PARENTS |= {9: 0, 13: 0}

WRIST, THUMB_TIP, INDEX_TIP, MIDDLE_MCP, MIDDLE_TIP, LITTLE_TIP = 0, 4, 8, 9, 12, 20


def within_limits(shares: np.ndarray) -> np.ndarray:
    return LIMITS[:, 0] + shares * (LIMITS[:, 1] - LIMITS[:, 0])


@given(SHARES, LENGTHS)
def test_every_pose_keeps_the_lengths_of_all_bones(shares: np.ndarray, lengths: np.ndarray) -> None:
    joints = pose_joints(within_limits(shares), lengths)
    for child in range(1, 21):
        measured = np.linalg.norm(joints[:, child] - joints[:, PARENTS[child]], axis=1)
        np.testing.assert_allclose(measured, lengths[:, child - 1], atol=1e-9)


@given(SHARES)
def test_a_batch_gives_what_each_hand_gives_alone(shares: np.ndarray) -> None:
    angles = within_limits(shares)
    alone = np.concatenate([pose_joints(row) for row in angles])
    np.testing.assert_allclose(pose_joints(angles), alone, atol=1e-12)


@given(SHARES)
def test_the_axes_of_a_bone_are_a_rotation_and_follow_the_bone(shares: np.ndarray) -> None:
    skeleton = pose_skeleton(within_limits(shares))
    axes = skeleton.axes
    np.testing.assert_allclose(axes @ np.swapaxes(axes, -1, -2), np.broadcast_to(np.eye(3), axes.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=1e-9)
    last_bone = skeleton.joints[:, 4::4] - skeleton.joints[:, 3::4]
    last_bone /= np.linalg.norm(last_bone, axis=-1, keepdims=True)
    np.testing.assert_allclose(axes[:, :, 2, :, 1], last_bone, atol=1e-9)


def test_a_flat_right_hand_lies_as_documented() -> None:
    (flat,) = pose_joints(np.zeros(len(ANGLES)))
    assert flat[MIDDLE_TIP, 1] == flat[:, 1].max() > 0.17
    assert flat[INDEX_TIP, 0] > flat[MIDDLE_TIP, 0] > flat[LITTLE_TIP, 0]
    assert flat[THUMB_TIP, 0] > 0.01
    assert np.all(np.abs(flat[:, 2]) < 0.03)


@pytest.mark.parametrize("finger", ["index", "middle", "ring", "little"])
def test_bending_a_joint_moves_the_finger_tip_out_of_the_palm(finger: str) -> None:
    tip = 8 + 4 * ["index", "middle", "ring", "little"].index(finger)
    (flat,) = pose_joints(np.zeros(len(ANGLES)))
    for joint in ("mcp", "pip", "dip"):
        (bent,) = pose_joints(angles_of(**{f"{finger}_{joint}": 40}))
        assert bent[tip, 2] > flat[tip, 2] + 0.005
        others = [i for i in range(21) if not tip - 3 <= i <= tip]
        np.testing.assert_array_equal(bent[others], flat[others])


def test_the_thumb_spreads_to_its_side_and_opposes_out_of_the_palm() -> None:
    (rest,) = pose_joints(np.zeros(len(ANGLES)))
    (spread,) = pose_joints(angles_of(thumb_spread=50))
    (opposed,) = pose_joints(angles_of(thumb_opposition=50))
    assert spread[THUMB_TIP, 0] > rest[THUMB_TIP, 0] + 0.05
    assert opposed[THUMB_TIP, 2] > rest[THUMB_TIP, 2] + 0.05


def test_bending_the_wrist_moves_only_the_forearm() -> None:
    straight, bent = pose_skeleton(np.zeros(len(ANGLES))), pose_skeleton(angles_of(wrist_flexion=40))
    np.testing.assert_array_equal(straight.joints, bent.joints)
    np.testing.assert_allclose(straight.forearm, [[0, -1, 0]], atol=1e-12)
    assert bent.forearm[0, 2] > 0.5


@given(hnp.arrays(float, (2, len(ANGLES)), elements=st.floats(-10, 10)))
def test_clamped_angles_are_within_the_limits(angles: np.ndarray) -> None:
    clamped = clamp(angles)
    assert np.all((clamped >= LIMITS[:, 0]) & (clamped <= LIMITS[:, 1]))
    inside = (angles >= LIMITS[:, 0]) & (angles <= LIMITS[:, 1])
    np.testing.assert_array_equal(clamped[inside], angles[inside])


def test_the_standard_hand_is_an_adults() -> None:
    (flat,) = pose_joints(np.zeros(len(ANGLES)), BONE_LENGTHS_M)
    assert 0.17 < np.linalg.norm(flat[MIDDLE_TIP] - flat[WRIST]) < 0.20


def test_an_unknown_angle_is_named() -> None:
    with pytest.raises(KeyError, match="thumb_dip"):
        angles_of(thumb_dip=3)
