import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.recognition.recognizer import Recognizer
from handsteer.types import SIGNS
from tests.cli.test_cli import fails, prints


def shorter_side(png: Path) -> int:
    """Return how many pixels a picture has in its shorter direction."""
    picture = cv2.imread(str(png))
    assert picture is not None, png
    return int(min(picture.shape[:2]))


@pytest.fixture
def few(data_dir: Path, tmp_path: Path) -> Path:
    """A folder with an index of a few of the real photos."""
    real = data_dir / "photos"
    chosen = {
        "Stop": sorted((real / "stop").glob("emre*"))[:3],
        "turn_left": sorted((real / "turn_left").glob("emre*"))[:2],
        "NONE": sorted((real / "negatives" / "thumb_up").glob("*"))[:2],
    }
    rows = [f"{path},{sign},{path.parent.name}" for sign, paths in chosen.items() for path in paths]
    (tmp_path / "index.csv").write_text("\n".join(["path,sign,kind", *rows]))
    return tmp_path


def row_of(folder: Path, number: int) -> str:
    """The photo in a line of the folder's index."""
    return (folder / "index.csv").read_text().splitlines()[number].split(",")[0]


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """A video of half a second in which there is nothing, without labels."""
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (320, 240))
    for _ in range(5):
        writer.write(np.full((240, 320, 3), 90, np.uint8))
    writer.release()
    return path


def test_evaluate_prints_tables(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    png = few / "confusion.png"
    text = prints(capsys, "signs", "evaluate", str(few), "--png", str(png))
    assert "7 photos, 0 not scored" in text
    for part in ("Recall", "False commands", "thumb_up", "Confusion", "Turn Left"):
        assert part in text
    assert shorter_side(png) > 200


def test_evaluate_prints_json_and_flips_and_turns(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    plain = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json"))
    assert plain["recall"]["Stop"]["count"] == 3
    kinds = plain["false_commands"]["kinds"]
    assert {kind: (share["count"], share["of"], share["low"]) for kind, share in kinds.items()} == {
        "thumb_up": (0, 2, 0.0)
    }
    assert len(plain["verdicts"]) == 7
    assert all(set(verdict["likelihoods"]) == set(SIGNS) for verdict in plain["verdicts"] if verdict["hand_found"])
    flipped = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json", "--flip"))
    assert flipped["recall"]["Turn Right"]["of"] == 2
    turned = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json", "--rotate", "-90"))
    assert turned["recall"]["Turn Right"]["of"] == 2
    assert turned["false_commands"]["kinds"]["thumb_up"]["of"] == 2


@pytest.mark.slow
def test_several_sources_and_views_are_compared_in_one_run(
    capsys: pytest.CaptureFixture[str], few: Path, clip: Path
) -> None:
    (few / "more" / "stop").mkdir(parents=True)
    (few / "more" / "stop" / "a.jpg").write_bytes(Path(row_of(few, 1)).read_bytes())
    sources = [str(few), str(few / "more"), str(clip)]
    asked = ["signs", "evaluate", *sources, "--flip", "--rotate", "-15,0,15"]
    plain = json.loads(prints(capsys, *asked, "--json"))
    names = ["raw -15", "raw", "raw +15", "flipped -15", "flipped", "flipped +15"]
    assert [view["view"] for view in plain["views"]] == names
    assert [view["recall"].get("Turn Left", {}).get("of") for view in plain["views"]] == [2, 2, 2, None, None, None]
    assert {(each["source"], each["view"]) for each in plain["sources"]} == {
        (s, view) for s in sources for view in names
    }
    assert (plain["photos"], plain["videos"]) == (6 * 8, 6)
    lines = prints(capsys, *asked).splitlines()
    assert [name for name in names if any(line.startswith(f"{name}  ") for line in lines)] == names
    assert any(line.startswith(f"{sources[1]} ") for line in lines)
    assert any(line.startswith(f"{sources[2]}, flipped -15 ") for line in lines)


@pytest.mark.parametrize(
    ("options", "views"),
    [
        (["--flip"], ["flipped"]),
        (["--rotate", "180"], ["raw +180"]),
        (["--flip", "--rotate", "90"], ["flipped +90"]),
        (["--flip", "--rotate", "0,"], ["raw", "flipped"]),
        (["--rotate", "0,180,0"], ["raw", "raw +180"]),
    ],
    ids=" ".join,
)
def test_one_angle_gives_one_view_and_several_both_sides(
    capsys: pytest.CaptureFixture[str], few: Path, options: list[str], views: list[str]
) -> None:
    plain = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json", *options))
    assert [view["view"] for view in plain["views"]] == views


def test_likelihoods_and_thresholds_are_shown(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    reliability, swept = few / "reliability.png", few / "sweep.png"
    pictures = ["--reliability", str(reliability), "--sweep-png", str(swept)]
    text = prints(capsys, "signs", "evaluate", str(few), "--sweep", *pictures)
    for part in ("Expected calibration error: ", "0.9 to 1.0", "Thresholds: recall", "\n0.99 "):
        assert part in text
    assert all(shorter_side(png) > 200 for png in (reliability, swept))
    plain = json.loads(prints(capsys, "signs", "evaluate", str(few), "--sweep", "--json"))
    assert plain["sweep"][0]["recall"]["Stop"]["count"] == 3
    assert 0.0 <= plain["calibration"]["expected_calibration_error"] <= 1.0


def test_persons_and_hands_that_are_not_found_are_told_apart(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    rows = (few / "index.csv").read_text().splitlines()
    (few / "index.csv").write_text("\n".join([f"{rows[0]},person_set", f"{rows[1]},Ann", *rows[2:]]))
    cv2.imwrite(str(few / "empty.png"), np.full((480, 640, 3), 90, np.uint8))
    with (few / "index.csv").open("a") as index:
        index.write("\nempty.png,Stop,,Ann\n")
    plain = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json"))
    assert (plain["recall"]["Stop"]["of"], plain["recall_of_found"]["Stop"]["of"]) == (4, 3)
    assert plain["by_person_set"]["Ann"]["recall"]["Stop"]["rate"] == 0.5
    assert [verdict["presence"] for verdict in plain["verdicts"] if not verdict["hand_found"]] == [None]
    text = prints(capsys, "signs", "evaluate", str(few))
    assert "(no person_set)" in text
    assert "\nAnn " in text


def test_rows_without_depth_are_refused_not_scored_as_wrong(
    capsys: pytest.CaptureFixture[str], data_dir: Path, tmp_path: Path
) -> None:
    rows = str(data_dir / "keypoints" / "kinivi.csv.gz")
    data = str(tmp_path / "rows.npz")
    prints(capsys, "signs", "import", rows, "--labels", "1=Go", "--dataset", data)
    assert "rows.npz: none of its 1572 hands has depth" in fails(capsys, "signs", "evaluate", data)


def test_a_missing_source_is_named_before_anything_is_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, few: Path, clip: Path
) -> None:
    monkeypatch.setattr(Recognizer, "step", None)
    for gone in ("gone", "gone.mp4", "gone.npz"):
        assert gone in fails(capsys, "signs", "evaluate", str(few), str(clip), gone)


def test_what_is_a_false_command_depends_on_the_actions(
    capsys: pytest.CaptureFixture[str], data_dir: Path, tmp_path: Path
) -> None:
    fist = sorted((data_dir / "photos" / "go").glob("*"))[0]
    (tmp_path / "index.csv").write_text(f"path,sign\n{fist},NONE\n")
    arguments = ["signs", "evaluate", str(tmp_path), "--json"]
    assert json.loads(prints(capsys, *arguments))["false_commands"]["count"] == 0
    moving = json.loads(prints(capsys, *arguments, "--control.actions.Go", "turbo"))
    assert moving["confusion"]["counts"][-1][moving["confusion"]["labels"].index("Go")] == 1
    assert moving["false_commands"]["count"] == 1


@pytest.mark.slow
def test_evaluate_a_video(capsys: pytest.CaptureFixture[str], slideshow: Path, data_dir: Path) -> None:
    text = prints(capsys, "signs", "evaluate", str(slideshow))
    assert "False commands: 0 in 22.5 s, 0.0 per minute (0.0-9.8)" in text
    assert "slowest s" in text
    unlabelled = sorted((data_dir / "videos").glob("Coder*"))[0]
    assert "No labels to compare with." in prints(capsys, "signs", "evaluate", str(unlabelled))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["gone"], "there is no folder gone: give a folder of labelled photos or a video"),
        (["."], "no labels; expected an index.csv"),
        (["photo.jpg"], "photo.jpg is a photo: give the folder"),
        (["clip.mp4"], "clip.mp4 is not a video that can be decoded"),
        (["clip.avi", "--png", "x.png"], "--png: there are no labels for clip.avi"),
        (["clip.avi", "--sweep"], "--sweep needs photos or a dataset, not only videos"),
        (["clip.avi", "--reliability", "x.png"], "--reliability needs photos or a dataset"),
        (["clip.avi", "--reliability", "x.jpg"], "--reliability: x.jpg should be a file name that ends in .png"),
        ([], "there is nothing to evaluate: give folders of labelled photos, videos, or datasets"),
        ([".", "--rotate", "1;2"], "--rotate: '1;2' should be degrees, or several separated by commas, as -15,0,15"),
        ([".", "--rotate", "0,400"], "--rotate: 400 should be from -360 to 360 degrees"),
        ([".", "--rotate", "400"], "--rotate: 400 should be from -360 to 360 degrees"),
        ([".", "--rotate", "nan"], "--rotate: nan should be from -360 to 360 degrees"),
        ([".", "--grace", "-1"], "--grace: -1 should be from 0 to 10 seconds"),
        ([".", "--png", "x.jpg"], "--png: x.jpg should be a file name that ends in .png"),
        (
            [".", "--png", "gone/x.png"],
            "--png: gone/x.png should be a file name that ends in .png, in an existing folder",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_cannot_be_evaluated_gets_one_line(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    clip: Path,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(clip.parent)
    Path("clip.mp4").write_bytes(b"no video")
    if arguments[:1] == ["photo.jpg"]:
        Path("photo.jpg").write_bytes(b"no photo")
    assert message in fails(capsys, "signs", "evaluate", *arguments)


def test_list_says_what_each_sign_does(capsys: pytest.CaptureFixture[str]) -> None:
    actions = ["--control.actions.Peace", "turbo", "--control.actions.turn-left", "stop"]
    listed = {entry["sign"]: entry for entry in json.loads(prints(capsys, "signs", "list", "--json", *actions))}
    assert {sign: entry["action"] for sign, entry in listed.items()} == {
        "Stop": "stop",
        "Forward": "forward",
        "Backward": "backward",
        "Turn Right": "turn_right",
        "Turn Left": "stop",
        "Go": "go",
        "NONE": "stop",
        "Peace": "turbo",
    }
    assert [sign for sign, entry in listed.items() if not entry["known"]] == ["Peace"]
    text = prints(capsys, "signs", "list", *actions)
    assert (
        "Peace       turbo       twice as fast while shown, within the limits (up to 1 m/s) (unknown to the model)"
        in text
    )


def test_list_needs_no_landmark_models(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    assert "Backward" in prints(capsys, "signs", "list")


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--control.actions.Hi", "fly"], "control.actions.Hi: 'fly' should be 'forward'"),
        (["--control.actions.Stop", "forward"], "should leave Stop at 'stop', so that the robot can always be stopped"),
    ],
)
def test_an_action_that_cannot_be_is_refused(
    capsys: pytest.CaptureFixture[str], option: list[str], message: str
) -> None:
    assert message in fails(capsys, "signs", "list", *option)
