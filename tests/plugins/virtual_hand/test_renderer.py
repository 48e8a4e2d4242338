import numpy as np
import pytest

from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole, View, sign_pose
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render, true_pixels
from handsteer.types import SIGNS, STOP, Handedness

CAMERA = Pinhole.webcam(320, 240)
WALL = np.full((240, 320, 3), (210, 40, 40), np.uint8)
SKELETON = pose_skeleton(sign_pose(STOP).angles)


def draw(view: View | None = None, hand: Handedness = "Right", look: Look | None = None) -> np.ndarray:
    placement = (view or sign_pose(STOP).view).placement(hand)
    return render(SKELETON, placement, CAMERA, look or Look(), WALL)


def drawn(image: np.ndarray) -> np.ndarray:
    return np.asarray(np.any(image != WALL, axis=-1))


@pytest.mark.parametrize("hand", ["Left", "Right"])
@pytest.mark.parametrize("sign", SIGNS)
def test_the_true_joints_lie_on_the_drawn_hand(sign: str, hand: Handedness) -> None:
    pose = sign_pose(sign, hand)
    skeleton, placement = pose_skeleton(pose.angles), pose.view.placement(hand)
    mask = drawn(render(skeleton, placement, CAMERA, Look(), WALL))
    x, y = true_pixels(skeleton, placement, CAMERA).astype(int).T
    assert mask[y, x].all()
    assert mask.mean() < 0.4


def test_a_left_hand_is_drawn_as_the_mirror_image() -> None:
    light = (0.0, -1.0, -1.0)
    right = draw(hand="Right", look=Look(light=light)).astype(int)
    left = draw(hand="Left", look=Look(light=light)).astype(int)
    assert np.mean(np.abs(right - left[:, ::-1]).max(axis=-1) > 25) < 0.01
    assert np.mean(np.abs(right - left).max(axis=-1) > 25) > 0.03


def test_the_same_hand_gives_the_same_picture_and_leaves_the_background_alone() -> None:
    before = WALL.copy()
    np.testing.assert_array_equal(draw(), draw())
    np.testing.assert_array_equal(before, WALL)


@pytest.mark.parametrize("position", [(0.0, 2.0, 0.55), (3.0, 0.0, 0.55), (0.0, -2.0, 0.55)])
def test_a_hand_out_of_the_picture_leaves_the_background(position: tuple[float, float, float]) -> None:
    assert not drawn(draw(View(position=position, roll=np.pi if position[1] < 0 else 0.0))).any()


@pytest.mark.parametrize("pitch", [60.0, 90.0, 120.0])
def test_an_arm_from_behind_the_camera_is_drawn_as_far_as_it_is_in_front(pitch: float) -> None:
    assert 0.1 < drawn(draw(View(pitch=np.radians(pitch), position=(0.0, 0.05, 0.3)))).mean() < 1.0


def test_a_hand_behind_the_camera_is_not_drawn() -> None:
    assert not drawn(draw(View(pitch=np.radians(-60), position=(0.0, 0.0, -1.0)))).any()


@pytest.mark.parametrize("distance", [0.12, 0.2, 0.55, 1.5, 5.0])
def test_a_hand_gets_smaller_with_distance(distance: float) -> None:
    near = drawn(draw(View(position=(0.0, 0.0, distance)))).sum()
    far = drawn(draw(View(position=(0.0, 0.0, distance * 1.3)))).sum()
    assert near > 1.1 * far > 0


def test_skins_and_sleeve_are_seen() -> None:
    mean = {skin: draw(look=Look(skin=skin))[drawn(draw())].mean() for skin in ("light", "medium", "dark")}
    assert mean["light"] > mean["medium"] > mean["dark"]
    sleeve, bare = draw(look=Look(sleeve=True)), draw(look=Look(sleeve=False))
    wrist, low = int(true_pixels(SKELETON, sign_pose(STOP).view.placement("Right"), CAMERA)[0, 1]), 235
    assert np.abs(sleeve[low].astype(int) - bare[low]).max() > 40
    assert np.abs(sleeve[:wrist].astype(int) - bare[:wrist]).mean() < 2


def test_light_comes_from_where_it_is_said_to() -> None:
    left, right = (draw(look=Look(light=(x, 0.0, -0.4))).astype(float) for x in (-1.0, 1.0))
    mask = drawn(draw())
    columns = np.flatnonzero(mask.any(axis=0))
    middle = (columns[0] + columns[-1]) // 2
    brighter = (left - right).mean(axis=-1)
    assert brighter[:, :middle][mask[:, :middle]].mean() > 0 > brighter[:, middle:][mask[:, middle:]].mean()


@pytest.mark.parametrize("size", [(64, 48), (48, 640), (1280, 720)])
def test_pictures_of_any_size(size: tuple[int, int]) -> None:
    background = make_background("cluttered", *size)
    image = render(SKELETON, sign_pose(STOP).view.placement("Right"), Pinhole.webcam(*size), Look(), background)
    assert (image.shape, image.dtype) == ((size[1], size[0], 3), np.dtype(np.uint8))
    assert np.any(image != background)


def test_backgrounds_differ_by_kind_and_seed() -> None:
    plain, cluttered = make_background("plain", 320, 240), make_background("cluttered", 320, 240)
    np.testing.assert_array_equal(cluttered, make_background("cluttered", 320, 240))
    assert plain.std() < cluttered.std()
    assert np.any(cluttered != make_background("cluttered", 320, 240, seed=1))
