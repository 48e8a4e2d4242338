from pathlib import Path

import numpy as np
import pytest

from handsteer.errors import ModelCorrupt
from handsteer.plugins.teach.synthetic.fit import fit, part_of
from handsteer.plugins.teach.synthetic.hands import FIST, SHAPES, make_hands
from handsteer.plugins.teach.synthetic.people import (
    COORDINATES,
    FILE,
    LEAST_HANDS,
    draw_people,
    from_canonical,
    load_people,
    save_people,
    to_canonical,
)
from handsteer.recognition.features import shape_features


def test_canonical_coordinates_know_no_place_size_turn_or_side() -> None:
    hands = make_hands(300, np.random.default_rng(0))
    before = to_canonical(hands.pixels, hands.world)
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]]) @ np.diag([-1.0, 1.0])
    world = hands.world.copy()
    world[..., :2] = world[..., :2] @ turn
    after = to_canonical(hands.pixels @ turn * 3.0 + (50.0, -20.0), world * 1.4 + 0.1)
    assert after == pytest.approx(before, abs=1e-6)


def test_canonical_coordinates_keep_the_shape() -> None:
    hands = make_hands(300, np.random.default_rng(0))
    features = shape_features(*from_canonical(to_canonical(hands.pixels, hands.world)))
    assert features == pytest.approx(shape_features(hands.pixels, hands.world), abs=1e-6)


def test_the_shipped_statistics_are_of_many_hands_and_hold_no_row_of_one() -> None:
    people = load_people()
    assert min(each.hands for each in people) >= LEAST_HANDS
    assert {SHAPES[each.shape] for each in people} == set(SHAPES)
    # Means and principal directions: far fewer rows than there were hands.
    assert sum(1 + len(each.directions) for each in people) < 0.5 * sum(each.hands for each in people)
    for each in people:
        assert each.directions.shape[1:] == each.mean.shape == each.rest.shape == (COORDINATES,)


def test_drawn_hands_have_all_shapes_and_are_the_same_again() -> None:
    people = load_people()
    one, again = (draw_people(2000, np.random.default_rng(3), people) for _ in range(2))
    assert all(np.array_equal(first, second) for first, second in zip(one, again, strict=True))
    image, space, shapes = one
    assert image.shape == (len(shapes), 21, 2)
    assert space.shape == (len(shapes), 21, 3)
    assert np.isfinite(shape_features(image, space)).all()
    assert np.bincount(shapes, minlength=len(SHAPES)).min() > 50


def test_what_is_fitted_draws_hands_like_those_it_was_fitted_to() -> None:
    random = np.random.default_rng(0)
    spread = np.zeros(COORDINATES)
    spread[:5] = 0.3
    hands = 1.0 + random.normal(0, 1, (400, 1)) * spread + random.normal(0, 0.01, (400, COORDINATES))
    fitted = fit(FIST, hands)
    assert sum(each.hands for each in fitted) == 400
    drawn = np.concatenate([each.draw(5 * each.hands, random) for each in fitted])
    assert drawn.mean(axis=0) == pytest.approx(hands.mean(axis=0), abs=0.05)
    assert drawn[:, 0].std() == pytest.approx(0.3, rel=0.3)
    assert drawn[:, 50].std() < 0.03
    assert np.corrcoef(drawn[:, 0], drawn[:, 4])[0, 1] > 0.95


def test_too_few_hands_of_a_kind_give_no_statistics() -> None:
    assert fit("ok", np.random.default_rng(0).normal(size=(LEAST_HANDS - 1, COORDINATES))) == []


def test_statistics_are_written_and_read_again(tmp_path: Path) -> None:
    people = load_people()
    save_people(people, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == FILE.read_bytes()
    (tmp_path / "damaged.npz").write_bytes(FILE.read_bytes()[:-400])
    with pytest.raises(ModelCorrupt, match="hand statistics"):
        load_people(tmp_path / "damaged.npz")


def test_a_photo_is_in_one_part_wherever_it_is_kept() -> None:
    names = [f"{number}.jpg" for number in range(3000)]
    parts = [part_of(name) for name in names]
    assert parts == [part_of(Path("/elsewhere") / name) for name in names]
    assert 0.28 < parts.count("report") / len(parts) < 0.38
    assert {part_of(name, "emre") for name in names} == {"tune"}
    assert {part_of(name, "sld") for name in names} == {"report"}
    assert {part_of(name, person) for name in names for person in ("arjav", "sara")} == {"choose"}
