from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import DatasetError
from handsteer.plugins.teach.dataset import Dataset, Take, add_takes, load_dataset, save_dataset, summarise
from handsteer.recognition.custom_signs import label_for
from tests.plugins.teach.takes import take

SOME = Dataset((take("Hi", "Peace", hands=3), take("NONE", "Go", hands=2, person="Ann"), take("Hi", "Peace", hands=4)))


def same(one: Take, other: Take) -> bool:
    facts = ("label", "person", "session", "source")
    return (
        all(getattr(one, fact) == getattr(other, fact) for fact in facts)
        and np.allclose(one.times_s, other.times_s)
        and np.array_equal(one.pixels, other.pixels)
        and np.array_equal(one.world, other.world, equal_nan=True)
        and [hand.handedness for hand in one.hands] == [hand.handedness for hand in other.hands]
    )


def test_takes_are_added_to_what_the_file_has_by_now_and_a_link_stays_one(tmp_path: Path) -> None:
    """Two programs may collect at once; they began with the same file, or with none."""
    path = tmp_path / "some.npz"
    for each in SOME.takes:
        added = add_takes([each], path)
    assert [take.label for take in added.takes] == ["Hi", "NONE", "Hi"]
    (tmp_path / "link.npz").symlink_to(path)
    add_takes(SOME.takes[:1], tmp_path / "link.npz")
    assert (tmp_path / "link.npz").is_symlink()
    assert [take.label for take in load_dataset(path).takes] == ["Hi", "NONE", "Hi", "Hi"]


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    save_dataset(SOME, tmp_path / "some.npz")
    loaded = load_dataset(tmp_path / "some.npz")
    assert len(loaded.takes) == 3
    assert all(same(*pair) for pair in zip(loaded.takes, SOME.takes, strict=True))
    assert list(tmp_path.iterdir()) == [tmp_path / "some.npz"]


def test_an_empty_dataset_is_one_too(tmp_path: Path) -> None:
    save_dataset(Dataset(), tmp_path / "empty.npz")
    assert load_dataset(tmp_path / "empty.npz") == Dataset()


def test_takes_are_added_and_undone_and_counted() -> None:
    assert SOME.labels == ("Hi", "NONE")
    assert [each.label for each in SOME.without_last().takes] == ["Hi", "NONE"]
    assert [asdict(each) for each in summarise(SOME)] == [
        {"label": "Hi", "takes": 2, "rows": 7, "persons": 1, "sessions": 1},
        {"label": "NONE", "takes": 1, "rows": 2, "persons": 1, "sessions": 1},
    ]
    assert Dataset().with_takes(SOME.takes) == SOME
    with pytest.raises(DatasetError, match="no take to undo"):
        Dataset().without_last()


@pytest.mark.parametrize(
    ("name", "label"),
    [("Hi", "Hi"), ("  thumbs  up ", "thumbs up"), ("turn_left", "Turn Left"), ("none", "NONE"), ("hELLO", "Hello")],
)
def test_a_name_means_a_sign_that_is_known(name: str, label: str) -> None:
    assert label_for(name, ["Hello"]) == label


def test_a_name_has_one_unicode_form_and_is_that_of_a_known_sign_in_any() -> None:
    assert label_for("Cafe\u0301") == "Caf\u00e9"
    assert label_for("Caf\u00e9", ["Cafe\u0301"]) == "Cafe\u0301"
    assert label_for("e\u0301" * 40) == "\u00e9" * 40
    assert label_for("\uff33\uff54\uff4f\uff50") == "Stop"


def test_labels_that_were_stored_in_other_unicode_forms_are_loaded(tmp_path: Path) -> None:
    """Earlier versions took them for signs of their own."""
    old = ("Cafe\u0301", "\uff33\uff54\uff4f\uff50")
    save_dataset(Dataset(tuple(take(label, "Peace", hands=2) for label in old), frozenset(old)), tmp_path / "old.npz")
    assert load_dataset(tmp_path / "old.npz").labels == old
    assert load_dataset(tmp_path / "old.npz").disabled == set(old)


@pytest.mark.parametrize("label", ["turn left", "STOP", "a  b", " a", "a\u00a0b"])
def test_labels_that_no_version_has_stored_are_refused(tmp_path: Path, label: str) -> None:
    save_dataset(Dataset((take(label, "Peace", hands=2),)), tmp_path / "odd.npz")
    with pytest.raises(DatasetError, match="take 0 has the label"):
        load_dataset(tmp_path / "odd.npz")


@pytest.mark.parametrize("name", ["", "  ", "x" * 41, "a\x07b"])
def test_a_name_that_cannot_be_printed_is_refused(name: str) -> None:
    with pytest.raises(DatasetError, match="not a valid name for a sign"):
        label_for(name)


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    with pytest.raises(DatasetError, match=r"cannot read the dataset of signs .*bad\.npz \(No such file"):
        load_dataset(path)
    path.write_bytes(b"hello")
    with pytest.raises(DatasetError, match=r"bad\.npz: not a dataset of signs"):
        load_dataset(path)
    np.savez(path, format=np.array(2))
    with pytest.raises(DatasetError, match="a dataset of signs of format 2 is not known, expected 1"):
        load_dataset(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"takes": np.array("[")},
        {"takes": np.array("[]")},
        {"takes": np.array('[{"label": "Hi"}]')},
        {"take": np.zeros(3, int)},
        {"take": np.full(9, 7)},
        {"points": np.zeros((9, 20, 3))},
        {"points": np.full((9, 21, 3), np.nan)},
        {"image_size": np.zeros((9, 2), int)},
        {"handedness": np.full(9, "Both")},
        {"presence": np.full(9, "much")},
    ],
    ids=lambda changes: str(next(iter(changes))),
)
def test_a_damaged_file_is_refused(tmp_path: Path, changes: dict[str, np.ndarray]) -> None:
    save_dataset(SOME, tmp_path / "some.npz")
    with np.load(tmp_path / "some.npz") as file:
        content = {name: file[name] for name in file.files}
    np.savez(tmp_path / "odd.npz", **(content | changes))
    with pytest.raises(DatasetError, match=r"odd\.npz: a damaged dataset"):
        load_dataset(tmp_path / "odd.npz")


@given(place=st.integers(0, 10**6), flip=st.integers(1, 255))
def test_a_flipped_byte_is_refused_or_makes_no_difference_to_loading(
    tmp_path_factory: pytest.TempPathFactory, place: int, flip: int
) -> None:
    path = tmp_path_factory.mktemp("datasets") / "flipped.npz"
    save_dataset(SOME, path)
    damaged = bytearray(path.read_bytes())
    damaged[place % len(damaged)] ^= flip
    path.write_bytes(bytes(damaged))
    try:
        loaded = load_dataset(path)
    except DatasetError:
        return
    assert len(loaded.takes) == 3


def test_where_nothing_can_be_written_the_older_file_stays(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="cannot write the dataset"):
        save_dataset(SOME, tmp_path / "gone" / "some.npz")
