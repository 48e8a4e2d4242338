import json
from typing import Any

import numpy as np
import pytest

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import PhotoResult
from handsteer.plugins.teach.evaluation.plots import draw_reliability, draw_sweep
from handsteer.plugins.teach.evaluation.report import BINS, THRESHOLDS, Evaluation, calibration, sweep
from handsteer.plugins.teach.evaluation.sources import PhotoRun, VideoRun
from handsteer.plugins.teach.evaluation.video_metrics import FrameVerdict
from handsteer.plugins.teach.evaluation.views import View
from handsteer.types import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP
from tests.about import about

RAW, TILTED = View(), View(flip=True, rotate_deg=15)


def run(source: str, view: View, *pairs: tuple[str, str]) -> PhotoRun:
    results = tuple(
        PhotoResult(f"{source}/{at}", "", truth, seen, 0.9, 50.0, 1.0, likelihoods={seen: 0.9})
        for at, (truth, seen) in enumerate(pairs)
    )
    return PhotoRun(source, view, results, unscored=1)


def video(source: str, view: View, counts: str) -> VideoRun:
    return VideoRun(source, view, tuple(FrameVerdict(at / 10, None, counts, counts) for at in range(10)))


PHOTOS = (
    run("a", RAW, (STOP, STOP), (NONE, FORWARD)),
    run("a", TILTED, (STOP, NONE), (NONE, NONE)),
    run("b", RAW, (STOP, STOP)),
    run("b", TILTED, (STOP, STOP)),
)
HANDS = (run("c.npz", RAW, (GO, FORWARD)),)
VIDEOS = (video("d.mp4", RAW, FORWARD), video("e.mp4", RAW, NONE))


def plain(evaluation: Evaluation, *, with_sweep: bool = False) -> dict[str, Any]:
    read: dict[str, Any] = json.loads(json.dumps(evaluation.as_dict(with_sweep=with_sweep), allow_nan=False))
    return read


def test_figures_are_together_and_by_view_and_by_source() -> None:
    found = plain(Evaluation(SIGNS, MOTION_SIGNS, PHOTOS, HANDS, VIDEOS))
    assert (found["photos"], found["unscored"]) == (6, 4)
    assert found["recall"]["Stop"]["count"] == 3
    assert {view["view"]: view["recall"]["Stop"]["count"] for view in found["views"]} == {"raw": 2, "flipped +15": 1}
    assert [(view["flip"], view["rotate"]) for view in found["views"]] == [(False, 0.0), (True, 15.0)]
    by_source = {(each["source"], each["view"]): each for each in found["sources"]}
    assert by_source["a", "raw"]["false_commands"]["count"] == 1
    assert by_source["c.npz", "raw"]["wrong_motion"]["Go"]["count"] == 1
    assert by_source["d.mp4", "raw"]["counted_s"] == {FORWARD: 1.0}
    assert (found["videos"], found["frames"], found["motion_events"][0]["video"]) == (2, 20, "d.mp4")


def test_each_photo_has_its_verdict() -> None:
    verdicts = plain(Evaluation(SIGNS, MOTION_SIGNS, PHOTOS, HANDS))["verdicts"]
    assert len(verdicts) == 7
    assert verdicts[2] == {
        "source": "a",
        "view": "flipped +15",
        "path": "a/0",
        "kind": "",
        "person_set": "",
        "truth": "Stop",
        "sign": "NONE",
        "confidence": 0.9,
        "likelihoods": {"NONE": 0.9},
        "hand_found": True,
        "hand_px": 50.0,
        "presence": 1.0,
    }


def test_datasets_are_at_the_top_only_where_there_are_no_photos() -> None:
    assert plain(Evaluation(SIGNS, MOTION_SIGNS, (), HANDS))["recall"]["Go"]["of"] == 1
    assert "Go" not in plain(Evaluation(SIGNS, MOTION_SIGNS, PHOTOS, HANDS))["recall"]


def test_thresholds_only_if_asked_for() -> None:
    evaluation = Evaluation(SIGNS, MOTION_SIGNS, PHOTOS)
    assert "sweep" not in plain(evaluation)
    rows = {row["threshold"]: row["recall"]["Stop"]["count"] for row in plain(evaluation, with_sweep=True)["sweep"]}
    assert (rows[0.9], rows[0.95]) == (3, 0)
    assert plain(evaluation)["calibration"]["bins"][9]["right"]["of"] == 6


def test_without_labels_nothing_was_taken_for_anything() -> None:
    assert Evaluation(SIGNS, MOTION_SIGNS, videos=VIDEOS).confusion is None


def photo(truth: str, **likelihoods: float) -> PhotoResult:
    hand_px = 60.0 if likelihoods else None
    return PhotoResult("x.jpg", "", truth, NONE, 0.0, hand_px, likelihoods=likelihoods)


RESULTS = [
    photo(STOP, Stop=0.95, Forward=0.01),
    photo(STOP, Stop=0.85, Forward=0.01),
    photo(FORWARD, Stop=0.3, Forward=0.65),
    photo(GO, Go=0.2, Forward=0.61),
    photo(NONE, Forward=0.05, Stop=0.02),
    photo(NONE, Forward=1.0),
    photo(NONE),
]


def test_bins_and_their_error() -> None:
    figures = calibration(RESULTS)
    filled = {each.low: (each.right, each.confidence) for each in figures.bins if each.right.of}
    assert filled == {
        0.0: (Share(0, 1), about(0.05)),
        0.6: (Share(1, 2), about(0.63)),
        0.8: (Share(1, 1), about(0.85)),
        0.9: (Share(1, 2), about(0.975)),
    }
    assert figures.expected_error == pytest.approx((0.05 + 2 * 0.13 + 0.15 + 2 * 0.475) / 6)
    assert len(figures.bins) == BINS


def test_likelihoods_that_are_true_have_no_error() -> None:
    honest = [photo(STOP if number < 7 else NONE, Stop=0.7) for number in range(10)]
    assert calibration(honest).expected_error == pytest.approx(0.0)


def test_nothing_found_has_no_error() -> None:
    plain = json.loads(json.dumps(calibration([photo(NONE)]).as_dict(), allow_nan=False))
    assert plain["expected_calibration_error"] is None
    assert plain["bins"][0]["right"]["rate"] is None


def test_thresholds_trade_recall_for_false_motion() -> None:
    rows = sweep(RESULTS, SIGNS, MOTION_SIGNS, [0.0, 0.63, 0.9, 1.0])
    assert [row.recall[STOP] for row in rows.values()] == [Share(2, 2), Share(2, 2), Share(1, 2), Share(0, 2)]
    assert [row.false_commands.count for row in rows.values()] == [2, 1, 1, 1]
    assert [row.false_motion.count for row in rows.values()] == [3, 1, 1, 1]
    assert rows[0.0].false_alarms[FORWARD] == Share(3, 6)
    assert rows[0.0].false_alarms[STOP] == Share(0, 5)


def test_a_photo_without_a_hand_shows_nothing_at_any_threshold() -> None:
    assert sweep([photo(NONE)], SIGNS, MOTION_SIGNS, [0.0])[0.0].recall[NONE] == Share(1, 1)


def test_thresholds_rise_from_where_signs_are_doubted() -> None:
    assert sorted(set(THRESHOLDS)) == list(THRESHOLDS)
    assert (THRESHOLDS[0], THRESHOLDS[-1]) == (0.3, 0.99)


def test_plots_show_a_line_for_each_sign_and_a_dot_for_each_bin() -> None:
    (reliability,) = draw_reliability(calibration(RESULTS), "title").axes
    assert [np.size(line.get_xdata()) for line in reliability.lines] == [2, 4]
    assert "expected calibration error" in reliability.get_legend_handles_labels()[1][0]
    # The first photos show no sign: there is no recall of one to draw, but there are false alarms.
    for results, shown in ((RESULTS, 3), (RESULTS[6:], 0)):
        left, right = draw_sweep(sweep(results, SIGNS, MOTION_SIGNS), "title").axes
        assert len(left.lines) == shown
        assert len(right.lines) == len(SIGNS) + 1
        assert np.size(right.lines[0].get_xdata()) == len(THRESHOLDS)
