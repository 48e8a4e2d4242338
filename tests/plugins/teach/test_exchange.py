"""Shared files from anyone, tables, and keypoints of other projects."""

import csv
import gzip
import io
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handsteer.errors import DatasetError
from handsteer.plugins.teach.dataset import Dataset, load_dataset, save_dataset
from handsteer.plugins.teach.exchange import (
    LARGEST_SHARED_BYTES,
    load_shared,
    read_class_names,
    read_keypoints,
    save_shared,
    takes_as_csv,
)
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from tests.plugins.teach.takes import take
from tests.recognition.hands import show_sign
from tests.recognition.models import model

TAKES = Dataset((take("Hi", "Peace", hands=3), take("Ho", "Call", hands=2)), frozenset({"Ho"}))


def test_a_file_is_both_a_dataset_and_a_model(tmp_path: Path) -> None:
    path = tmp_path / "shared.npz"
    save_shared(path, TAKES, model())
    dataset, learnt = load_shared(path)
    for read in (dataset, load_dataset(path)):
        assert [(each.label, len(each.hands)) for each in read.takes] == [("Hi", 3), ("Ho", 2)]
        assert read.disabled == {"Ho"}
    assert learnt is not None
    assert learnt.labels == load_custom_model(path).labels == ("Hi", "Ho")


def test_either_alone_is_read_too(tmp_path: Path) -> None:
    save_dataset(TAKES, tmp_path / "signs.npz")
    save_custom_model(model(), tmp_path / "mine.npz")
    assert load_shared(tmp_path / "signs.npz")[1] is None
    assert load_shared(tmp_path / "mine.npz")[0].takes == ()


@pytest.mark.parametrize("name", ["takes", "points", "disabled", "taught", "weights_0", "thresholds"])
def test_damaged_arrays_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    path = tmp_path / "shared.npz"
    save_shared(path, TAKES, model())
    with np.load(path) as arrays:
        content = dict(arrays)
    np.savez(path, **{**content, name: np.array(["\x00 bad\n"])})
    with pytest.raises(DatasetError, match="a damaged file of taught signs") as problem:
        load_shared(path)
    assert len(str(problem.value)) < 600


def test_files_that_are_too_large_empty_or_something_else_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "shared.npz"
    np.savez_compressed(path, format=np.array(1), takes=np.zeros(LARGEST_SHARED_BYTES, np.uint8))
    assert path.stat().st_size < 100_000
    with pytest.raises(DatasetError, match="should have at most 24"):
        load_shared(path)
    np.savez(path, format=np.array(1))
    with pytest.raises(DatasetError, match="neither a take nor a model"):
        load_shared(path)
    np.savez(path, format=np.array(1), takes=np.array([{}], object))
    with pytest.raises(DatasetError, match="neither of numbers nor of text"):
        load_shared(path)


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_spoilt_bytes_never_raise_anything_else(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.mktemp("shared") / "shared.npz"
    save_shared(path, TAKES, model())
    content = bytearray(path.read_bytes())
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=20)):
        content[place] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    with suppress(DatasetError):
        load_shared(path)


def test_the_takes_are_a_table_without_formulas() -> None:
    risky = replace(TAKES.takes[0], label='=HYPERLINK("x")', person="a,b")
    rows = list(csv.DictReader(io.StringIO("".join(takes_as_csv(Dataset((risky, TAKES.takes[1])))))))
    assert [(row["label"], row["person"], row["take"]) for row in rows[2:4]] == [
        ('\'=HYPERLINK("x")', "a,b", "0"),
        ("Ho", "me", "1"),
    ]
    hand = TAKES.takes[0].hands[1]
    assert float(rows[1]["x20"]) == pytest.approx(hand.points[20, 0], abs=1e-5)
    assert (rows[1]["handedness"], rows[1]["width"], len(rows[1])) == ("Right", "640", 8 + 63)


def row(number: int, sign: str = "Forward") -> str:
    """Return a line as projects write it: mirrored, from the wrist, divided by the largest number."""
    pixels = show_sign(sign).pixels[:, :2] * (-1, 1)
    points = pixels - pixels[0]
    return ",".join([str(number), *(f"{value:.4f}" for value in (points / np.abs(points).max()).ravel())])


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_rows_are_takes_of_hands_as_the_camera_saw_them(tmp_path: Path) -> None:
    path = written(tmp_path / "key.csv", *[row(1)] * 130, *[row(2, "Stop")] * 3, row(1))
    found = read_keypoints(path, {"1": "Point"}, "Ann")
    assert [(take.label, len(take.hands)) for take in found] == [("Point", 100), ("Point", 30), ("Point", 1)]
    assert {(take.person, take.session, take.source) for take in found} == {("Ann", "key", "key.csv")}
    assert all(take.is_flat for take in found)
    true = show_sign("Forward").pixels[:, :2]
    shape = found[0].pixels[0] - found[0].pixels[0, 0]
    np.testing.assert_allclose(shape / np.abs(shape).max(), (true - true[0]) / np.abs(true - true[0]).max(), atol=1e-3)


def test_rows_of_images_that_were_not_mirrored_can_be_told_so(tmp_path: Path) -> None:
    path = written(tmp_path / "key.csv", row(1))
    as_seen = read_keypoints(path, {"1": "Point"}, "Ann", mirrored=False)[0].pixels
    np.testing.assert_allclose(as_seen[..., 0], -read_keypoints(path, {"1": "Point"}, "Ann")[0].pixels[..., 0])


def test_packed_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "key.csv.gz").write_bytes(gzip.compress(row(0).encode()))
    assert len(read_keypoints(tmp_path / "key.csv.gz", {"0": "Hi"}, "Ann")) == 1


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz"])
def test_a_byte_order_mark_does_not_hide_the_first_row(tmp_path: Path, suffix: str) -> None:
    """Spreadsheets write one as the begin of a CSV file in UTF-8."""
    path = tmp_path / f"key{suffix}"
    content = f"{row(0)}\n{row(1)}\n".encode("utf-8-sig")
    path.write_bytes(gzip.compress(content) if suffix == ".csv.gz" else content)
    assert [take.label for take in read_keypoints(path, {"0": "Hi", "1": "Ho"}, "Ann")] == ["Hi", "Ho"]


def test_each_class_can_be_required_to_have_a_row(tmp_path: Path) -> None:
    path, labels = written(tmp_path / "key.csv", row(1)), {"0": "Hi", "1": "Ho", "7": "Ho"}
    assert [take.label for take in read_keypoints(path, labels, "Ann")] == ["Ho"]
    with pytest.raises(DatasetError, match=r"key\.csv: there is no row of class 0, 7$"):
        read_keypoints(path, labels, "Ann", needs_all=True)


def test_the_rows_that_others_share_are_read(data_dir: Path) -> None:
    found = read_keypoints(data_dir / "keypoints" / "kinivi.csv.gz", {"3": "OK"}, "kinivi")
    assert sum(len(take.hands) for take in found) == 337


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,0.5", "line 2: expected a class and 42 numbers, found 2 fields"),
        (row(1).replace("0.0", "x", 1), "line 2: expected a class and 42 numbers, could not convert"),
        (row(1).replace(",0.0000", ",nan", 1), "line 2: these are not the landmarks of a hand"),
        ("1" + ",7" * 42, "line 2: these are not the landmarks of a hand"),
        ("1" + ",0" * 42, "line 2: these are not the landmarks of a hand"),
    ],
)
def test_a_wrong_row_is_named(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(DatasetError, match=message):
        read_keypoints(written(tmp_path / "key.csv", row(1), line), {"1": "Hi"}, "Ann")


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="cannot read the keypoints"):
        read_keypoints(tmp_path / "gone.csv", {"1": "Hi"}, "Ann")
    (tmp_path / "bad.csv.gz").write_bytes(gzip.compress(b"1,2" * 1000)[:-9])
    with pytest.raises(DatasetError, match="cannot read the keypoints"):
        read_keypoints(tmp_path / "bad.csv.gz", {"1": "Hi"}, "Ann")
    with pytest.raises(DatasetError, match="there is no row of class 9"):
        read_keypoints(written(tmp_path / "key.csv", row(1)), {"9": "Hi"}, "Ann")


def test_names_of_classes_stand_one_a_line(tmp_path: Path) -> None:
    assert read_class_names(written(tmp_path / "names.csv", "Open", "Close ")) == {"0": "Open", "1": "Close"}
    with pytest.raises(DatasetError, match="found an empty line"):
        read_class_names(written(tmp_path / "names.csv", "Open", "", "Close"))
    with pytest.raises(DatasetError, match="cannot read the names of the classes"):
        read_class_names(tmp_path / "gone.csv")


def test_a_packed_file_may_not_be_endless(tmp_path: Path) -> None:
    path = tmp_path / "bomb.csv.gz"
    with gzip.open(path, "wb") as file:
        file.write(b"9" * 50_000_000)
    with pytest.raises(DatasetError, match="a line has more than 10000 characters"):
        read_keypoints(path, {"0": "Hi"}, "me")


def test_a_long_number_is_not_repeated_in_full(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    path.write_text("0," + ",".join(["x" * 200] * 42))
    with pytest.raises(DatasetError, match="line 1: expected a class and 42 numbers") as caught:
        read_keypoints(path, {"0": "Hi"}, "me")
    assert len(str(caught.value)) < 400
