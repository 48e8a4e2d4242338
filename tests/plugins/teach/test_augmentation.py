import numpy as np
import pytest

from handsteer.plugins.teach.augmentation import mirrored, points_sideways, vary
from handsteer.recognition.custom_signs import FEATURE_COUNTS, Depth, custom_features
from tests.plugins.teach.takes import take
from tests.recognition.hands import show_sign

TAKE = take("Peace", hands=5)


def varied(*, both_hands: bool, flat: bool = False) -> tuple[np.ndarray, np.ndarray]:
    world = np.full_like(TAKE.world, np.nan) if flat else TAKE.world
    return vary(TAKE.pixels, world, 400, np.random.default_rng(1), both_hands=both_hands)


def palm_side(points: np.ndarray) -> np.ndarray:
    """Return the sign of the turn from the wrist's way to the index finger to that to the little finger."""
    one, other = points[:, 5, :2] - points[:, 0, :2], points[:, 17, :2] - points[:, 0, :2]
    turn: np.ndarray = np.sign(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    return turn


@pytest.mark.parametrize("flat", [False, True])
def test_half_are_the_other_hand_if_both_show_the_sign(flat: bool) -> None:
    one, _ = varied(both_hands=False, flat=flat)
    both, _ = varied(both_hands=True, flat=flat)
    own = palm_side(TAKE.pixels)[0]
    assert (palm_side(one) == own).mean() > 0.95
    assert 0.4 < (palm_side(both) == own).mean() < 0.6


def test_hands_are_tilted_by_up_to_30_degrees_and_seen_otherwise() -> None:
    pixels, world = varied(both_hands=False)
    palm = pixels[:, 9] - pixels[:, 0]
    tilt = np.degrees(np.arctan2(palm[:, 0], -palm[:, 1]))
    assert np.abs(tilt - np.median(tilt)).max() < 55
    assert np.percentile(tilt, 90) - np.percentile(tilt, 10) > 35
    assert np.isfinite(world).all()
    lengths = np.linalg.norm(world[:, 8] - world[:, 5], axis=1)
    assert 0.02 < lengths.std() / lengths.mean() < 0.2


def test_without_depth_the_image_is_varied() -> None:
    pixels, world = varied(both_hands=False, flat=True)
    assert np.isnan(world).all()
    assert np.isfinite(pixels).all()
    assert len(np.unique(pixels[:, 8], axis=0)) == 400


def test_mirrored_twice_is_as_before() -> None:
    np.testing.assert_array_equal(mirrored(mirrored(TAKE.world)), TAKE.world)
    assert (palm_side(mirrored(TAKE.pixels)) == -palm_side(TAKE.pixels)).all()


@pytest.mark.parametrize(
    ("sign", "tilt", "sideways"),
    [
        ("Forward", 0.0, False),
        ("Forward", np.pi / 2, True),
        ("Forward", -np.pi / 2, True),
        ("Turn Left", 0.0, False),
        ("Turn Left", np.pi / 2, False),
        ("Call", 0.0, False),
        ("Call", np.pi / 2, True),
        ("Stop", 0.0, False),
    ],
)
def test_a_hand_that_points_to_a_side_is_not_its_mirror_image(sign: str, tilt: float, sideways: bool) -> None:
    pixels = show_sign(sign, tilt=tilt).pixels[None, :, :2].astype(float)
    assert points_sideways(pixels) == sideways
    assert points_sideways(mirrored(pixels)) == sideways


@pytest.mark.parametrize("depth", ["full", "flat"])
def test_features_are_those_of_the_hand_wherever_it_is(depth: Depth) -> None:
    plain = custom_features(TAKE.pixels, TAKE.world, depth)
    assert plain.shape == (5, FEATURE_COUNTS[depth])
    moved = custom_features(TAKE.pixels * 0.3 + 50, TAKE.world, depth)
    np.testing.assert_allclose(moved, plain, atol=1e-6)
    turned = custom_features(TAKE.pixels[..., ::-1] * (-1, 1), TAKE.world[..., [1, 0, 2]] * (-1, 1, 1), depth)
    np.testing.assert_allclose(turned[:, :-6], plain[:, :-6], atol=1e-6)
    assert np.abs(turned[:, -6:] - plain[:, -6:]).max() > 0.5
