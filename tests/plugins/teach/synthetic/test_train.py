from pathlib import Path

import numpy as np
import pytest

from handsteer.plugins.teach.network import train
from handsteer.plugins.teach.synthetic.hands import BONES_M, SHAPES, make_hands, name_shapes
from handsteer.plugins.teach.synthetic.train import made_hands, train_default
from handsteer.plugins.virtual_hand.kinematics import pose_joints
from handsteer.plugins.virtual_hand.poses import FIST, INDEX, OPEN, RELAXED, THUMB
from handsteer.recognition.features import COUNT, directions, shape_features
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, save_model


@pytest.mark.parametrize(
    ("angles", "shape"), [(OPEN, "open"), (INDEX, "index"), (THUMB, "thumb"), (FIST, "fist"), (RELAXED, "other")]
)
def test_the_virtual_hands_own_shapes_are_named(angles: np.ndarray, shape: str) -> None:
    joints = pose_joints(angles, BONES_M)
    named = name_shapes(angles[None], joints, np.zeros((1, 2)), np.ones(1))
    assert SHAPES[named[0]] == shape


def test_made_hands_have_all_shapes_and_finite_features() -> None:
    features, shapes = made_hands(1, seed=1)
    assert np.isfinite(features).all()
    assert features.shape == (len(shapes), COUNT)
    assert np.bincount(shapes, minlength=len(SHAPES)).min() > 1000
    assert not np.array_equal(features[:100], made_hands(1, seed=2)[0][:100])


def test_features_know_no_place_size_turn_or_side() -> None:
    hands = make_hands(300, np.random.default_rng(0))
    before = shape_features(hands.pixels, hands.world)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]]) @ np.diag([-1.0, 1.0])
    world = hands.world.copy()
    world[..., :2] = world[..., :2] @ turn
    after = shape_features(hands.pixels @ turn * 3.0 + (50.0, -20.0), world * 1.4)
    assert after == pytest.approx(before, abs=1e-6)


def test_directions_are_those_in_the_image() -> None:
    pixels = np.zeros((1, 21, 2))
    pixels[0, [5, 9, 13, 17]] = [(30.0, -100.0), (10.0, -100.0), (-10.0, -100.0), (-30.0, -100.0)]
    pixels[0, 8] = (30.0, -200.0)
    pixels[0, 4] = (50.0, -100.0)
    index, thumb, palm = directions(pixels)
    assert (index[0].tolist(), palm[0].tolist()) == ([0, -100], [0, -100])
    assert thumb[0] / np.linalg.norm(thumb[0]) == pytest.approx([1.0, 0.0])


def test_a_thumb_points_between_its_tip_and_the_row_of_the_knuckles() -> None:
    pixels = np.zeros((1, 21, 2))
    pixels[0, [5, 9, 13, 17]] = [(30.0, -100.0), (10.0, -100.0), (-10.0, -100.0), (-30.0, -100.0)]
    pixels[0, 4] = (50.0, -150.0)
    thumb = directions(pixels)[1][0]
    assert np.degrees(np.arctan2(-thumb[1], thumb[0])) == pytest.approx(22.5)


def test_a_network_learns_classes_that_no_line_separates() -> None:
    random = np.random.default_rng(0)
    points = random.uniform(-1, 1, (4000, 2))
    classes = (points[:, 0] * points[:, 1] > 0).astype(np.int64)
    epochs: list[int] = []
    network = train(points, classes, hidden=(16,), epochs=300, seed=1, progress=epochs.append)
    sure = network.probabilities(points)
    assert (sure.argmax(axis=1) == classes).mean() > 0.95
    assert sure.sum(axis=1) == pytest.approx(1.0)
    assert epochs == list(range(1, 301))


@pytest.mark.slow
def test_training_twice_gives_the_same_bytes_and_a_model_that_tells_shapes(tmp_path: Path) -> None:
    for name in ("one.npz", "other.npz"):
        model = train_default(lambda _: None, chunks=1, epochs=3)
        save_model(model, tmp_path / name)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "other.npz").read_bytes()
    features, shapes = made_hands(1, seed=99)
    told = model.network.probabilities(features).argmax(axis=1)
    assert (told == shapes).mean() > 0.85
    assert (model.novelty.distances(features, shapes) > model.novelty.limit).mean() < 0.01


@pytest.mark.exhaustive
@pytest.mark.slow
def test_the_shipped_model_is_what_training_gives(tmp_path: Path) -> None:
    save_model(train_default(lambda _: None), tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == DEFAULT_MODEL.read_bytes()
