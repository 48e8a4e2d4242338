from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from handsteer.errors import ModelCorrupt, ModelError, ModelMissing
from handsteer.recognition.custom_signs import CustomClassifier, load_custom_model, save_custom_model
from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, ShippedClassifier, legibility, load_model
from handsteer.types import NONE, SIGNS
from tests.recognition.hands import show_sign
from tests.recognition.models import COUNT, model


class Says:
    """A classifier that always says the same."""

    signs = SIGNS

    def __init__(self, sign: str, confidence: float) -> None:
        self._guess = SignGuess(sign, confidence)

    def classify(self, hand: Hand) -> SignGuess:
        return self._guess

    def confidence(self, sign: str, likelihood: float) -> float:
        return likelihood


HAND = show_sign("Stop")


@pytest.mark.parametrize(
    ("sign", "confidence", "expected"),
    [
        (NONE, 0.9, "Hi"),
        ("Forward", 0.95, "Forward"),
        ("Forward", 0.8, "Forward"),
        ("Forward", 0.6, "Hi"),
    ],
)
def test_what_the_shipped_signs_are_sure_of_stays(sign: str, confidence: float, expected: str) -> None:
    assert CustomClassifier(Says(sign, confidence), model(hi=0.9)).classify(HAND).sign == expected


def test_the_surer_one_counts_when_neither_is_sure() -> None:
    classifier = CustomClassifier(Says("Forward", 0.7), model(hi=0.6))
    assert classifier.classify(HAND) == SignGuess("Forward", 0.7)


def test_the_threshold_is_where_a_sign_is_sure() -> None:
    at = CustomClassifier(Says(NONE, 1.0), model(hi=0.95, threshold=0.95)).classify(HAND)
    assert at.confidence == pytest.approx(0.8 * legibility(HAND), abs=0.001)


def test_a_shape_that_is_far_from_what_was_taught_is_none_of_it() -> None:
    assert CustomClassifier(Says(NONE, 1.0), model(limit=0.1)).classify(HAND) == SignGuess(NONE, 1.0)


def test_landmarks_that_are_no_numbers_are_no_sign() -> None:
    world = np.full((21, 3), np.nan, np.float32)
    broken = Hand(HAND.points, world, "Right", 0.9, 0.9, HAND.image_size)
    classifier = CustomClassifier(ShippedClassifier(load_model()), model())
    assert classifier.classify(broken).sign == NONE
    assert classifier.classify(broken).confidence == 0.0


def test_a_hand_of_few_pixels_is_no_sign() -> None:
    far = Hand(HAND.points / np.float32(30), HAND.world, "Right", 0.9, 0.9, HAND.image_size)
    assert CustomClassifier(Says(NONE, 1.0), model()).classify(far).sign == NONE


def test_it_knows_all_signs() -> None:
    assert CustomClassifier(Says(NONE, 1.0), model()).signs == (*SIGNS, "Hi", "Ho")


def test_what_is_saved_is_loaded_and_gives_the_same_bytes(tmp_path: Path) -> None:
    save_custom_model(model(), tmp_path / "one.npz")
    loaded = load_custom_model(tmp_path / "one.npz")
    save_custom_model(loaded, tmp_path / "two.npz")
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    assert loaded.labels == ("Hi", "Ho")
    assert loaded.trained_on == {"persons": 1}
    with pytest.raises(ModelError, match="cannot write the model of taught signs"):
        save_custom_model(loaded, tmp_path / "gone" / "one.npz")


def changed(path: Path, **arrays: np.ndarray | None) -> Path:
    """Write a model with some arrays replaced, or left out where None."""
    save_custom_model(model(), path)
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    content |= {name: array for name, array in arrays.items() if array is not None}
    np.savez(path, **{name: array for name, array in content.items() if arrays.get(name, array) is not None})
    return path


@pytest.mark.parametrize(
    "arrays",
    [
        {"taught": None},
        {"taught": np.array(["Hi", "Hi"])},
        {"taught": np.array(["Hi", "Stop"])},
        {"taught": np.array(["Hi", "turn left"])},
        {"taught": np.array(["Hi"])},
        {"depth": np.array("deep")},
        {"depth": np.array("flat")},
        {"thresholds": np.array([0.5, 1.0])},
        {"thresholds": np.array([0.5])},
        {"weights_0": None},
        {"mean": np.zeros(3, np.float32)},
        {"limit": np.array(np.nan)},
        {"whitening": np.full((COUNT, COUNT), np.inf, np.float32)},
        {"trained_on": np.array("[")},
    ],
    ids=lambda arrays: str(next(iter(arrays))),
)
def test_a_damaged_file_is_refused(tmp_path: Path, arrays: dict[str, np.ndarray | None]) -> None:
    with pytest.raises(ModelCorrupt, match=r"odd\.npz: a damaged model of taught signs"):
        load_custom_model(changed(tmp_path / "odd.npz", **arrays))


def test_labels_that_were_stored_in_other_unicode_forms_are_loaded(tmp_path: Path) -> None:
    """Earlier versions took them for signs of their own."""
    old = ("Caf\u00e9", "Cafe\u0301")
    assert load_custom_model(changed(tmp_path / "old.npz", taught=np.array(old))).labels == old


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelMissing, match=r"gone\.npz"):
        load_custom_model(tmp_path / "gone.npz")
    with pytest.raises(ModelCorrupt, match="a model of taught signs of format 9 is not known, expected 1"):
        load_custom_model(changed(tmp_path / "new.npz", format=np.array(9)))
    with pytest.raises(ModelCorrupt, match="a damaged model of taught signs"):
        load_custom_model(DEFAULT_MODEL)


@given(place=st.integers(0, 10**6), flip=st.integers(1, 255))
@example(place=3711, flip=1)
def test_a_flipped_byte_is_refused_or_makes_no_difference_to_loading(
    tmp_path_factory: pytest.TempPathFactory, place: int, flip: int
) -> None:
    path = tmp_path_factory.mktemp("models") / "flipped.npz"
    save_custom_model(model(), path)
    damaged = bytearray(path.read_bytes())
    damaged[place % len(damaged)] ^= flip
    path.write_bytes(bytes(damaged))
    try:
        loaded = load_custom_model(path)
    except (ModelCorrupt, ModelMissing):
        return
    assert len(loaded.labels) == 2


def test_the_likelihoods_are_of_all_signs() -> None:
    shipped = ShippedClassifier(load_model())
    told = CustomClassifier(shipped, model(hi=0.9)).classify(HAND)
    assert set(told.likelihoods) == {*SIGNS, "Hi", "Ho"}
    assert max(told.likelihoods, key=told.likelihoods.__getitem__) == told.sign == "Stop"
    unsure = CustomClassifier(Says(NONE, 1.0), model(hi=0.9)).classify(HAND)
    assert (unsure.sign, unsure.confidence) == ("Hi", unsure.likelihoods["Hi"])
