"""Drawings of hands from landmarks, which may come from a file of anyone's."""

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer.config import SignsConfig
from handsteer.dashboard.hand_drawing import draw_hand, taught_drawings
from handsteer.recognition.custom_signs import save_custom_model
from tests.recognition.hands import show_sign
from tests.recognition.models import model

HAND = show_sign("Turn Left").pixels[:, :2].tolist()


def places(drawing: str) -> list[int]:
    paths = re.findall(r'(?: d|points)="([^"]*)"', drawing)
    return [int(number) for path in paths for number in re.findall(r"-?\d+", path)]


def test_a_hand_fits_its_drawing_and_is_mirrored() -> None:
    drawing = draw_hand(np.array(HAND))
    assert all(0 <= place <= 64 for place in places(drawing))
    thumb = re.search(r'd="M(\d+) \d+L\d+ \d+L\d+ \d+L(\d+) ', drawing)
    assert thumb is not None
    assert int(thumb[2]) < int(thumb[1]), "the thumb points to the left, as in a mirror"
    assert draw_hand(np.zeros((21, 2))).startswith("<svg"), "even of no hand at all"


def drawn(folder: Path, hands: Any) -> dict[str, str]:
    path = folder / "mine.npz"
    save_custom_model(replace(model(), trained_on={"hands": hands}), path)
    os.utime(path, ns=(0, len(repr(hands))))
    return dict(taught_drawings(SignsConfig(model=path)))


def test_the_signs_of_a_model_are_drawn(tmp_path: Path) -> None:
    assert drawn(tmp_path, {"Hi": HAND}) == {"Hi": draw_hand(np.array(HAND))}


@pytest.mark.parametrize(
    "hands",
    [None, [], {"Hi": "<script>"}, {"Hi": [[1, 2]]}, {"Hi": [[1e9, float("nan")]] * 21}, {"Hi": [["a", {}]] * 21}],
)
def test_what_is_no_hand_is_left_out(tmp_path: Path, hands: Any) -> None:
    assert drawn(tmp_path, hands) == {}


def test_no_model_or_a_broken_one_has_no_drawings(tmp_path: Path) -> None:
    assert taught_drawings(SignsConfig()) == {}
    assert taught_drawings(SignsConfig(model=tmp_path / "none.npz")) == {}
    (tmp_path / "mine.npz").write_bytes(b"my thesis")
    assert taught_drawings(SignsConfig(model=tmp_path / "mine.npz")) == {}
