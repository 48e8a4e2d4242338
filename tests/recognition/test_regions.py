"""The regions of interest, as geometry."""

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from handsteer.recognition.landmark_models import find_hand_models
from handsteer.recognition.regions import Detector, PalmDetector, Roi, from_landmarks, from_palm, whole_frame
from tests.about import about
from tests.recognition.drawn_hand import draw, open_right_hand

coordinates = st.floats(-2000, 2000)
angles = st.floats(-3.1, 3.1)
rois = st.builds(Roi, coordinates, coordinates, st.floats(0.1, 2000), angles)
hands = st.lists(st.tuples(coordinates, coordinates), min_size=21, max_size=21).map(np.array)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Return ``points`` turned clockwise as seen in a picture."""
    c, s = np.cos(angle), np.sin(angle)
    turned: np.ndarray = points @ np.array([[c, s], [-s, c]])
    return turned


def test_a_palm_that_points_up_gives_an_upright_region_above_it() -> None:
    roi = from_palm(np.array([[100, 200], [140, 240]]), wrist=np.array([120, 240]), middle_base=np.array([120, 200]))
    assert roi == Roi(about(120), about(220 - 0.5 * 40), about(2.6 * 40), about(0))


def test_a_palm_that_points_right_gives_a_region_turned_clockwise() -> None:
    roi = from_palm(np.array([[100, 200], [140, 240]]), wrist=np.array([100, 220]), middle_base=np.array([140, 220]))
    assert roi.rotation == pytest.approx(np.pi / 2)
    assert (roi.center_x, roi.center_y) == pytest.approx((120 + 0.5 * 40, 220))


@given(hand=hands, angle=angles, scale=st.floats(0.1, 10), x=coordinates, y=coordinates)
def test_a_hand_that_moves_turns_and_grows_takes_its_region_along(
    hand: np.ndarray, angle: float, scale: float, x: float, y: float
) -> None:
    knuckles = (hand[5] + hand[13]) / 4 + hand[9] / 2
    assume(np.linalg.norm(knuckles - hand[0]) > 1)
    roi = from_landmarks(hand)
    moved = from_landmarks(turned(hand, angle) * scale + (x, y))
    assert np.cos(moved.rotation - roi.rotation - angle) == pytest.approx(1, abs=1e-6)
    center = turned(np.array([roi.center_x, roi.center_y]), angle) * scale + (x, y)
    np.testing.assert_allclose((moved.center_x, moved.center_y), center, atol=0.01)
    assert moved.side == pytest.approx(roi.side * scale, abs=0.01)


@given(roi=rois, other=rois)
def test_overlap_is_symmetric_and_a_share(roi: Roi, other: Roi) -> None:
    assert 0 <= roi.overlap(other) <= 1 + 1e-9
    assert roi.overlap(other) == pytest.approx(other.overlap(roi))


@given(roi=rois)
def test_a_region_overlaps_itself_wholly(roi: Roi) -> None:
    assert roi.overlap(roi) == pytest.approx(1)


def test_overlap_is_intersection_over_union() -> None:
    assert Roi(0, 0, 2).overlap(Roi(1, 0, 2)) == pytest.approx(1 / 3)
    assert Roi(0, 0, 2).overlap(Roi(0, 0, 1)) == pytest.approx(1 / 4)
    assert Roi(0, 0, 2).overlap(Roi(2, 0, 2)) == 0
    assert Roi(0, 0, 2).overlap(Roi(9, 9, 2)) == 0


@given(roi=rois)
def test_the_middle_of_a_region_is_its_centre_and_its_corners_are_half_a_diagonal_away(roi: Roi) -> None:
    center, corner = roi.to_frame(np.array([[0.5, 0.5], [1.0, 0.0]]))
    np.testing.assert_allclose(center, (roi.center_x, roi.center_y))
    assert np.linalg.norm(corner - center) == pytest.approx(roi.side / np.sqrt(2))


def test_a_crop_shows_what_lies_where_to_frame_says() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    roi = Roi(300, 200, 150, 0.7)
    spot = np.array([0.3, 0.6])
    x, y = roi.to_frame(spot)
    cv2.circle(image, (round(x), round(y)), 3, (255, 255, 255), -1)
    crop = roi.crop(image, 224, cv2.BORDER_REPLICATE)
    rows, columns = np.nonzero(crop[..., 0] > 127)
    np.testing.assert_allclose((columns.mean() / 224, rows.mean() / 224), spot, atol=0.005)


@pytest.mark.parametrize(("border", "outside"), [(cv2.BORDER_REPLICATE, 200), (cv2.BORDER_CONSTANT, 0)])
def test_a_whole_frame_is_letterboxed(border: int, outside: int) -> None:
    crop = whole_frame(640, 480).crop(np.full((480, 640, 3), 200, np.uint8), 192, border)
    assert crop.shape == (192, 192, 3)
    assert crop[96, 96, 0] == crop[96, 0, 0] == crop[25, 96, 0] == 200
    assert crop[5, 96, 0] == crop[187, 96, 0] == outside


@pytest.fixture(scope="module")
def palms() -> PalmDetector:
    return PalmDetector(find_hand_models("fast").palm, 1, 0.3)


def test_a_palm_in_a_grainy_picture_is_found_if_it_is_smoothed_or_by_the_shipped_model(palms: PalmDetector) -> None:
    picture, random = draw(open_right_hand(320, 240, size=110)), np.random.default_rng(1)
    grainy = [np.clip(picture + random.normal(0, 40, (*picture.shape[:2], 1)), 0, 255) for _ in range(12)]
    mediapipes = PalmDetector(find_hand_models("full").palm, 1, 0.3)
    sampled, smoothed, shipped = (
        sum(len(model.detect(each.astype(np.uint8), 1, smoothed=smooth)) for each in grainy)
        for model, smooth in ((mediapipes, False), (mediapipes, True), (palms, False))
    )
    assert smoothed == 12
    assert sampled < 6 < shipped


class Lens:
    """In place of a detection model: finds nothing, and keeps the picture that it was given."""

    side = 192

    def run(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.picture = picture
        return np.zeros((2016, 18)), np.full((2016, 1), -100.0)

    def middle_of_the_light(self) -> np.ndarray:
        light = self.picture[..., 0].astype(float)
        return np.array([np.average(each, weights=light) for each in np.meshgrid(*2 * [np.arange(192)])])


class Scores:
    """In place of a detection model: the same box of 60 pixels at each anchor; the scores are those of a test."""

    side = 192

    def __init__(self, scores: dict[int, float]) -> None:
        self.scores = scores

    def run(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        logits = np.full((2016, 1), -100.0)
        for anchor, score in self.scores.items():
            logits[anchor] = np.log(score / (1 - score))
        return np.tile([0.0, 0.0, 60.0, 60.0, *14 * [0.0]], (2016, 1)), logits


def test_doubtful_detections_come_last_and_do_not_move_a_better_one_that_they_overlap() -> None:
    # Anchors 0 and 2 are neighbours; 1100 is far away.
    picture = np.zeros((192, 192, 3), np.uint8)
    alone, both = (
        Detector(Scores({0: 0.5, 2: 0.2, 1100: 0.15}), ((8, 2), (16, 6)), 0.3, doubtful).find(picture, 4)  # type: ignore[arg-type]
        for doubtful in (None, 0.1)
    )
    assert [score for _, score in alone] == pytest.approx([0.5])
    assert [score for _, score in both] == pytest.approx([0.5, 0.15])
    np.testing.assert_array_equal(alone[0][0], both[0][0])


@pytest.mark.parametrize("widened", [1.0, 1.25, 2.0])
@pytest.mark.parametrize(("width", "height"), [(640, 480), (480, 640), (641, 479), (250, 180), (100, 90), (1280, 720)])
def test_smoothing_leaves_everything_where_it_is(width: int, height: int, widened: float) -> None:
    picture = np.zeros((height, width, 3), np.uint8)
    picture[height // 2 :, : width // 3] = 255
    lens = Lens()
    detector = Detector(lens, ((8, 2), (16, 6)), 0.5)  # type: ignore[arg-type]
    middles = []
    for smoothed in (False, True):
        assert detector.find(picture, 1, widened=widened, smoothed=smoothed) == []
        middles.append(lens.middle_of_the_light())
    # An edge that is sampled, not averaged, is up to half a pixel off.
    assert middles[1] == pytest.approx(middles[0], abs=0.6)
