import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer.config import SignsConfig
from handsteer.errors import ProfileError
from handsteer.plugins.teach.synthetic.hands import make_hands
from handsteer.recognition.features import COUNT, shape_features
from handsteer.recognition.hand import Hand
from handsteer.recognition.npz import NpzFormat
from handsteer.recognition.profile import (
    FLOOR,
    MOST_VIEWS,
    REACH,
    Profile,
    ProfiledClassifier,
    distances,
    load_profile,
    profile_name,
    profile_names,
    profile_path,
    profiles_dir,
    save_profile,
    shape_probability,
    whitened,
)
from handsteer.recognition.recognizer import open_classifier
from handsteer.recognition.shipped_signs import SURE, ShippedClassifier, load_model
from handsteer.types import FORWARD, NONE, SIGNS, STOP
from tests.recognition.hands import hand_of, show_fingers, show_sign
from tests.recognition.odd_person import errors, odd_hands

SHIPPED = ShippedClassifier(load_model())


def features(hands: list[Hand]) -> np.ndarray:
    return shape_features(np.array([hand.pixels[:, :2] for hand in hands]), np.array([hand.world for hand in hands]))


def widest(**changes: Any) -> Profile:
    """A profile with the largest reach that a file may have."""
    shown = odd_hands(5, seed=0)
    views = {sign: features(hands).astype(np.float32).astype(float) for sign, hands in shown.items()}
    return replace(Profile("odd", views, dict.fromkeys(SIGNS, REACH[1]), {"handsteer": "1"}), **changes)


OWN = ProfiledClassifier(SHIPPED, widest())
VIEWS = widest().views[FORWARD]


def any_hands(count: int) -> list[Hand]:
    """Hands of every shape in every direction, and of the person of the profile, some hardly legible."""
    made = make_hands(count, np.random.default_rng(5))
    sizes = np.ptp(made.pixels, axis=1).max(axis=1)[:, None, None]
    pixels = (made.pixels - made.pixels.mean(axis=1, keepdims=True)) * 150 / sizes + (320, 240)
    some = [hand_of(each, world) for each, world in zip(pixels, made.world, strict=True)]
    mine = [hand for hands in odd_hands(20, seed=3).values() for hand in hands]
    return [*some, *mine, *(replace(hand, presence=0.7) for hand in mine[::3])]


def test_a_person_who_shows_signs_differently_is_read_with_half_the_errors() -> None:
    judged = odd_hands(20, seed=1)
    before = sum(errors(SHIPPED, hands, sign) for sign, hands in judged.items())
    after = sum(errors(OWN, hands, sign) for sign, hands in judged.items())
    assert before > 20
    assert after <= before / 2


def test_nothing_moves_the_robot_but_what_did_before_or_is_near_the_persons_views() -> None:
    profile = widest()
    own = {sign: whitened(SHIPPED, views) for sign, views in profile.views.items()}
    added = 0
    for hand in any_hands(3_000):
        known, guess = SHIPPED.classify(hand), OWN.classify(hand)
        if guess.sign in (NONE, STOP) or (guess.sign == known.sign and guess.confidence <= known.confidence):
            continue
        added += 1
        row = features([hand])
        assert distances(whitened(SHIPPED, row), own[guess.sign])[0] < REACH[1]
        assert shape_probability(SHIPPED.model.probabilities(row[0]), guess.sign) >= FLOOR
    assert added > 0


def test_likelihoods_never_grow_without_a_view_either() -> None:
    # The recognizer bridges a lost frame by the mean likelihood of a sign, not by the sign of each frame.
    only_forward = ProfiledClassifier(SHIPPED, widest(views={FORWARD: VIEWS}, reach={FORWARD: REACH[0]}))
    for hand in any_hands(2_000):
        known, guess = SHIPPED.classify(hand), only_forward.classify(hand)
        others = set(SIGNS) - {STOP, FORWARD}
        assert all(guess.likelihoods[sign] <= known.likelihoods[sign] + 1e-12 for sign in others)


def always(**chances: float) -> ShippedClassifier:
    """A classifier whose network gives every hand these probabilities of the shapes, and the others hardly any."""
    model = SHIPPED.model
    biases = np.log([chances.get(shape, 1e-6) for shape in model.shapes])
    zeros = np.zeros((COUNT, len(model.shapes)))
    return ShippedClassifier(replace(model, network=replace(model.network, weights=(zeros,), biases=(biases,))))


@pytest.mark.parametrize(("chance", "sign"), [(FLOOR * 1.1, FORWARD), (FLOOR * 0.9, NONE)])
def test_a_hand_of_another_shape_does_not_move_the_robot_even_if_it_equals_a_view(chance: float, sign: str) -> None:
    hand = show_sign(FORWARD)
    shipped = always(open=0.001, index=chance, thumb=0.001, fist=0.001, other=0.997 - chance)
    own = ProfiledClassifier(shipped, widest(views={FORWARD: features([hand])}, reach={FORWARD: REACH[1]}))
    assert shipped.classify(hand).sign == NONE
    assert own.classify(hand).sign == sign


def test_a_sign_that_loses_gives_way_to_none_but_to_no_other_sign() -> None:
    # A shape between two: the index finger points up, and the thumb sideways.
    hand = show_fingers("index", thumb={"spread": 56.0, "opposition": 12.0})
    shipped = always(open=0.001, index=0.52, thumb=0.46, fist=0.001, other=0.018)
    stranger = ProfiledClassifier(shipped, widest(views={FORWARD: -VIEWS}, reach={FORWARD: REACH[0]}))
    assert shipped.classify(hand).sign == FORWARD
    assert stranger.classify(hand).sign == NONE


def test_hands_of_others_move_the_robot_less() -> None:
    hands = any_hands(3_000)[:2_000]
    moved = [
        sum(guess.sign not in (NONE, STOP) and guess.confidence >= SURE for guess in map(classifier.classify, hands))
        for classifier in (SHIPPED, OWN)
    ]
    assert moved[1] < moved[0]


def test_a_stop_is_read_as_before() -> None:
    # The person's Forward looks like everybody's Stop: it still stops.
    stops = [show_sign(STOP, away_m=away_m) for away_m in (0.5, 1.0, 2.5)]
    fooled = ProfiledClassifier(SHIPPED, widest(views={FORWARD: features(stops)}, reach={FORWARD: REACH[1]}))
    for hand in [*stops, *any_hands(1_500)]:
        known = SHIPPED.classify(hand)
        if known.sign == STOP:
            assert fooled.classify(hand) == known
        assert OWN.classify(hand).likelihoods[STOP] >= known.likelihoods[STOP]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_landmarks_that_are_not_finite_are_none(value: float) -> None:
    hand = show_sign(FORWARD)
    nothing = np.full_like(hand.points, value)
    for broken in (replace(hand, points=nothing), replace(hand, world=nothing)):
        assert OWN.classify(broken).sign == NONE
        assert OWN.classify(broken).confidence == 0.0


def test_a_profile_is_saved_and_loaded(tmp_path: Path) -> None:
    path = tmp_path / "odd.npz"
    save_profile(widest(), path)
    loaded = load_profile(path)
    assert (loaded.name, dict(loaded.reach), dict(loaded.made)) == (
        "odd",
        dict.fromkeys(SIGNS, REACH[1]),
        {"handsteer": "1"},
    )
    assert all((loaded.views[sign] == views).all() for sign, views in widest().views.items())
    hand = odd_hands(1, seed=9)[STOP][0]
    assert open_classifier(SignsConfig(profile=path)).classify(hand) == OWN.classify(hand)


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        (widest(reach=dict.fromkeys(SIGNS, 0.6)), "a reach is not from 0.3 to 0.55"),
        (widest(reach=dict.fromkeys(SIGNS, float("nan"))), "a reach is not from 0.3 to 0.55"),
        (widest(views={FORWARD: VIEWS * np.nan}, reach={FORWARD: 0.5}), "some of its numbers are beyond 5, or none"),
        (widest(views={FORWARD: VIEWS + 10}, reach={FORWARD: 0.5}), "some of its numbers are beyond 5, or none"),
        (widest(views={FORWARD: np.zeros((0, COUNT))}, reach={FORWARD: 0.5}), "a sign has no view, or more than 16"),
        (
            widest(views={FORWARD: np.zeros((MOST_VIEWS + 1, COUNT))}, reach={FORWARD: 0.5}),
            "a sign has no view, or more than 16",
        ),
        (widest(views={"Fly": VIEWS}, reach={"Fly": 0.5}), "its signs are not those of handsteer"),
        (widest(views={FORWARD: VIEWS[:, 1:]}, reach={FORWARD: 0.5}), "its parts do not fit together"),
        (widest(name="../me"), "is not a valid name for a profile"),
    ],
)
def test_a_file_that_could_let_others_drive_is_refused(tmp_path: Path, profile: Profile, message: str) -> None:
    path = tmp_path / "other.npz"
    if VIEWS.shape[1] != next(iter(profile.views.values())).shape[1]:
        whole = tmp_path / "whole.npz"
        save_profile(widest(views={FORWARD: VIEWS}, reach={FORWARD: 0.5}), whole)
        arrays = dict(np.load(whole)) | {"views": profile.views[FORWARD].astype(np.float32)}
        np.savez(path, **arrays)
    else:
        save_profile(profile, path)
    with pytest.raises(ProfileError, match=message):
        load_profile(path)


def test_other_files_are_refused_with_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "profile.npz"
    with pytest.raises(ProfileError, match="cannot read the profile of the signs"):
        load_profile(path)
    path.write_bytes(pickle.dumps("run me"))
    with pytest.raises(
        ProfileError, match="not a profile of the signs, or damaged; give one that `handsteer signs cal"
    ):
        load_profile(path)
    NpzFormat("x", 2, ProfileError, ProfileError, "").write(path, {"name": np.array("odd")})
    with pytest.raises(ProfileError, match="of format 2 is not known, expected 1"):
        load_profile(path)
    np.savez(path, format=np.array(1), name=np.array("odd"), views=np.zeros(300_000))
    with pytest.raises(ProfileError, match="larger than 1 MB"):
        load_profile(path)
    with pytest.raises(ProfileError, match="cannot write the profile"):
        save_profile(widest(), tmp_path / "nowhere" / "odd.npz")


def test_profiles_are_chosen_by_name_or_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert profile_names() == []
    assert profile_path(Path("anna")) == profiles_dir() / "anna.npz" == tmp_path / "handsteer/profiles/anna.npz"
    assert profile_path(Path("anna.npz")) == Path("anna.npz")
    assert profile_path(Path("of/anna")) == Path("of/anna")
    for name in ("Karl Ö.", "anna"):
        save_profile(widest(name=name), profile_path(Path(name)))
    assert profile_names() == ["Karl Ö.", "anna"]
    assert load_profile(profile_path(Path("anna"))).name == "anna"


@pytest.mark.parametrize("name", ["", " ", "../anna", "a/b", ".anna", "anna\n\x1b", "anna.npz", "a" * 41])
def test_names_of_profiles(name: str) -> None:
    with pytest.raises(ProfileError, match="is not a valid name for a profile"):
        profile_name(name)
    assert profile_name("  Anna  Öz-2 ") == "Anna Öz-2"
