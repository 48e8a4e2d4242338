"""One file with takes and model, from anyone."""

import csv
import io
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handsteer.errors import DatasetError
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.training.custom.shared import LARGEST_SHARED_BYTES, load_shared, save_shared, takes_as_csv
from tests.recognition.models import model
from tests.training.custom.takes import take

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
