from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handsteer.errors import CameraUnreadable, DatasetError, EvaluationError, LabelError
from handsteer.plugins.teach.dataset import Dataset, Take, save_dataset
from handsteer.plugins.teach.evaluation.sources import LabelledHands, PhotoRun, open_source
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.custom_signs import CustomClassifier
from handsteer.recognition.hand import Hand
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import NONE
from tests.recognition.hands import show_sign
from tests.recognition.models import model

SHIPPED = ShippedClassifier(load_model())


def flat(hand: Hand) -> Hand:
    """The hand as imported rows have it: without depth."""
    points = hand.points.copy()
    points[:, 2] = np.nan
    return replace(hand, points=points, world=np.full((21, 3), np.nan, np.float32))


def dataset(path: Path, **hands: list[Hand]) -> Path:
    """A file with a take of each label."""
    takes = [Take(label, "Ann", "s", "x", tuple(own), (0.0,) * len(own)) for label, own in hands.items()]
    save_dataset(Dataset(tuple(takes)), path)
    return path


def run(path: Path, classifier: ShippedClassifier | CustomClassifier = SHIPPED) -> PhotoRun:
    source = open_source(path, classifier)
    assert isinstance(source, LabelledHands)
    return source.run(classifier, 0.8, View(), lambda things, _unit: things)


STOP, GO = show_sign("Stop"), show_sign("Go")


def test_hands_without_depth_are_not_scored_and_are_counted(tmp_path: Path) -> None:
    found = run(dataset(tmp_path / "x.npz", Stop=[STOP, flat(STOP), STOP], Go=[flat(GO)]))
    assert [(result.path, result.seen) for result in found.results] == [
        ("take 1, hand 1", "Stop"),
        ("take 1, hand 3", "Stop"),
    ]
    assert (found.without_depth, found.unscored) == (2, 0)
    assert {result.person_set for result in found.results} == {"Ann"}


def test_a_dataset_without_any_depth_is_refused(tmp_path: Path) -> None:
    path = dataset(tmp_path / "x.npz", Stop=[flat(STOP)] * 2, NONE=[flat(GO)])
    with pytest.raises(EvaluationError, match=r"x\.npz: none of its 3 hands has depth, and without it Stop, NONE can"):
        open_source(path, SHIPPED)


def test_signs_that_were_taught_without_depth_are_told_without_it(tmp_path: Path) -> None:
    path = dataset(tmp_path / "x.npz", Hi=[flat(GO)] * 3, Stop=[flat(STOP)], NONE=[flat(GO)])
    found = run(path, CustomClassifier(SHIPPED, model(hi=0.95, depth="flat")))
    assert [(result.truth, result.seen) for result in found.results] == [("Hi", "Hi")] * 3
    assert found.without_depth == 2, "a shipped sign cannot be recognised without depth, nor that it is none"
    with pytest.raises(EvaluationError, match="none of its 5 hands has depth"):
        open_source(path, CustomClassifier(SHIPPED, model()))


def test_what_cannot_be_opened_is_named(tmp_path: Path) -> None:
    (tmp_path / "bad.mp4").write_bytes(b"no video")
    (tmp_path / "photo.jpg").write_bytes(b"no photo")
    for name, error in {
        "gone": LabelError,
        "gone.mp4": LabelError,
        "gone.npz": DatasetError,
        "bad.mp4": CameraUnreadable,
        "photo.jpg": EvaluationError,
    }.items():
        with pytest.raises(error, match=name):
            open_source(tmp_path / name, SHIPPED)
    with pytest.raises(EvaluationError, match="the sign 'Hi' is not known"):
        open_source(dataset(tmp_path / "x.npz", Hi=[STOP], NONE=[GO]), SHIPPED)
    with pytest.raises(EvaluationError, match=r"y\.npz: there is no hand in it"):
        open_source(dataset(tmp_path / "y.npz"), SHIPPED)


def test_none_is_no_sign_to_be_missed(tmp_path: Path) -> None:
    found = run(dataset(tmp_path / "x.npz", NONE=[show_sign("Stop")]))
    assert [(result.truth, result.seen) for result in found.results] == [(NONE, "Stop")]
