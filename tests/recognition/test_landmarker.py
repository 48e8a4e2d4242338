"""The real landmarker on drawn frames: following hands, and frames of every kind."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handsteer.cameras.files import read_photo
from handsteer.config import LandmarksConfig
from handsteer.errors import FrameError, ModelMissing
from handsteer.plugins.teach.evaluation.views import View
from handsteer.recognition.estimates import estimate_region
from handsteer.recognition.hand import Hand
from handsteer.recognition.landmark_models import PictureModel, find_model
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.regions import Roi
from handsteer.types import Handedness
from tests.recognition.drawn_hand import draw, open_left_hand, open_right_hand

EMPTY = draw()


@pytest.fixture(scope="module")
def shared_landmarker() -> MediaPipeLandmarker:
    return MediaPipeLandmarker(LandmarksConfig())


@pytest.fixture
def landmarker(shared_landmarker: MediaPipeLandmarker) -> MediaPipeLandmarker:
    shared_landmarker.reset()
    return shared_landmarker


@pytest.fixture
def two_hand_landmarker() -> MediaPipeLandmarker:
    return MediaPipeLandmarker(LandmarksConfig(max_hands=2))


def distance(hand: Hand, points: np.ndarray) -> float:
    return float(np.median(np.linalg.norm(hand.pixels[:, :2] - points, axis=1)))


@pytest.mark.parametrize("model", ["fast", "full", "lite"])
@pytest.mark.parametrize(("place", "handedness"), [(open_right_hand, "Right"), (open_left_hand, "Left")])
def test_finds_either_hand_where_it_is(
    model: Literal["fast", "full", "lite"], place: Callable[..., np.ndarray], handedness: Handedness
) -> None:
    points = place(300, 250)
    (hand,) = MediaPipeLandmarker(LandmarksConfig(model=model)).detect(draw(points))
    assert distance(hand, points) < 20
    assert hand.handedness == handedness
    assert 0.5 <= hand.handedness_score <= 1
    assert 0.5 < hand.presence <= 1
    assert hand.image_size == (640, 480)
    assert (hand.points.shape, hand.points.dtype) == ((21, 3), np.dtype(np.float32))
    assert (hand.world.shape, hand.world.dtype) == ((21, 3), np.dtype(np.float32))
    assert 0.05 < np.ptp(hand.world[:, 1]) < 0.3, "the world landmarks are in metres"


def test_finds_nothing_in_an_empty_frame(landmarker: MediaPipeLandmarker) -> None:
    assert landmarker.detect(EMPTY) == []


def test_follows_a_moving_hand(landmarker: MediaPipeLandmarker) -> None:
    for step in range(10):
        points = open_right_hand(200 + 12 * step, 250 - 3 * step)
        (hand,) = landmarker.detect(draw(points))
        assert distance(hand, points) < 20


def test_a_hand_that_leaves_is_lost_and_found_again_elsewhere(landmarker: MediaPipeLandmarker) -> None:
    assert landmarker.detect(draw(open_right_hand(180, 250)))
    assert landmarker.detect(EMPTY) == []
    elsewhere = open_right_hand(480, 250, size=70)
    (hand,) = landmarker.detect(draw(elsewhere))
    assert distance(hand, elsewhere) < 20


def test_a_followed_hand_keeps_the_others_out_where_one_is_wanted() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig(max_hands=1))
    followed = open_right_hand(180, 250)
    landmarker.detect(draw(followed))
    (hand,) = landmarker.detect(draw(followed, open_left_hand(470, 250)))
    assert distance(hand, followed) < 20


def test_reset_gives_what_a_fresh_landmarker_gives(landmarker: MediaPipeLandmarker) -> None:
    frame = draw(open_right_hand(300, 250))
    (fresh,) = landmarker.detect(frame)
    landmarker.detect(draw(open_right_hand(320, 250)))
    landmarker.reset()
    (again,) = landmarker.detect(frame)
    np.testing.assert_array_equal(again.points, fresh.points)


def test_a_frame_of_another_size_starts_afresh(landmarker: MediaPipeLandmarker) -> None:
    large, small = draw(open_right_hand(450, 250)), draw(open_right_hand(120, 150, size=55), width=320, height=240)
    (fresh,) = landmarker.detect(small)
    landmarker.reset()
    landmarker.detect(large)
    (after,) = landmarker.detect(small)
    np.testing.assert_array_equal(after.points, fresh.points)


def test_two_hands_keep_their_order_while_they_are_followed(two_hand_landmarker: MediaPipeLandmarker) -> None:
    orders = set()
    for step in range(6):
        right, left = open_right_hand(150 + 4 * step, 250), open_left_hand(480 - 4 * step, 250)
        hands = two_hand_landmarker.detect(draw(right, left))
        orders.add(tuple(hand.handedness for hand in hands))
    assert len(orders) == 1
    assert set(*orders) == {"Left", "Right"}


def test_a_hand_that_comes_later_stands_behind_the_one_already_followed(
    two_hand_landmarker: MediaPipeLandmarker,
) -> None:
    right = open_right_hand(150, 250)
    assert len(two_hand_landmarker.detect(draw(right))) == 1
    hands = two_hand_landmarker.detect(draw(right, open_left_hand(480, 250)))
    assert [hand.handedness for hand in hands] == ["Right", "Left"]


def test_one_hand_is_never_given_twice(two_hand_landmarker: MediaPipeLandmarker) -> None:
    for _ in range(3):
        assert len(two_hand_landmarker.detect(draw(open_right_hand(300, 250)))) == 1


def test_no_further_hands_are_looked_for_unless_asked(two_hand_landmarker: MediaPipeLandmarker) -> None:
    right = open_right_hand(150, 250)
    both = draw(right, open_left_hand(480, 250))
    two_hand_landmarker.detect(draw(right))
    assert [hand.handedness for hand in two_hand_landmarker.detect(both, search=False)] == ["Right"]
    assert len(two_hand_landmarker.detect(both)) == 2
    two_hand_landmarker.reset()
    assert len(two_hand_landmarker.detect(both, search=False)) == 2, "without a hand to follow it always looks"


def test_hands_beyond_the_wanted_number_take_turns_while_further_ones_are_looked_for() -> None:
    """Two hands that show nothing, of somebody who watches, must not hide the one that shows a sign."""
    landmarker = MediaPipeLandmarker(LandmarksConfig(max_hands=2))
    watching = [open_right_hand(120, 300, size=60), open_left_hand(280, 300, size=60)]
    late = [open_right_hand(430, 180, size=60), open_left_hand(560, 340, size=60)]
    random = np.random.default_rng(0)

    def frame(*hands: np.ndarray) -> np.ndarray:
        return np.clip(draw(*hands) + random.normal(0, 3, (480, 640, 1)), 0, 255).astype(np.uint8)

    def found(hands: list[Hand]) -> set[int]:
        places = [*watching, *late]
        return {min(range(4), key=lambda index: distance(hand, places[index])) for hand in hands}

    for _ in range(30):
        assert len(landmarker.detect(frame(*watching), dt_s=1 / 30)) <= 2
    assert found(landmarker.detect(frame(*watching), dt_s=1 / 30)) == {0, 1}
    first, *_ = landmarker.detect(frame(*watching), dt_s=1 / 30)
    seen, together = set(), []
    for _ in range(60):
        hands = landmarker.detect(frame(*watching, *late), dt_s=1 / 30)
        seen |= found(hands)
        together.append(len(hands))
    assert seen >= {2, 3}
    assert max(together) == 2
    assert distance(hands[0], first.pixels[:, :2]) < 10, "the first one keeps its place"
    for _ in range(10):
        same = landmarker.detect(frame(*watching, *late), search=False, dt_s=1 / 30)
    assert found(same) == found(hands), "nothing changes once a sign is about to count"


def test_only_the_hand_that_is_named_is_followed_on(two_hand_landmarker: MediaPipeLandmarker) -> None:
    both = draw(open_right_hand(150, 250), open_left_hand(480, 250))
    for handedness in ("Left", "Right"):
        two_hand_landmarker.reset()
        (wanted,) = (hand for hand in two_hand_landmarker.detect(both) if hand.handedness == handedness)
        two_hand_landmarker.follow_only(wanted)
        (followed,) = two_hand_landmarker.detect(both, search=False)
        assert followed.handedness == handedness


def test_refining_reads_a_new_hand_as_following_would_nearly() -> None:
    frame = draw(open_right_hand(300, 250))
    once = MediaPipeLandmarker(LandmarksConfig(refine_new_hands=False))
    once.detect(frame)
    (followed,) = once.detect(frame)
    (looked_twice,) = MediaPipeLandmarker(LandmarksConfig()).detect(frame)
    gaps = np.linalg.norm((looked_twice.pixels - followed.pixels)[:, :2], axis=1)
    assert np.median(gaps) < 0.02 * followed.longer_side_px


def test_a_hand_that_jumps_is_seen_in_the_same_frame() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for place in (open_right_hand(150, 250), open_right_hand(500, 250)):
        (hand,) = landmarker.detect(draw(place))
        landmarker.follow_only(hand)
    (hand,) = landmarker.detect(draw(open_right_hand(150, 250)), search=False)
    assert hand.pixels[:, 0].mean() < 320


DT = 1 / 30
PALMS, LANDMARKS = 192, 224
"""Sides of the models' inputs."""


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The side of the input of each run of a model since it was last cleared."""
    sides: list[int] = []
    run = PictureModel.run

    def counted(model: PictureModel, picture: np.ndarray) -> list[np.ndarray]:
        sides.append(model.side)
        return list(run(model, picture))

    monkeypatch.setattr(PictureModel, "run", counted)
    return sides


def each_run_of(
    stream: list[np.ndarray], landmarker: MediaPipeLandmarker, runs: list[int], dt_s: float = DT
) -> list[tuple[int, int, int]]:
    """Return the number of hands in each frame of a stream, and of runs of the palm and of the landmark model."""
    found = []
    for frame in stream:
        runs.clear()
        hands = landmarker.detect(frame, dt_s=dt_s)
        found.append((len(hands), runs.count(PALMS), runs.count(LANDMARKS)))
    return found


def test_no_frame_of_a_stream_takes_many_runs_of_the_models_whatever_it_shows(
    two_hand_landmarker: MediaPipeLandmarker, runs: list[int]
) -> None:
    middle = draw(open_right_hand(320, 220, size=110))
    hands = [draw(open_right_hand(150, y), open_left_hand(480, 400 - y)) for y in (120, 300)]
    shown = [EMPTY, *hands, *hands, EMPTY, middle, np.ascontiguousarray(np.rot90(middle, 2))]
    one = draw(open_right_hand(500, 120))
    shown += [hands[0], one, hands[1], one]
    for frames_each in (1, 2, 5):
        stream = [frame for frame in shown for _ in range(frames_each)]
        for _, palms, landmarks in each_run_of([EMPTY, *stream], two_hand_landmarker, runs)[1:]:
            assert palms <= 1
            assert landmarks <= (2 if palms else 5)
        two_hand_landmarker.reset()


def test_a_hand_that_jumps_takes_two_runs_in_the_frame_that_finds_it_and_the_next_one_refines_it(
    landmarker: MediaPipeLandmarker, runs: list[int]
) -> None:
    places = [open_right_hand(150, 250), open_right_hand(500, 250)] * 2
    landmarker.detect(draw(places[1]), dt_s=DT)
    for points in places:
        found = each_run_of([draw(points)] * 2, landmarker, runs)
        assert found == [(1, 1, 2), (1, 0, 1)]
        fresh = MediaPipeLandmarker(LandmarksConfig())
        (expected,), (hand,) = fresh.detect(draw(points)), landmarker.detect(draw(points), dt_s=DT)
        assert distance(hand, expected.pixels[:, :2]) < 0.02 * expected.longer_side_px


def test_of_two_hands_that_come_as_another_is_lost_the_upright_one_is_found_in_that_frame_both_in_the_next(
    two_hand_landmarker: MediaPipeLandmarker, runs: list[int]
) -> None:
    centre, turn = np.array([150, 300]), np.radians(60)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    both = draw((open_right_hand(150, 300) - centre) @ axes + centre, open_right_hand(480, 300))
    two_hand_landmarker.detect(draw(open_right_hand(320, 100, size=60)), dt_s=DT)
    runs.clear()
    (upright,) = two_hand_landmarker.detect(both, search=False, dt_s=DT)
    assert (runs.count(PALMS), runs.count(LANDMARKS)) == (1, 2)
    assert upright.pixels[:, 0].mean() > 320, "the palm of the other one has a higher score"
    assert each_run_of([both], two_hand_landmarker, runs) == [(2, 0, 3)]


def test_no_region_waits_once_a_single_hand_is_followed(
    two_hand_landmarker: MediaPipeLandmarker, runs: list[int]
) -> None:
    both = draw(open_right_hand(150, 300), open_right_hand(480, 300))
    two_hand_landmarker.detect(draw(open_right_hand(320, 100, size=60)), dt_s=DT)
    (hand,) = two_hand_landmarker.detect(both, search=False, dt_s=DT)
    two_hand_landmarker.follow_only(hand)
    assert each_run_of([both], two_hand_landmarker, runs) == [(1, 0, 1)]


def test_a_hand_that_is_seen_again_is_the_one_of_which_the_model_is_surer(landmarker: MediaPipeLandmarker) -> None:
    points = open_right_hand(320, 250, size=60)
    frame = draw(points)
    (first,) = landmarker.detect(frame)
    again = landmarker.look_again(frame, first)
    assert again.presence > first.presence
    assert again.handedness == first.handedness == "Right"
    assert distance(again, points) < 0.1 * 60
    assert landmarker.look_again(frame, first) is first, "another hand has replaced it"
    landmarker.follow_only(again)
    assert len(landmarker.detect(frame, dt_s=DT)) == 1, "the better one is followed"


def test_no_hand_is_seen_again_after_the_first_frame_of_a_stream(
    two_hand_landmarker: MediaPipeLandmarker, runs: list[int]
) -> None:
    frame = draw(open_right_hand(150, 250), open_left_hand(480, 250))
    for number in range(12):
        hands = two_hand_landmarker.detect(frame, dt_s=DT)
        assert len(hands) == 2
        runs.clear()
        for hand in hands:
            two_hand_landmarker.look_again(frame, hand)
        assert len(runs) == (0 if number else 4)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_second_model_sees_a_hand(landmarker: MediaPipeLandmarker, runs: list[int], mirrored: bool) -> None:
    points = open_right_hand(320, 250)
    frame = draw(points)
    for _ in range(3):
        (hand,) = landmarker.detect(frame, search=False, dt_s=DT)
        runs.clear()
        seen = landmarker.second_opinion(frame, hand, mirrored=mirrored)
        assert seen is not None
        assert seen is not hand
        assert len(runs) == 1
        assert distance(seen, points) < 20
    landmarker.follow_only(hand)
    assert len(landmarker.detect(frame, dt_s=DT)) == 1


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_second_model_that_is_not_sure_has_no_opinion(landmarker: MediaPipeLandmarker, mirrored: bool) -> None:
    frame = draw(open_right_hand(320, 250))
    (hand,) = landmarker.detect(frame, dt_s=DT)
    assert landmarker.second_opinion(np.full_like(frame, 90), hand, mirrored=mirrored) is hand


def test_second_opinions_are_runs_of_the_model_in_a_frame(landmarker: MediaPipeLandmarker, runs: list[int]) -> None:
    frame = draw(open_right_hand(320, 250))
    for _ in range(3):
        (hand,) = landmarker.detect(frame, dt_s=DT)
    runs.clear()
    opinions = [landmarker.second_opinion(frame, hand) for _ in range(6)]
    assert opinions[0] is not None
    assert opinions[-1] is None
    assert landmarker.second_opinion(frame, hand, mirrored=True) is not None
    assert landmarker.second_opinion(frame, hand, mirrored=True) is None
    assert len(runs) <= 5


def test_a_hand_of_an_earlier_frame_has_no_second_opinion(landmarker: MediaPipeLandmarker) -> None:
    frame = draw(open_right_hand(320, 250))
    (hand,) = landmarker.detect(frame, dt_s=DT)
    landmarker.reset()
    assert landmarker.second_opinion(frame, hand) is hand


def test_mediapipe_s_own_models_have_no_second_opinions() -> None:
    landmarker, frame = MediaPipeLandmarker(LandmarksConfig(model="full")), draw(open_right_hand(320, 250))
    (hand,) = landmarker.detect(frame)
    assert landmarker.second_opinion(frame, hand) is hand


def test_a_region_that_is_seen_mirrored_shows_the_same_hand() -> None:
    model = PictureModel(find_model("hand_landmark_fast.tflite"), 1)
    points = open_left_hand(300, 250)
    region = Roi(300, 250, 260, 0.2)
    plain, mirrored = (estimate_region(model, draw(points), region, mirrored=each) for each in (False, True))
    assert np.abs(plain.pixels - mirrored.pixels)[:, :2].max() < 0.15 * 90
    assert np.abs(plain.world - mirrored.world).max() < 0.02
    assert max(plain.rightness, mirrored.rightness) < 0.5
    assert min(plain.presence, mirrored.presence) > 0.5


@pytest.mark.parametrize(("turned", "frames"), [(0, 3), (1, 20), (2, 6), (3, 20)])
def test_a_hand_in_the_middle_without_a_palm_is_found_in_a_stream_too(
    turned: int, frames: int, runs: list[int]
) -> None:
    frame = np.ascontiguousarray(np.rot90(draw(open_right_hand(320, 220, size=110)), turned))
    no_palms = MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=1))
    no_palms.detect(draw(width=frame.shape[1], height=frame.shape[0]), dt_s=DT)
    found = each_run_of([frame] * frames, no_palms, runs, dt_s=0.2)
    assert found[-1][0] == 1
    assert all(landmarks <= (2 if palms else 5) for _, palms, landmarks in found)
    (hand,) = no_palms.detect(frame, dt_s=DT)
    (as_with_a_palm,) = MediaPipeLandmarker(LandmarksConfig()).detect(frame)
    assert np.abs(hand.pixels - as_with_a_palm.pixels)[:, :2].max() < 0.1 * hand.longer_side_px


def test_no_hand_counts_below_the_asked_presence() -> None:
    strict = MediaPipeLandmarker(LandmarksConfig(min_presence=1.0))
    assert strict.detect(draw(open_right_hand(300, 250))) == []


def test_any_palm_counts_at_confidence_zero_and_none_at_one(landmarker: MediaPipeLandmarker) -> None:
    frame = draw(open_right_hand(300, 250))
    (hand,) = landmarker.detect(frame)
    (same,) = MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=0)).detect(frame)
    assert distance(same, hand.pixels[:, :2]) < 5
    assert MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=1, wide_search=False)).detect(frame) == []


@pytest.mark.parametrize(
    ("image", "got"),
    [
        (np.zeros((0, 0, 3), np.uint8), "0x0"),
        (np.zeros((480, 0, 3), np.uint8), "0x480"),
        (np.zeros((480, 640), np.uint8), "(480, 640) uint8"),
        (np.zeros((480, 640, 1), np.uint8), "(480, 640, 1) uint8"),
        (np.zeros((480, 640, 4), np.uint8), "(480, 640, 4) uint8"),
        (np.zeros((480, 640, 3), np.float32), "(480, 640, 3) float32"),
        (np.zeros((480, 640, 3), np.uint16), "(480, 640, 3) uint16"),
        (np.zeros((1, 480, 640, 3), np.uint8), "(1, 480, 640, 3) uint8"),
        (np.broadcast_to(np.uint8(0), (1, 40000, 3)), "40000x1"),
        (np.array(None), "() object"),
        (None, "NoneType"),
        ([[[0, 0, 0]]], "list"),
        (b"\xff\xd8\xff", "bytes"),
    ],
)
def test_a_wrong_frame_is_refused_in_one_line_and_does_not_break_the_next(
    landmarker: MediaPipeLandmarker, image: Any, got: str
) -> None:
    frame = draw(open_right_hand(300, 250))
    landmarker.detect(frame)
    (undisturbed,) = landmarker.detect(frame)
    landmarker.reset()
    landmarker.detect(frame)
    with pytest.raises(FrameError) as caught:
        landmarker.detect(image)
    assert got in str(caught.value)
    assert "(height, width, 3) uint8 BGR" in str(caught.value)
    assert "\n" not in str(caught.value)
    (hand,) = landmarker.detect(frame)
    np.testing.assert_array_equal(hand.points, undisturbed.points)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 480), (640, 1), (2, 3), (32766, 1)])
def test_a_tiny_frame_holds_no_hand_and_does_not_break_the_next(
    landmarker: MediaPipeLandmarker, width: int, height: int
) -> None:
    frame = draw(open_right_hand(300, 250))
    (before,) = landmarker.detect(frame)
    assert landmarker.detect(np.full((height, width, 3), 128, np.uint8)) == []
    (after,) = landmarker.detect(frame)
    np.testing.assert_array_equal(after.points, before.points)


def test_a_large_frame_works(landmarker: MediaPipeLandmarker) -> None:
    points = open_right_hand(300, 250)
    large: np.ndarray = cv2.resize(draw(points), (4000, 3000))
    (hand,) = landmarker.detect(large)
    assert distance(hand, points * 6.25) < 6.25 * 20


FRAME = draw(open_right_hand(300, 250))


def _read_only() -> np.ndarray:
    return np.frombuffer(FRAME.tobytes(), np.uint8).reshape(FRAME.shape)


@pytest.mark.parametrize(
    "same",
    [
        np.asfortranarray(FRAME),
        FRAME[::-1].copy()[::-1],
        FRAME[:, ::-1].copy()[:, ::-1],
        FRAME[..., ::-1].copy()[..., ::-1],
        np.dstack([FRAME, FRAME[..., :1]])[..., :3],
        _read_only(),
    ],
    ids=["fortran", "upside down", "mirrored", "rgb", "bgra", "read-only"],
)
def test_the_memory_layout_does_not_matter(landmarker: MediaPipeLandmarker, same: np.ndarray) -> None:
    (expected,) = landmarker.detect(FRAME)
    landmarker.reset()
    (hand,) = landmarker.detect(same)
    np.testing.assert_array_equal(hand.points, expected.points)


def test_a_frame_is_not_changed(landmarker: MediaPipeLandmarker) -> None:
    frame = FRAME.copy()
    landmarker.detect(frame)
    np.testing.assert_array_equal(frame, FRAME)


@settings(max_examples=15, deadline=None)
@given(width=st.integers(1, 90), height=st.integers(1, 90), seed=st.integers(0, 2**32 - 1))
def test_noise_of_any_size_gives_sound_hands_or_none(
    shared_landmarker: MediaPipeLandmarker, width: int, height: int, seed: int
) -> None:
    noise = np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)
    for hand in shared_landmarker.detect(noise):
        assert np.isfinite(hand.points).all()
        assert hand.image_size == (width, height)


def test_models_that_are_not_there_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    with pytest.raises(ModelMissing, match=r"palm_detection_full\.tflite.*handsteer models"):
        MediaPipeLandmarker(LandmarksConfig(model="full"))


@pytest.mark.slow
def test_hands_that_nearly_fill_the_frame_are_found_in_a_widened_one(data_dir: Path) -> None:
    photos = [View().picture(read_photo(path)) for path in sorted((data_dir / "photos" / "forward").glob("sld*"))]
    assert len(photos) == 68

    def found(**config: bool) -> int:
        landmarker = MediaPipeLandmarker(LandmarksConfig(model="full", **config))
        hands = []
        for photo in photos:
            landmarker.reset()
            hands.append(max((np.ptp(hand.pixels[:, 1]) for hand in landmarker.detect(photo)), default=0.0))
        return sum(height > 0.25 * photo.shape[0] for height, photo in zip(hands, photos, strict=True))

    assert found() == 68
    assert found(wide_search=False) < 68


@pytest.mark.slow
def test_a_part_of_a_hand_is_not_another_hand(data_dir: Path) -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for path in sorted((data_dir / "photos" / "negatives" / "thumb_down").glob("*")):
        landmarker.reset()
        boxes = [
            (hand.pixels[:, :2].min(axis=0), hand.pixels[:, :2].max(axis=0))
            for hand in landmarker.detect(read_photo(path))
        ]
        for low, high in boxes:
            inside = [(other_low <= low).all() and (high <= other_high).all() for other_low, other_high in boxes]
            assert sum(inside) == 1, path.name
