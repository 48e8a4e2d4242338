import io
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.recognition.features import COUNT
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, load_model, save_model

CONTENT = DEFAULT_MODEL.read_bytes()


def changed(path: Path, **arrays: np.ndarray | None) -> Path:
    """Write the shipped model with some arrays replaced, or left out where None."""
    with np.load(DEFAULT_MODEL) as file:
        content = {name: file[name] for name in file.files}
    content |= {name: array for name, array in arrays.items() if array is not None}
    for name in [name for name, array in arrays.items() if array is None]:
        del content[name]
    np.savez(path, **content)
    return path


def test_the_shipped_model_is_small_and_says_what_it_was_trained_on() -> None:
    model = load_model()
    assert len(CONTENT) < 300_000
    assert model.shapes == ("open", "index", "thumb", "fist", "other")
    assert "handsteer.training.synthetic" in model.trained_on["source"]
    assert sum(model.trained_on["hands"].values()) > 100_000


def test_what_is_saved_is_loaded_and_gives_the_same_bytes(tmp_path: Path) -> None:
    save_model(load_model(), tmp_path / "copy.npz")
    assert (tmp_path / "copy.npz").read_bytes() == CONTENT
    features = np.random.default_rng(0).uniform(0, 2, COUNT)
    assert load_model(tmp_path / "copy.npz").probabilities(features) == load_model().probabilities(features)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelMissing, match=r"none\.npz"):
        load_model(tmp_path / "none.npz")


@pytest.mark.parametrize("content", [b"", b"hello", CONTENT[:-1000], CONTENT[:5000], pickle.dumps({"a": 1})])
def test_what_is_no_model_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(ModelCorrupt, match=r"bad\.npz"):
        load_model(tmp_path / "bad.npz")


def test_nothing_in_a_file_is_run(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "exploded",))

    np.savez(tmp_path / "bomb.npz", format=np.array([Bomb()], dtype=object))
    with pytest.raises(ModelCorrupt):
        load_model(tmp_path / "bomb.npz")
    assert not (tmp_path / "exploded").exists()


def test_another_version_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ModelCorrupt, match="a sign model of format 99 is not known, expected 1"):
        load_model(changed(tmp_path / "new.npz", format=np.array(99)))


@pytest.mark.parametrize(
    "arrays",
    [
        {"weights_0": None},
        {"shapes": None},
        {"trained_on": np.array("{")},
        {"trained_on": np.array("[1, 2]")},
        {"mean": np.zeros(3, np.float32)},
        {"biases_1": np.zeros(7, np.float32)},
        {"limit": np.array(np.nan)},
        {"limit": np.array([1.0, 2.0])},
        {"scale": np.full(COUNT, np.inf, np.float32)},
        {"shapes": np.array(["open", "open", "thumb", "fist", "other"])},
        {"shapes": np.array(["open", "index", "thumb", "fist", "none"])},
        {"whitening": np.array(["a", "b"])},
    ],
    ids=lambda arrays: str(next(iter(arrays))),
)
def test_a_model_whose_parts_do_not_fit_is_refused(tmp_path: Path, arrays: dict[str, np.ndarray | None]) -> None:
    with pytest.raises(ModelCorrupt, match=r"odd\.npz"):
        load_model(changed(tmp_path / "odd.npz", **arrays))


@given(st.integers(0, len(CONTENT) - 1), st.integers(1, 255))
def test_a_flipped_byte_is_refused_or_makes_no_difference_to_loading(
    tmp_path_factory: pytest.TempPathFactory, place: int, flip: int
) -> None:
    damaged = bytearray(CONTENT)
    damaged[place] ^= flip
    path = tmp_path_factory.mktemp("models") / "flipped.npz"
    path.write_bytes(bytes(damaged))
    try:
        model = load_model(path)
    except (ModelCorrupt, ModelMissing):
        return
    assert model.network.mean.shape == (COUNT,)


def test_no_array_of_the_shipped_model_is_an_object() -> None:
    with zipfile.ZipFile(io.BytesIO(CONTENT)) as file:
        headers = [file.read(name)[:128] for name in file.namelist()]
    assert all(b"|O" not in header for header in headers)
