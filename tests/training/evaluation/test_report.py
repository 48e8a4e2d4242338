import json
from typing import Any

from handsteer.training.evaluation.photo_metrics import PhotoResult
from handsteer.training.evaluation.report import Evaluation
from handsteer.training.evaluation.sources import PhotoRun, VideoRun
from handsteer.training.evaluation.video_metrics import FrameVerdict
from handsteer.training.evaluation.views import View
from handsteer.types import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP

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
