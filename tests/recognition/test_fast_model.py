"""The shipped models: the 8-bit one against the one that it is made of, and the palm model on grey pictures."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from handsteer.config import LandmarksConfig
from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.hand import Hand
from handsteer.recognition.landmark_models import SHIPPED, HandModels, find_model
from handsteer.recognition.landmarker import MediaPipeLandmarker
from tests.recognition.drawn_hand import draw, open_left_hand, open_right_hand
from tests.recognition.golden_frames import DATA, photo_paths, read_photo, read_video

NAMES = sorted(SHIPPED)
HAND_PX = 112
"""What a hand takes of the 224 pixels that the model sees, about."""


@pytest.fixture(scope="module")
def landmarkers() -> list[MediaPipeLandmarker]:
    """Return one with each landmark model, both with the same palm model."""

    def models(model: str) -> HandModels:
        landmark = find_model(f"hand_landmark_{model}.tflite")
        return HandModels(find_model("palm_detection_full.tflite"), landmark, None)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("handsteer.recognition.landmarker.find_hand_models", models)
        return [MediaPipeLandmarker(LandmarksConfig(model=model)) for model in ("full", "fast")]


def hands_of_both(landmarkers: list[MediaPipeLandmarker], image: np.ndarray) -> list[tuple[Hand, Hand]]:
    """Return the hands that both see; there are as many of each."""
    full, fast = (landmarker.detect(image) for landmarker in landmarkers)
    assert len(full) == len(fast)
    return list(zip(full, fast, strict=True))


def off(full: Hand, fast: Hand) -> np.ndarray:
    """Return how far each landmark is from the other model's, in pixels of the picture that the models see."""
    distances: np.ndarray = np.linalg.norm((full.pixels - fast.pixels)[:, :2], axis=1)
    return distances * (HAND_PX / full.longer_side_px)


@pytest.mark.parametrize("place", [open_right_hand, open_left_hand])
@pytest.mark.parametrize("size", [60, 90, 130])
def test_drawn_hands_are_seen_as_by_the_full_model(
    landmarkers: list[MediaPipeLandmarker], place: Callable[..., np.ndarray], size: int
) -> None:
    for landmarker in landmarkers:
        landmarker.reset()
    for step in range(5):
        ((full, fast),) = hands_of_both(landmarkers, draw(place(280 + 8 * step, 250, size)))
        assert np.median(off(full, fast)) < 1.3
        assert off(full, fast).max() < 4
        assert np.abs(full.world - fast.world).max() < 0.01
        assert fast.handedness == full.handedness
        assert fast.presence == pytest.approx(full.presence, abs=0.05)


def test_nothing_is_seen_in_an_empty_frame() -> None:
    assert MediaPipeLandmarker(LandmarksConfig(model="fast")).detect(draw()) == []


@pytest.mark.skipif(not DATA.is_dir(), reason="the golden frames are not here: ../shared/data is absent")
@pytest.mark.parametrize("kind", [pytest.param("photos", marks=pytest.mark.slow), "video"])
def test_people_are_seen_as_by_the_full_model(landmarkers: list[MediaPipeLandmarker], kind: str) -> None:
    frames = read_video() if kind == "video" else [read_photo(path) for path in photo_paths()]
    pairs: list[tuple[Hand, Hand]] = []
    for frame in frames:
        if kind == "photos":
            for landmarker in landmarkers:
                landmarker.reset()
        full, fast = (landmarker.detect(frame, search=False)[:1] for landmarker in landmarkers)
        # One that the full model is hardly sure of may be lost.
        assert len(full) == len(fast) or min(hand.presence for hand in full + fast) < 0.6
        pairs += zip(full, fast, strict=False)
    pixels = np.stack([off(*pair) for pair in pairs])
    world = np.stack([np.linalg.norm(full.world - fast.world, axis=1) for full, fast in pairs])
    assert np.median(pixels) < 0.5
    assert np.percentile(pixels, 95) < 2
    assert np.median(world) < 0.002
    assert np.percentile(world, 95) < 0.006
    assert np.mean([full.handedness == fast.handedness for full, fast in pairs]) > 0.97


@pytest.mark.parametrize("name", NAMES)
def test_it_is_part_of_handsteer_and_needs_no_fetching(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    assert find_model(name).is_file()


@pytest.mark.parametrize("name", NAMES)
def test_a_damaged_copy_is_refused(name: str, tmp_path: Path) -> None:
    content = bytearray(find_model(name).read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ModelCorrupt, match=rf"{name} is damaged: install handsteer again"):
        find_model(name, tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_one_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(ModelMissing, match=rf"{name} .*install handsteer again"):
        find_model(name, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("sign", ["turn_left", "turn_right"])
def test_grey_hands_of_people_some_metres_away_are_found_nearly_as_often_as_coloured_ones(
    data_dir: Path, sign: str
) -> None:
    paths = sorted((data_dir / "photos" / sign).glob("emre*"))
    assert len(paths) > 60

    def found(grey: bool, model: str) -> int:
        landmarker, hands = MediaPipeLandmarker(LandmarksConfig(model=model)), 0
        for path in paths:
            landmarker.reset()
            hands += bool(landmarker.detect(View(grey=grey).picture(read_photo(str(path)))))
        return hands

    coloured, grey = (found(grey, "fast") for grey in (False, True))
    assert grey >= 0.95 * coloured
    assert found(True, "full") < grey  # MediaPipe's own palm model
