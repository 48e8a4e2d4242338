import json
from pathlib import Path

import cv2
import pytest

from tests.cli.test_cli import fails, prints


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


def test_evaluate_prints_tables(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    png = few / "confusion.png"
    text = prints(capsys, "signs", "evaluate", str(few), "--png", str(png))
    assert "7 photos, and 0 that are not scored" in text
    for part in ("Recall", "False commands", "thumb_up", "Confusion", "Turn Left"):
        assert part in text
    assert min(cv2.imread(str(png)).shape[:2]) > 200


def test_evaluate_prints_json_and_flips_and_turns(capsys: pytest.CaptureFixture[str], few: Path) -> None:
    plain = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json"))
    assert plain["recall"]["Stop"]["count"] == 3
    assert plain["false_commands"]["kinds"] == {"thumb_up": {"count": 0, "of": 2, "rate": 0.0}}
    flipped = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json", "--flip"))
    assert flipped["recall"]["Turn Right"]["of"] == 2
    turned = json.loads(prints(capsys, "signs", "evaluate", str(few), "--json", "--rotate", "-90"))
    assert turned["recall"]["Turn Right"]["of"] == 2
    assert turned["false_commands"]["kinds"]["thumb_up"]["of"] == 2


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
    assert "False commands: 0 in 22.5 s, 0.0 a minute" in text
    assert "slowest s" in text
    unlabelled = sorted((data_dir / "videos").glob("Coder*"))[0]
    assert "There are no labels to compare with." in prints(capsys, "signs", "evaluate", str(unlabelled))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["gone"], "there is no folder gone: give a folder of labelled photos or a video"),
        (["."], "no labels; expected an index.csv"),
        (["photo.jpg"], "photo.jpg is a photo: give the folder"),
        (["clip.mp4"], "clip.mp4 is not a video that can be decoded"),
        (["clip.mp4", "--png", "x.png"], "--png: there are no labels for clip.mp4"),
        ([".", "--rotate", "400"], "--rotate: 400 should be from -360 to 360 degrees"),
        ([".", "--rotate", "nan"], "--rotate: nan should be from -360 to 360 degrees"),
        ([".", "--grace", "-1"], "--grace: -1 should be from 0 to 10 seconds"),
        ([".", "--png", "x.jpg"], "--png: x.jpg should be a file name that ends in .png"),
        ([".", "--png", "gone/x.png"], "--png: gone/x.png should be a file name that ends in .png, in a folder"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_cannot_be_evaluated_gets_one_line(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clip.mp4").write_bytes(b"no video")
    if arguments[0] == "photo.jpg":
        (tmp_path / "photo.jpg").write_bytes(b"no photo")
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
    assert "Peace       turbo       twice as fast while shown, within the limits (up to 1 m/s) (but the model" in text


def test_list_needs_no_landmark_models(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(tmp_path))
    assert "Backward" in prints(capsys, "signs", "list")


@pytest.mark.parametrize("verb", ["evaluate", "list"])
def test_help_has_an_example(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    assert f"Example: handsteer signs {verb}" in prints(capsys, "signs", verb, "--help")


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
