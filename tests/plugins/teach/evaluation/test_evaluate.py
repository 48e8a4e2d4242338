from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from handsteer.cameras import Frame
from handsteer.cameras.files import read_photo, video_frames
from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.errors import CameraUnreadable, LabelError
from handsteer.plugins.teach.evaluation.labels import LabelledPhoto, read_video_labels
from handsteer.plugins.teach.evaluation.photo_metrics import PhotoResult
from handsteer.plugins.teach.evaluation.report import sweep
from handsteer.plugins.teach.evaluation.sources import evaluate_frames, evaluate_photos
from handsteer.plugins.teach.evaluation.video_metrics import video_report
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import BACKWARD, FORWARD, MOTION_SIGNS, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT

Picture = NDArray[np.uint8]


def virtual_hand(sign: str) -> Picture:
    """The rendered hand, 1 s after it began to show ``sign``."""
    clock = SteppedClock()
    config = VirtualHandConfig.model_validate({"script": f"{sign}:9"})
    camera = VirtualHandCamera(config, width=320, height=240, fps=30, clock=clock)
    clock.advance(1.0)
    return camera.read().image


@pytest.fixture(scope="module")
def recognizer() -> Recognizer:
    return Recognizer()


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> list[LabelledPhoto]:
    folder = tmp_path_factory.mktemp("photos")
    photos = []
    for sign in (STOP, FORWARD, TURN_LEFT, NONE):
        path = folder / f"{sign}.png"
        cv2.imwrite(str(path), virtual_hand(sign))
        photos.append(LabelledPhoto(path, sign))
    return photos


def told(photos: Sequence[LabelledPhoto], recognizer: Recognizer, view: View) -> list[tuple[str, str]]:
    return [(result.truth, result.seen) for result in evaluate_photos(photos, recognizer, view)]


@pytest.mark.parametrize(
    ("view", "truths"),
    [
        (View(), [STOP, FORWARD, TURN_LEFT, NONE]),
        (View(flip=True), [STOP, FORWARD, TURN_RIGHT, NONE]),
        (View(rotate_deg=180), [STOP, BACKWARD, TURN_RIGHT, NONE]),
    ],
)
def test_virtual_hands_are_told_flipped_and_turned(
    recognizer: Recognizer, photos: list[LabelledPhoto], view: View, truths: list[str]
) -> None:
    # An open hand that hangs down is at rest: it is not told as Stop, by design.
    seen = [NONE if truth == STOP and view.rotate_deg == 180 else truth for truth in truths]
    assert told(photos, recognizer, view) == list(zip(truths, seen, strict=True))


def test_what_is_not_to_be_scored_is_left_out(recognizer: Recognizer, photos: list[LabelledPhoto]) -> None:
    unscored = [LabelledPhoto(photo.path, None) for photo in photos]
    assert told([*unscored, photos[0]], recognizer, View()) == [(STOP, STOP)]
    assert told(photos, recognizer, View(rotate_deg=45))[0][0] == STOP
    assert len(told(photos, recognizer, View(rotate_deg=45))) == 2, "an index or a thumb aslant means nothing"


def test_nothing_is_kept_from_one_photo_to_the_next(recognizer: Recognizer, photos: list[LabelledPhoto]) -> None:
    def by_name(order: Sequence[LabelledPhoto]) -> dict[str, PhotoResult]:
        return {result.path: result for result in evaluate_photos(order, recognizer, View())}

    assert by_name(photos) == by_name(photos[::-1])
    assert {result.hand_px is None for result in by_name(photos[3:]).values()} == {True}


def test_each_photo_has_its_likelihoods_and_what_it_was_told_by(
    recognizer: Recognizer, photos: list[LabelledPhoto]
) -> None:
    stop, *_, nothing = evaluate_photos([replace(photo, person_set="made") for photo in photos], recognizer, View())
    assert stop.person_set == "made"
    assert set(stop.likelihoods) == set(SIGNS)
    assert stop.likeliest == (STOP, stop.likelihoods[STOP])
    assert stop.likelihoods[STOP] <= stop.confidence <= 1.0
    assert stop.presence is not None
    assert 0.5 < stop.presence <= 1.0
    assert (dict(nothing.likelihoods), nothing.presence) == ({}, None)


def test_the_sweep_sees_the_likeliest_sign_from_each_threshold_on(
    recognizer: Recognizer, photos: list[LabelledPhoto]
) -> None:
    results = list(evaluate_photos(photos, recognizer, View()))
    likelihood = results[0].likelihoods[STOP]
    swept = sweep(results, SIGNS, MOTION_SIGNS, [likelihood, likelihood + 1e-6])
    assert [tally.recall[STOP].count for tally in swept.values()] == [1, 0]


def test_a_photo_that_cannot_be_decoded_is_named(recognizer: Recognizer, tmp_path: Path) -> None:
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"no picture")
    with pytest.raises(CameraUnreadable, match=r"broken\.jpg"):
        told([LabelledPhoto(broken, STOP)], recognizer, View())


def frames_of(*pictures: Picture, fps: float = 20.0) -> list[Frame]:
    return [Frame(picture, number / fps) for number, picture in enumerate(pictures)]


def test_a_video_is_seen_as_a_camera_gives_it(recognizer: Recognizer, photos: list[LabelledPhoto]) -> None:
    stop, forward = (read_photo(photos[at].path) for at in (0, 1))
    frames = frames_of(*[stop] * 3, *[forward] * 8)
    truths = {number: STOP if number < 3 else FORWARD for number in range(10)}
    verdicts = list(evaluate_frames(frames, truths, recognizer, View(flip=True)))
    assert [verdict.truth for verdict in verdicts] == [STOP] * 3 + [FORWARD] * 7 + [None]
    assert verdicts[0].counts == STOP
    assert verdicts[3].counts == STOP, "Forward has still to be confirmed"
    assert verdicts[-1].counts == FORWARD
    labels = video_report({"": verdicts}, SIGNS, MOTION_SIGNS).labels
    assert labels is not None
    assert 0.05 <= (labels.reactions[FORWARD].median_s or 0.0) <= 0.25
    assert labels.false_commands == ()


def test_labels_that_belong_to_another_video_are_refused(recognizer: Recognizer, photos: list[LabelledPhoto]) -> None:
    frames = frames_of(read_photo(photos[0].path))
    with pytest.raises(LabelError, match="a label for frame 7, but the last frame of the video is 0"):
        list(evaluate_frames(frames, {0: STOP, 7: STOP}, recognizer, View()))


@pytest.mark.slow
def test_the_slide_show_gives_no_false_command(recognizer: Recognizer, slideshow: Path) -> None:
    truths = read_video_labels(slideshow, SIGNS)
    verdicts = list(evaluate_frames(video_frames(slideshow), truths, recognizer, View()))
    report = video_report({"": verdicts}, SIGNS, MOTION_SIGNS)
    assert report.frames == 270
    assert report.duration_s == pytest.approx(22.5)
    assert report.labels is not None
    assert report.labels.false_commands == ()
    assert all(reaction.missed == 0 for reaction in report.labels.reactions.values())
    assert min(share.rate or 0.0 for share in report.labels.counted_right.values()) > 0.4
