"""Drawings and pictures of hands; landmarks may come from a file of anyone's."""

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np
import pytest

from handsteer.config import SignsConfig
from handsteer.plugins.page.sign_pictures import draw_hand, sign_picture, taught_drawings
from handsteer.recognition.custom_signs import save_custom_model
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import SIGNS
from tests.plugins.page.served import Site
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


@pytest.mark.parametrize("sign", SIGNS)
def test_the_picture_of_a_sign_shows_that_sign_in_a_mirror(sign: str) -> None:
    still = cv2.imdecode(np.frombuffer(sign_picture(sign, still=True), np.uint8), cv2.IMREAD_COLOR)
    assert still is not None
    unmirrored = np.asarray(cv2.flip(cv2.resize(still, (480, 480)), 1), np.uint8)
    assert Recognizer().recognize(unmirrored).seen == sign


def test_in_the_animation_the_hand_rises_and_then_holds_the_sign(tmp_path: Path) -> None:
    data = sign_picture("Stop")
    path = tmp_path / "stop.webp"
    path.write_bytes(data)
    done, animation = cv2.imreadanimation(str(path))
    assert done
    assert len(data) < 20_000
    first, last = animation.frames[0].astype(int), animation.frames[-1].astype(int)
    assert np.abs(first - last).max() > 50
    assert sum(animation.durations) < 5000, "it repeats soon"


def test_only_shipped_signs_have_pictures() -> None:
    site = Site()
    try:
        answer = site.get(f"/signs/{quote('Turn Left')}.webp")
        assert (answer.status, answer.getheader("content-type")) == (200, "image/webp")
        assert site.get("/signs/Peace.webp").status == 404
        assert site.get("/signs/NONE.webp").status == 404
    finally:
        site.close()
