"""Where hands are looked for, with palms that are where a test says."""

from collections import Counter
from collections.abc import Iterator
from itertools import islice, pairwise

import numpy as np
import pytest

from handsteer.config import LandmarksConfig
from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import THUMB, Pinhole, View
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.regions import Palm, PalmDetector, Roi
from handsteer.recognition.search import Pace, PalmView, Places, Search, Stillness, cells_of_frame, cells_of_hands
from tests.recognition.drawn_hand import draw, open_left_hand, open_right_hand

FRAME = np.full((480, 640, 3), (90, 120, 160), np.uint8)
GREY = np.full_like(FRAME, 128)


class Palms(PalmDetector):
    """Stands in for the palm model; finds the same palms however the frame is seen, and notes how it was."""

    def __init__(self, *palms: Palm) -> None:
        self.palms = list(palms)
        self.views: list[PalmView] = []
        self.colours: list[list[int]] = []

    def detect(self, image: np.ndarray, limit: int, *, widened: float = 1.0, smoothed: bool = False) -> list[Palm]:
        self.views.append(PalmView(widened, smoothed))
        self.colours.append(image[0, 0].tolist())
        return self.palms[:limit]

    @property
    def widened(self) -> list[float]:
        return [view.widened for view in self.views]


PLAIN, WIDENED, MORE_WIDENED = (PalmView(widened) for widened in (1.0, 1.25, 2.0))
SMOOTHED, WIDENED_SMOOTHED = (PalmView(widened, smoothed=True) for widened in (1.0, 1.25))
ALL_SIZES = [PLAIN, SMOOTHED, WIDENED, WIDENED_SMOOTHED]


def palm(size: float, score: float = 0.9, *, is_sure: bool = True) -> Palm:
    """Return an upright palm in the middle, of so many pixels; its hand's region is 2.6 times as large."""
    corners = np.array([[320.0, 240.0], [320.0, 240.0]]) + np.array([[-size], [size]]) / 2
    keypoints = np.tile([320.0, 240.0], (7, 1))
    keypoints[2] -= (0, size)
    return Palm(corners, keypoints, score, is_sure)


def frame_by_frame(search: Search, palms: Palms, frames: int) -> Iterator[tuple[list[PalmView], list[Roi]]]:
    """Yield how palms were looked for in each frame, and where there may be hands without any."""
    for _ in range(frames):
        palms.views.clear()
        places = list(search.places(FRAME, beside_a_hand=False))
        yield list(palms.views), [roi for each in places for roi in each.regions]


def test_the_first_frame_is_looked_at_in_all_ways_one_after_another() -> None:
    palms = Palms()
    places = Search(palms, 2, wide=True).places(FRAME, beside_a_hand=False)
    assert (next(places), palms.views) == (Places([]), ALL_SIZES)
    assert next(places).regions == []
    assert palms.views == [*ALL_SIZES, MORE_WIDENED]
    middles = list(places)
    assert palms.views == [*ALL_SIZES, MORE_WIDENED]
    assert [roi.center_x for each in middles for roi in each.regions] == [320] * 4
    assert len({roi.rotation for each in middles for roi in each.regions}) == 4
    assert all(each.min_presence >= 0.9 for each in middles)


def test_later_frames_without_a_hand_take_one_search_of_palms_each_and_all_ways_in_turn() -> None:
    palms = Palms()
    search = Search(palms, 2, wide=True)
    later = list(islice(frame_by_frame(search, palms, 13), 1, None))
    assert all(len(views) == 1 and len(middle) <= 1 for views, middle in later)
    ways = Counter(views[0] for views, _ in later)
    assert ways == {PLAIN: 3, SMOOTHED: 3, WIDENED: 2, WIDENED_SMOOTHED: 1, MORE_WIDENED: 3}
    assert len({roi.rotation for _, middle in later for roi in middle}) == 4
    assert sum(len(middle) for _, middle in later) == 6


def test_palms_are_looked_for_in_a_tinted_copy_of_a_grey_frame_at_last() -> None:
    palms = Palms()
    list(Search(palms, 2, wide=True).places(GREY, beside_a_hand=False))
    assert palms.views == [*ALL_SIZES, MORE_WIDENED] * 2
    assert palms.colours[:5] == [[128] * 3] * 5
    ((blue, green, red),) = {tuple(colour) for colour in palms.colours[5:]}
    assert blue < green < 128 < red


def test_later_grey_frames_are_tinted_in_turn() -> None:
    palms = Palms()
    search = Search(palms, 2, wide=True)
    list(search.places(GREY, beside_a_hand=False))
    palms.views.clear()
    palms.colours.clear()
    for _ in range(16):
        list(search.places(GREY, beside_a_hand=False))
    four = [PLAIN, WIDENED, SMOOTHED, MORE_WIDENED]
    assert palms.views == four * 2 + [PLAIN, WIDENED_SMOOTHED, SMOOTHED, MORE_WIDENED] * 2
    assert [colour == [128] * 3 for colour in palms.colours] == ([True] * 4 + [False] * 4) * 2


def test_a_frame_with_colours_and_one_beside_a_hand_are_never_tinted() -> None:
    for frame, wide, beside_a_hand in ((FRAME, True, False), (GREY, True, True), (GREY, False, False)):
        palms = Palms()
        search = Search(palms, 2, wide=wide)
        for _ in range(20):
            list(search.places(frame, beside_a_hand=beside_a_hand))
        assert palms.colours == [frame[0, 0].tolist()] * len(palms.views)


def test_a_reset_makes_the_next_frame_the_first() -> None:
    palms = Palms()
    search = Search(palms, 2, wide=True)
    ((first, _), (second, _)) = frame_by_frame(search, palms, 2)
    search.reset()
    ((again, _),) = frame_by_frame(search, palms, 1)
    assert first == again != second


def test_a_hand_that_has_just_been_lost_is_looked_for_in_the_plain_frame_first() -> None:
    palms = Palms()
    search = Search(palms, 2, wide=True)
    for frames in (1, 2, 3):
        list(frame_by_frame(search, palms, frames))
        search.begin_again()
        assert [views for views, _ in frame_by_frame(search, palms, 2)] == [[PLAIN], [WIDENED]]


def test_enough_sure_palms_in_the_plain_frame_end_the_search() -> None:
    for sure, views in ((palm(100, 0.9), [PLAIN]), (palm(100, 0.6), ALL_SIZES)):
        palms = Palms(sure)
        next(Search(palms, 1, wide=True).places(FRAME, beside_a_hand=False))
        assert palms.views == views


def test_only_near_hands_are_looked_for_in_a_frame_that_is_much_widened() -> None:
    for size, count in ((60, 0), (200, 1)):
        places = Search(Palms(palm(size)), 2, wide=True).places(FRAME, beside_a_hand=False)
        assert len(next(each for each in places if each.min_presence == 0.9).regions) == count


def test_doubtful_palms_come_after_the_others_and_need_a_hand_of_which_the_landmark_model_is_sure() -> None:
    sure, doubtful = palm(100, 0.6), palm(150, 0.2, is_sure=False)
    search = Search(Palms(doubtful, sure), 1, wide=True)
    first, second, *_ = search.places(FRAME, beside_a_hand=False)
    assert (first.regions, first.min_presence) == ([sure.roi] * 4, 0.0)
    assert (second.regions, second.min_presence) == ([doubtful.roi] * 4, 0.95)
    assert list(search.places(FRAME, beside_a_hand=True)) == [Places([sure.roi])]
    # Nor do near palms count if they are doubtful.
    near = Search(Palms(palm(200, 0.2, is_sure=False)), 1, wide=True).places(FRAME, beside_a_hand=False)
    assert [len(places.regions) for places in near if places.min_presence != 0.95][:2] == [0, 0]


def test_larger_regions_of_palms_come_last_and_need_a_hand_of_which_the_landmark_model_is_sure() -> None:
    sure, doubtful = palm(100, 0.6), palm(150, 0.2, is_sure=False)
    search = Search(Palms(doubtful, sure), 1, wide=True)
    first = list(search.places(FRAME, beside_a_hand=False))
    assert [len(each.regions) for each in first[:2]] == [4, 4]
    sizes = [1.3] * 4 + [1.7] * 4
    larger = [Places([sure.roi.grown(size)], 0.95) for size in sizes] + [Places([doubtful.roi.grown(1.7)], 0.95)] * 4
    assert first[2:14] == larger
    second = list(search.places(FRAME, beside_a_hand=False))
    assert [each.regions for each in second] == [[sure.roi], [doubtful.roi]], "in a stream, the next frames do as much"


def test_larger_regions_are_not_looked_at_beside_a_hand_nor_without_the_wide_search() -> None:
    for wide, beside_a_hand in ((True, True), (False, True), (False, False)):
        search = Search(Palms(palm(100, 0.6)), 1, wide=wide)
        for _ in range(6):
            assert list(search.places(FRAME, beside_a_hand=beside_a_hand)) == [Places([palm(100).roi])]


@pytest.mark.parametrize("wide", [True, False])
def test_a_hand_is_found_whose_palm_is_detected_too_small_in_the_wide_search_only(
    wide: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = draw(open_right_hand(130, 300, size=100))
    (hand,) = MediaPipeLandmarker(LandmarksConfig()).detect(frame)
    wrist, knuckle = hand.pixels[0, :2], hand.pixels[9, :2]
    middle = (wrist + knuckle) / 2
    corners, keypoints = np.stack([middle - 28, middle + 28]), np.tile(wrist, (7, 1))
    keypoints[2] = knuckle
    small = Palm(corners, keypoints, 0.6)
    monkeypatch.setattr(PalmDetector, "detect", lambda *_, **__: [small])
    landmarker = MediaPipeLandmarker(LandmarksConfig(wide_search=wide, min_presence=0.9))
    assert len(landmarker.detect(frame)) == wide


@pytest.mark.parametrize("wide", [True, False])
def test_a_hand_whose_palm_is_doubtful_is_found_by_its_landmarks_in_the_wide_search_only(wide: bool) -> None:
    # All palms of drawn hands score less than this minimum. The hand is not in the middle, where it needs no palm.
    config = LandmarksConfig(min_detection_confidence=0.9999, wide_search=wide)
    hands = MediaPipeLandmarker(config).detect(draw(open_right_hand(120, 330, size=90)))
    assert len(hands) == wide
    assert all(hand.presence >= 0.95 for hand in hands)


def test_beside_a_hand_and_without_the_wide_search_only_palms_are_looked_for() -> None:
    for wide, beside_a_hand, ways in ((True, True, {1.0, 1.25}), (False, True, {1.0}), (False, False, {1.0})):
        palms = Palms()
        search = Search(palms, 2, wide=wide)
        for _ in range(6):
            assert list(search.places(FRAME, beside_a_hand=beside_a_hand)) == [Places([])]
        assert set(palms.widened) == ways


@pytest.mark.parametrize("turned", [0, 1, 2, 3])
def test_a_hand_in_the_middle_is_found_without_any_palm(turned: int) -> None:
    frame = np.ascontiguousarray(np.rot90(draw(open_right_hand(320, 220, size=110)), turned))
    no_palms = MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=1))
    (hand,) = no_palms.detect(frame)
    (as_with_a_palm,) = MediaPipeLandmarker(LandmarksConfig()).detect(frame)
    assert np.abs(hand.pixels - as_with_a_palm.pixels)[:, :2].max() < 0.1 * hand.longer_side_px


def test_a_thumb_up_in_the_middle_is_not_read_as_an_index_finger() -> None:
    """Upright, the landmark model expects the fingers where the thumb is; turned, it is surer."""
    view = View(yaw=np.radians(20), pitch=np.radians(-20), roll=np.radians(10 - 90), position=(0.0, 0.0, 0.35))
    placement = view.placement("Right")
    frame = render(
        pose_skeleton(THUMB), placement, Pinhole.webcam(640, 480), Look(), make_background("plain", 640, 480)
    )
    no_palms = MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=1))
    (as_with_a_palm,) = MediaPipeLandmarker(LandmarksConfig()).detect(frame)
    (in_a_photo,) = no_palms.detect(frame)
    no_palms.reset()
    no_palms.detect(EMPTY, dt_s=DT)
    in_a_stream = next(hand for _ in range(20) for hand in no_palms.detect(frame, dt_s=0.2))
    for hand in (in_a_photo, in_a_stream):
        assert np.abs(hand.pixels - as_with_a_palm.pixels)[:, :2].max() < 0.15 * hand.longer_side_px


def test_nothing_is_found_without_any_palm_in_an_empty_frame() -> None:
    no_palms = MediaPipeLandmarker(LandmarksConfig(min_detection_confidence=1))
    assert [no_palms.detect(draw()) for _ in range(13)] == [[]] * 13


DT = 1 / 30
PACE = Pace(change=6, settle_s=0.12, period_s=0.2)
EMPTY = draw()


def looks(pictures: list[np.ndarray], pace: Pace = PACE, dt_s: float = DT) -> list[int]:
    """Return at which of the pictures it is looked."""
    stillness, looked = Stillness(), []
    for number, picture in enumerate(pictures):
        stillness.wait(dt_s)
        if not stillness.is_too_early(pace) and stillness.wants_look(cells := cells_of_frame(picture), pace):
            stillness.look(cells)
            looked.append(number)
    return looked


def noisy(picture: np.ndarray, seed: int, levels: int = 8) -> np.ndarray:
    noise = np.random.default_rng(seed).integers(-levels, levels + 1, picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def test_a_still_picture_is_looked_at_until_it_has_settled_and_then_now_and_then() -> None:
    looked = looks([noisy(EMPTY, seed) for seed in range(64)])
    assert looked[:4] == [0, 1, 2, 3]
    assert {after - before for before, after in pairwise(looked[3:])} <= {6, 7}


@pytest.mark.parametrize("fps", [5, 4, 1])
def test_at_low_frame_rates_each_frame_is_looked_at(fps: int) -> None:
    assert looks([EMPTY] * 10, dt_s=1 / fps) == list(range(10))


def test_a_small_hand_is_a_change_in_its_first_frame() -> None:
    hand = draw(open_right_hand(500, 300, size=20))
    assert 20 in looks([EMPTY] * 20 + [hand] * 5)


def test_what_comes_slowly_is_a_change_too() -> None:
    """Each frame is nearly the one before; the picture is compared with the one that was looked at."""
    seldom = Pace(change=6, settle_s=0.0, period_s=60.0)
    slowly = [np.full((48, 64, 3), 100 + number, np.uint8) for number in range(40)]
    assert looks(slowly, seldom) == list(range(0, 40, 6))


def test_a_change_wakes_only_where_frames_were_left_out_before() -> None:
    bright = np.full_like(EMPTY, 255)
    for frames, woken in ((2, False), (20, True)):
        stillness = Stillness()
        for picture in [*[EMPTY] * frames, bright]:
            stillness.wait(DT)
            if stillness.wants_look(cells := cells_of_frame(picture), PACE):
                stillness.look(cells)
        assert stillness.woken is woken
        stillness.wait(DT)
        assert stillness.wants_look(cells_of_frame(EMPTY), PACE)
        assert not stillness.woken


def test_no_look_follows_another_too_early() -> None:
    pace = Pace(change=6, settle_s=0.4, period_s=1.0, least_s=0.19)
    flicker = [np.full((48, 64, 3), 200 * (number % 2), np.uint8) for number in range(30)]
    assert all(after - before >= 6 for before, after in pairwise(looks(flicker, pace)))
    assert looks([EMPTY] * 30, pace) == [0, 6, 12]


@pytest.mark.parametrize("region", [Roi(100, 100, 80), Roi(-50, 900, 30), Roi(0, 0, 5000), Roi(639, 479, 0.1)])
@pytest.mark.parametrize("shape", [(480, 640, 3), (1, 1, 3), (3, 700, 3)])
def test_hands_anywhere_have_their_cells(region: Roi, shape: tuple[int, int, int]) -> None:
    picture = np.full(shape, 77, np.uint8)
    cells = cells_of_hands(picture, [region, region])
    assert cells.shape == (24, 12, 3)
    assert (cells == 77).all()


def test_a_hand_that_comes_into_a_still_picture_is_found_in_the_same_frame() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for _ in range(2):
        for _ in range(20):
            assert landmarker.detect(EMPTY, dt_s=DT) == []
        assert any(landmarker.detect(draw(open_right_hand(300, 250)), dt_s=DT) for _ in range(2))


def test_a_still_hand_is_given_again_without_a_look_but_for_a_moment_only() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    frame = draw(open_right_hand(300, 250))
    hands = [landmarker.detect(frame, search=False, dt_s=DT)[0] for _ in range(30)]
    same = [after is before for before, after in pairwise(hands)]
    assert not any(same[:2]), "what has just changed is looked at in each frame"
    assert 10 <= sum(same) <= 24
    assert all(any(not each for each in same[begin : begin + 4]) for begin in range(26))


def test_a_hand_that_moves_is_looked_at_in_each_frame() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for _ in range(20):
        landmarker.detect(draw(open_right_hand(300, 250)), search=False, dt_s=DT)
    before = None
    for x in range(302, 320, 2):
        points = open_right_hand(x, 250)
        (hand,) = landmarker.detect(draw(points), search=False, dt_s=DT)
        assert hand is not before
        assert np.median(hand.pixels[:, 0] - points[:, 0]) == pytest.approx(0, abs=10)
        before = hand


def test_a_hand_that_jumps_is_seen_in_the_same_frame_however_still_it_was() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    for _ in range(20):
        landmarker.detect(draw(open_right_hand(150, 250)), search=False, dt_s=DT)
    (hand,) = landmarker.detect(draw(open_right_hand(500, 250)), search=False, dt_s=DT)
    assert hand.pixels[:, 0].mean() > 320


def test_a_second_hand_is_found_within_a_quarter_of_a_second() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig(max_hands=2))
    right = open_right_hand(150, 250)
    for _ in range(45):
        assert len(landmarker.detect(draw(right), dt_s=DT)) == 1
    both = draw(right, open_left_hand(480, 250))
    assert any(len(landmarker.detect(both, dt_s=DT)) == 2 for _ in range(8))


def test_without_a_time_each_frame_is_looked_at() -> None:
    landmarker = MediaPipeLandmarker(LandmarksConfig())
    frame = draw(open_right_hand(300, 250))
    hands = [landmarker.detect(frame, search=False)[0] for _ in range(10)]
    assert all(after is not before for before, after in pairwise(hands))
