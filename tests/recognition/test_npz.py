"""Arrays from anywhere: what a small file says of itself costs nothing."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer.errors import DatasetError
from handsteer.plugins.teach.dataset import load_dataset
from tests.fuzz import corpus

MANY: dict[str, Any] = {f"a{n}": corpus.saved(1) for n in range(200)}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (corpus.dataset(points=corpus.npy((40_000_000, 21, 3))), "'points.npy' claims to be larger than it is"),
        (corpus.dataset(points=corpus.npy((10**30, 21, 3))), "claims to be larger than it is"),
        (corpus.dataset(points=corpus.npy((-1, 21, 3))), "not a dataset of signs, or damaged"),
        (corpus.dataset(points=corpus.npy((1,), "|O")), "'points.npy' is neither of numbers nor of text"),
        (corpus.dataset(points=corpus.saved(np.ones((1, 21, 3), complex))), "neither of numbers nor of text"),
        (corpus.dataset(**MANY), "it has 210 arrays"),
        (corpus.dataset(takes=corpus.saved("[" * 100_000)), "damaged .*maximum recursion depth"),
        (corpus.dataset(takes=corpus.saved("9" * 5000)), "damaged"),
        (corpus.dataset(format=corpus.saved("9" * 5000)), "of format 9{160} is not known"),
        (corpus.dataset(value=1e38), "some of its points are not from -262140 to 262140"),
        (corpus.dataset(world=corpus.saved(np.full((1, 21, 3), 1e38))), "some of its world are not from -10 to 10"),
        (corpus.dataset(image_size=corpus.saved(np.full((1, 2), np.inf))), "image_size are not from 1 to 65535"),
        (corpus.dataset(presence=corpus.saved(np.full(1, 1e38))), "presence are not from 0 to 1"),
        (corpus.dataset(time_s=corpus.saved(np.full(1, -1.0))), "time_s are not from 0"),
    ],
)
def test_what_would_cost_much_is_refused_in_one_line(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "bad.npz"
    path.write_bytes(data)
    with pytest.raises(DatasetError, match=words) as caught:
        load_dataset(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a_bomb_is_refused_by_the_directory_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("points.npy", "w", force_zip64=True) as file,
    ):
        for _ in range(300):
            file.write(bytes(1_000_000))
    assert path.stat().st_size < 400_000
    with pytest.raises(DatasetError, match="its arrays have 300 MB, and should have at most 256"):
        load_dataset(path)


def test_takes_are_cut_apart_in_one_go(tmp_path: Path) -> None:
    """Many takes of one hand each: looking through all rows for each would never end."""
    count = 20_000
    facts = "[" + ",".join(['{"label": "Hi", "person": "p", "session": "s", "source": "f"}'] * count) + "]"
    path = tmp_path / "many.npz"
    path.write_bytes(
        corpus.dataset(count, takes=corpus.saved(facts), take=corpus.saved(np.arange(count, dtype=np.int32)[::-1]))
    )
    takes = load_dataset(path).takes
    assert [len(take.hands) for take in takes] == [1] * count
