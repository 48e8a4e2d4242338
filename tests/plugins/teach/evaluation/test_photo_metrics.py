import io
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion, PhotoResult, photo_report
from handsteer.plugins.teach.evaluation.plots import draw_confusion
from handsteer.types import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP, TURN_LEFT


def photo(truth: str, seen: str, kind: str = "", hand_px: float | None = 60.0) -> PhotoResult:
    return PhotoResult("x.jpg", kind, truth, seen, 0.9, hand_px)


RESULTS = [
    photo(STOP, STOP),
    photo(STOP, NONE, hand_px=None),
    photo(GO, FORWARD, hand_px=44.9),
    photo(GO, STOP, hand_px=45.0),
    photo(GO, GO, hand_px=80.1),
    photo(NONE, NONE, "ok", None),
    photo(NONE, STOP, "ok"),
    photo(NONE, TURN_LEFT, "call"),
    photo(NONE, GO, "call"),
]


def test_figures_of_photos() -> None:
    report = photo_report(RESULTS, SIGNS, MOTION_SIGNS, unscored=3)
    assert report.recall == {STOP: Share(1, 2), GO: Share(1, 3), NONE: Share(1, 4)}
    assert report.recall_by_size[STOP]["no hand"] == Share(0, 1)
    sizes = [report.recall_by_size[GO][size] for size in ("< 45 px", "45-80 px", "> 80 px")]
    assert sizes == [Share(0, 1), Share(0, 1), Share(1, 1)]
    assert report.wrong_motion[GO] == Share(1, 3)
    assert report.false_commands == Share(1, 4), "Stop and Go are no motion"
    assert report.false_commands_by_kind == {"call": Share(1, 2), "ok": Share(0, 2)}
    assert report.recall_of_found[STOP] == Share(1, 1)
    assert report.false_motion == Share(2, 9)
    assert report.wrong_motion_of_signs == Share(1, 5), "a sign that is taken for another, and drives"
    assert report.false_alarms[STOP] == Share(2, 7)
    assert report.unscored == 3
    assert report.by_person_set == {}, "nobody has said whose hands they are"


def test_persons_are_counted_apart() -> None:
    ann, bob = ([replace(result, person_set=name) for result in RESULTS] for name in ("Ann", "Bob"))
    report = photo_report([*ann, *bob[:1]], SIGNS, MOTION_SIGNS)
    assert {name: tally.recall[STOP] for name, tally in report.by_person_set.items()} == {
        "Ann": Share(1, 2),
        "Bob": Share(1, 1),
    }
    assert report.by_person_set["Bob"].false_commands == Share(0, 0)


def test_a_sign_that_the_table_of_actions_lets_move_counts_as_motion() -> None:
    report = photo_report(RESULTS, SIGNS, MOTION_SIGNS | {GO})
    assert report.false_commands == Share(2, 4)


def test_confusion_counts_rows_by_truth() -> None:
    confusion = photo_report(RESULTS, SIGNS, MOTION_SIGNS).confusion
    assert confusion.labels == (*SIGNS, NONE)
    row = dict(zip(confusion.labels, confusion.counts[SIGNS.index(GO)], strict=True))
    assert {sign: count for sign, count in row.items() if count} == {FORWARD: 1, STOP: 1, GO: 1}
    assert sum(map(sum, confusion.counts)) == len(RESULTS)


def test_the_report_is_json_and_nothing_of_nothing_is_null() -> None:
    plain = json.loads(json.dumps(photo_report(RESULTS, SIGNS, MOTION_SIGNS).as_dict(), allow_nan=False))
    low, high = (pytest.approx(end, abs=1e-4) for end in (0.0945, 0.9055))
    assert plain["recall"]["Stop"] == {"count": 1, "of": 2, "rate": 0.5, "low": low, "high": high}
    assert plain["recall_by_size"]["Stop"]["> 80 px"]["low"] is None
    assert plain["recall_by_size"]["Stop"]["> 80 px"]["rate"] is None
    assert plain["false_commands"]["kinds"]["call"]["rate"] == 0.5
    verdict = json.loads(json.dumps(RESULTS[1].as_dict(), allow_nan=False))
    assert (verdict["sign"], verdict["hand_found"], verdict["hand_px"]) == (NONE, False, None)


def test_the_plot_shows_right_blue_and_wrong_red() -> None:
    confusion = Confusion.of([(STOP, STOP)] * 9 + [(GO, FORWARD)] * 3, SIGNS)
    png = io.BytesIO()
    draw_confusion(confusion, "a title that is longer than the matrix is wide: " + 80 * "x").savefig(png)
    picture = cv2.imdecode(np.frombuffer(png.getvalue(), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    blue, green, red = (picture[..., channel].astype(int) for channel in range(3))
    right, wrong = (blue - red > 80) & (green < 200), (red - blue > 80)
    one_cell = right.sum()
    assert one_cell > 3000
    assert 0.7 < wrong.sum() / one_cell < 1.4, "one cell of each"
    assert np.argwhere(right)[:, 0].mean() < np.argwhere(wrong)[:, 0].mean(), "Stop is above Go"
