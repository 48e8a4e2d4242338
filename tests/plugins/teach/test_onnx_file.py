"""Taught signs in ONNX Runtime: the same confidences as in handsteer."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from handsteer.errors import ModelError
from handsteer.plugins.teach.exchange import read_keypoints
from handsteer.plugins.teach.network import learn_novelty, train
from handsteer.plugins.teach.onnx_file import as_onnx, save_onnx
from handsteer.recognition.custom_signs import (
    CustomModel,
    Depth,
    custom_features,
    load_custom_model,
    save_custom_model,
)
from handsteer.recognition.hand import Hand
from tests.plugins.teach.takes import take
from tests.recognition.models import model as constant_model

DEPTHS: tuple[Depth, ...] = ("full", "flat")
DOCS = Path(__file__).resolve().parents[3] / "docs" / "teach.md"

Points = NDArray[np.float32]


def learnt(pixels: Points, world: Points, classes: NDArray[np.int64], depth: Depth) -> CustomModel:
    """Return a model that has learnt these hands; the last class is other hands."""
    features = custom_features(pixels.astype(np.float64), world.astype(np.float64), depth)
    network = train(features, classes, hidden=(24, 16), epochs=60, seed=3)
    count = int(classes.max())
    mine = classes < count
    novelty = learn_novelty(features[mine], classes[mine], network.mean, network.scale)
    labels = tuple(f"Sign {number}" for number in range(count))
    return CustomModel(labels, depth, network, novelty, np.linspace(0.5, 0.8, count), {"persons": 1})


def stacked(hands: list[Hand]) -> tuple[Points, Points]:
    return np.array([hand.pixels[:, :2] for hand in hands]), np.array([hand.world for hand in hands])


@cache
def virtual(depth: Depth) -> tuple[CustomModel, Points, Points]:
    """Return a model of the virtual hand's signs, and the hands that it has learnt from."""
    takes = [take(label, hands=60, seed=seed) for seed, label in enumerate(("Peace", "Call", "Stop", "Go"))]
    pixels, world = stacked([hand for each in takes for hand in each.hands])
    return learnt(pixels, world, np.repeat([0, 1, 2, 2], 60), depth), pixels, world


def limited(model: CustomModel, limit: float) -> CustomModel:
    """Return ``model`` with another limit of the distance from its training data."""
    return replace(model, novelty=replace(model.novelty, limit=limit))


@cache
def unlimited(depth: Depth) -> tuple[CustomModel, onnxruntime.InferenceSession]:
    """Return the model of the virtual hand's signs that takes no hand for a new shape, also in ONNX Runtime."""
    model = limited(virtual(depth)[0], 1e9)
    return model, session_of(model)


def session_of(model: CustomModel) -> onnxruntime.InferenceSession:
    return onnxruntime.InferenceSession(as_onnx(model))


def run(session: onnxruntime.InferenceSession, pixels: Points, world: Points) -> Points:
    given = {"pixels": pixels, "world": world}
    (confidences,) = session.run(None, {each.name: given[each.name] for each in session.get_inputs()})
    return np.asarray(confidences)


def assert_same(
    model: CustomModel, session: onnxruntime.InferenceSession, pixels: Points, world: Points
) -> NDArray[np.float64]:
    """Compare ONNX Runtime with handsteer, except where rounding may decide; return the confidences of the latter."""
    found = run(session, pixels, world)
    exact = pixels.astype(np.float64), world.astype(np.float64)
    wanted = model.confidences(*exact)
    assert found.dtype == np.float32
    assert found.shape == wanted.shape
    chances, distances = inside(model, pixels, world)
    first_two = np.sort(chances, axis=1)[:, -2:]
    is_clear = (abs(distances / model.novelty.limit - 1) > 1e-5) & (np.ptp(first_two, axis=1) > 1e-5)
    np.testing.assert_allclose(found[is_clear], wanted[is_clear], rtol=0, atol=1e-4)
    assert is_clear.mean() > 0.95 or len(is_clear) < 20
    return wanted


def inside(model: CustomModel, pixels: Points, world: Points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the likelihoods of the signs, and the distances from the training data."""
    features = np.nan_to_num(custom_features(pixels.astype(np.float64), world.astype(np.float64), model.depth))
    chances = model.network.probabilities(features)[:, :-1]
    return chances, model.novelty.distances(features, chances.argmax(axis=1))


@pytest.mark.parametrize("depth", DEPTHS)
def test_one_hand_and_many_have_the_confidences_of_handsteer(depth: Depth) -> None:
    model, pixels, world = virtual(depth)
    session = session_of(model)
    wanted = assert_same(model, session, pixels, world)
    assert (wanted[:60, 0] > 0.8).mean() > 0.9
    assert (wanted[60:120, 1] > 0.8).mean() > 0.9
    assert (wanted[120:] < 0.8).mean() > 0.9
    assert_same(model, session, pixels[7:8], world[7:8])


@pytest.mark.parametrize("depth", DEPTHS)
def test_unclear_and_new_hands_have_the_confidences_of_handsteer(depth: Depth) -> None:
    _, pixels, world = virtual(depth)
    model, session = unlimited(depth)
    random = np.random.default_rng(1)
    pixels = (pixels + random.normal(0, 12, pixels.shape)).astype(np.float32)
    world = (world + random.normal(0, 0.012, world.shape)).astype(np.float32)
    wanted = assert_same(model, session, pixels, world).max(axis=1)
    assert ((wanted > 0.1) & (wanted < 0.9)).mean() > 0.1
    model = limited(model, float(np.median(inside(model, pixels, world)[1])))
    assert 0.4 < (assert_same(model, session_of(model), pixels, world).max(axis=1) > 0).mean() < 0.6


def test_real_landmark_rows_have_the_confidences_of_handsteer(data_dir: Path) -> None:
    names = {"0": "Open", "1": "Closed", "2": "Pointer", "3": "OK"}
    takes = read_keypoints(data_dir / "keypoints" / "kinivi.csv.gz", names, "others")
    pixels, world = stacked([hand for each in takes for hand in each.hands])
    classes = np.array(
        [["OK", "Pointer"].index(each.label) if each.label in ("OK", "Pointer") else 2 for each in takes]
    )
    rows = np.repeat(classes, [len(each.hands) for each in takes])
    model = learnt(pixels[::3], world[::3], rows[::3], "flat")
    wanted = assert_same(model, session_of(model), pixels, world)
    assert len(wanted) > 1000
    assert (wanted.argmax(axis=1)[rows < 2] == rows[rows < 2]).mean() > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("depth", DEPTHS)
def test_real_photos_have_the_confidences_of_handsteer(depth: Depth, real_hands: list[tuple[str, Hand]]) -> None:
    pixels, world = stacked([hand for _, hand in real_hands])
    truths = [
        ("Stop", "Go", "Forward").index(sign) if sign in ("Stop", "Go", "Forward") else 3 for sign, _ in real_hands
    ]
    model = learnt(pixels, world, np.array(truths), depth)
    wanted = assert_same(model, session_of(model), pixels, world)
    assert (wanted.max(axis=1) > 0.5).sum() > 30


@st.composite
def hands(draw: st.DrawFn) -> tuple[Points, Points]:
    """Hands of any shape: in eighths of a pixel and 1024ths of a metre, so that equal points stay equal in sums."""
    count = draw(st.integers(1, 4))
    pixels = draw(arrays(np.int16, (count, 21, 2), elements=st.integers(-8000, 8000))) / 8
    world = draw(arrays(np.int16, (count, 21, 3), elements=st.integers(-300, 300))) / 1024
    return pixels.astype(np.float32), world.astype(np.float32)


@pytest.mark.parametrize("depth", DEPTHS)
@given(made=hands())
def test_hands_of_any_shape_have_the_confidences_of_handsteer(depth: Depth, made: tuple[Points, Points]) -> None:
    assert_same(*unlimited(depth), *made)


@pytest.mark.parametrize("depth", DEPTHS)
@given(data=st.data())
def test_parts_of_a_hand_that_coincide(depth: Depth, data: st.DataObject) -> None:
    """Bones without length, and hands without size."""
    _, pixels, world = virtual(depth)
    row = data.draw(st.integers(0, len(pixels) - 1))
    joints = data.draw(st.lists(st.integers(0, 20), min_size=2, max_size=21))
    one = pixels[row : row + 1].round(), world[row : row + 1].copy()
    for points in one:
        points[:, joints] = points[:, joints[:1]]
    assert_same(*unlimited(depth), *one)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_landmarks_that_are_not_finite_are_no_sign(depth: Depth, bad: float) -> None:
    _, pixels, world = virtual(depth)
    session = session_of(constant_model(depth=depth))
    pixels, world = pixels[:4].copy(), world[:4].copy()
    pixels[1, 20, 1] = bad
    world[2, 3, 2] = bad
    pixels[3], world[3] = bad, bad
    signs = (run(session, pixels, world) > 0).any(axis=1)
    assert signs.tolist() == [True, False, depth == "flat", False]
    with np.errstate(invalid="ignore"):
        assert_same(*unlimited(depth), pixels, world)


def test_the_likeliest_sign_is_scaled_by_its_threshold_and_limited_by_the_novelty() -> None:
    _, pixels, world = virtual("full")
    for model, wanted in (
        (constant_model(hi=0.9, threshold=0.9), [0.8, 0.0]),
        (constant_model(hi=0.05, ho=0.8), [0.0, 0.8]),
        (constant_model(limit=0.001), [0.0, 0.0]),
    ):
        found = run(session_of(model), pixels[:2], world[:2])
        assert found == pytest.approx(np.array([wanted] * 2), abs=1e-6)


@pytest.mark.parametrize("depth", DEPTHS)
def test_the_file_is_valid_and_the_same_each_time(depth: Depth, tmp_path: Path) -> None:
    model = virtual(depth)[0]
    content = as_onnx(model)
    assert as_onnx(model) == content
    save_custom_model(model, tmp_path / "mine.npz")
    assert as_onnx(load_custom_model(tmp_path / "mine.npz")) == content
    save_onnx(model, tmp_path / "mine.onnx")
    assert (tmp_path / "mine.onnx").read_bytes() == content
    file = onnx.load_from_string(content)
    onnx.checker.check_model(file, full_check=True)
    assert (file.ir_version, file.opset_import[0].version) == (8, 18)


def test_the_file_says_what_it_needs_and_means_but_names_no_person() -> None:
    facts = {"persons": 1, "signs": [{"label": "Hi", "takes": 2}], "sources": ["Ann.mp4"], "hands": {"Hi": [[1, 2]]}}
    content = as_onnx(replace(constant_model(threshold=0.9), trained_on=facts))
    meta = onnxruntime.InferenceSession(content).get_modelmeta()
    says = {name: json.loads(value) for name, value in meta.custom_metadata_map.items()}
    assert (says["format"], says["depth"], says["sure"]) == (1, "full", 0.8)
    assert (says["labels"], says["thresholds"]) == (["Hi", "Ho"], [0.9, 0.8])
    assert set(says["meaning"]) == {"pixels", "world", "confidences"}
    assert says["trained_on"] == {"persons": 1, "signs": [{"label": "Hi", "takes": 2}]}
    assert b"Ann" not in content
    flat = session_of(constant_model(depth="flat"))
    assert [(each.name, each.shape, each.type) for each in flat.get_inputs()] == [
        ("pixels", ["hands", 21, 2], "tensor(float)")
    ]


def test_a_file_that_exists_or_cannot_be_written_is_named(tmp_path: Path) -> None:
    path = tmp_path / "mine.onnx"
    path.write_bytes(b"my thesis")
    with pytest.raises(ModelError, match=r"cannot write the ONNX file .*mine\.onnx: File exists"):
        save_onnx(constant_model(), path)
    assert path.read_bytes() == b"my thesis"
    with pytest.raises(ModelError, match="No such file or directory"):
        save_onnx(constant_model(), tmp_path / "gone" / "mine.onnx")


def test_the_example_of_the_documentation_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its result is of MediaPipe, of which there is only the form here."""
    model, pixels, world = virtual("full")
    monkeypatch.chdir(tmp_path)
    save_onnx(model, Path("my-signs.onnx"))
    shown = [7, 67, 127]

    def landmarks(points: Points) -> list[SimpleNamespace]:
        return [SimpleNamespace(**dict(zip("xyz", map(float, each), strict=False))) for each in points]

    result = SimpleNamespace(
        hand_landmarks=[landmarks(pixels[row] / (640, 480)) for row in shown],
        hand_world_landmarks=[landmarks(world[row]) for row in shown],
    )
    code = re.search(r"```python\n(import json.*?onnxruntime.*?)```", DOCS.read_text(), re.DOTALL)
    assert code
    names: dict[str, Any] = {"result": result, "width": 640, "height": 480}
    exec(code[1], names)
    assert names["signs"] == ["Sign 0", "Sign 1", "NONE"]
