import json

import numpy as np
import pytest

from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import PhotoResult
from handsteer.training.evaluation.plots import draw_reliability, draw_sweep
from handsteer.training.evaluation.report import BINS, THRESHOLDS, calibration, sweep
from handsteer.types import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP
from tests.about import about


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
