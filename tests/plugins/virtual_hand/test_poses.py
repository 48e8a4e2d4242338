import numpy as np
import pytest

from handsteer.errors import PoseError
from handsteer.plugins.virtual_hand.kinematics import LIMITS, pose_joints
from handsteer.plugins.virtual_hand.poses import Pinhole, sign_pose
from handsteer.types import BACKWARD, FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT, Handedness

CAMERA = Pinhole.webcam(640, 480)
HANDS: tuple[Handedness, ...] = ("Left", "Right")
OTHER: dict[Handedness, Handedness] = {"Left": "Right", "Right": "Left"}
MIRRORED = {TURN_LEFT: TURN_RIGHT, TURN_RIGHT: TURN_LEFT}
WRIST, THUMB_MCP, THUMB_TIP, INDEX_MCP, INDEX_TIP, MIDDLE_MCP = 0, 2, 4, 5, 8, 9


def pixels(sign: str, hand: Handedness) -> np.ndarray:
    pose = sign_pose(sign, hand)
    return CAMERA.project(pose.view.placement(hand).apply(pose_joints(pose.angles)[0]))


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("sign", [*SIGNS, NONE])
def test_the_angles_of_a_sign_are_a_hands(sign: str, hand: Handedness) -> None:
    angles = sign_pose(sign, hand).angles
    assert np.all((angles >= LIMITS[:, 0]) & (angles <= LIMITS[:, 1]))


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("sign", SIGNS)
def test_the_whole_hand_is_in_the_picture(sign: str, hand: Handedness) -> None:
    assert np.all((pixels(sign, hand) > [20, 20]) & (pixels(sign, hand) < [620, 460]))


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("sign", SIGNS)
def test_the_other_hand_shows_the_mirror_image_which_swaps_the_turns(sign: str, hand: Handedness) -> None:
    mirrored = pixels(sign, hand) * [-1, 1] + [CAMERA.width, 0]
    np.testing.assert_allclose(pixels(MIRRORED.get(sign, sign), OTHER[hand]), mirrored, atol=1e-9)


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize(
    ("sign", "first", "last", "towards"),
    [
        # The user's own right is the left edge of a picture that is not mirrored; y is down.
        (FORWARD, INDEX_MCP, INDEX_TIP, (0, -1)),
        (BACKWARD, INDEX_MCP, INDEX_TIP, (0, 1)),
        (TURN_RIGHT, THUMB_MCP, THUMB_TIP, (-1, 0)),
        (TURN_LEFT, THUMB_MCP, THUMB_TIP, (1, 0)),
        (STOP, WRIST, MIDDLE_MCP, (0, -1)),
        (GO, WRIST, MIDDLE_MCP, (0, -1)),
    ],
)
def test_signs_point_where_their_names_say(
    sign: str, hand: Handedness, first: int, last: int, towards: tuple[int, int]
) -> None:
    joints = pixels(sign, hand)
    pointing = joints[last] - joints[first]
    assert pointing @ towards / np.linalg.norm(pointing) > np.cos(np.radians(20))


def test_an_unknown_sign_is_refused() -> None:
    with pytest.raises(PoseError, match=r"unknown sign 'Wave'.*Forward"):
        sign_pose("Wave")
