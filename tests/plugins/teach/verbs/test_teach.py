"""A sign is taught from the command line, as its users do."""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.cli import main
from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.teach.dataset import Dataset, load_dataset, save_dataset
from handsteer.plugins.teach.onnx_file import as_onnx
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.custom_signs import save_custom_model
from handsteer.recognition.hand import Hand
from tests.cli.test_cli import fails, prints
from tests.plugins.teach.takes import takes
from tests.plugins.teach.test_exchange import row, written
from tests.recognition.models import model

VIRTUAL = [
    "--camera",
    "virtual",
    "--camera.width",
    "320",
    "--camera.height",
    "240",
    "--virtual-hand.script",
    "Peace:60",
]
QUICK = ["--takes", "2", "--take-time", "0.6", "--countdown", "0.1"]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def peace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video of the virtual hand: 15 s of peace signs, a little different each time."""
    path = tmp_path_factory.mktemp("videos") / "peace.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (320, 240))
    clock = SteppedClock()
    for hand in ("Right", "Left", "Right"):
        config = VirtualHandConfig(script="Peace:60", handedness=hand, seed=len(hand))
        camera = VirtualHandCamera(config, width=320, height=240, fps=10, clock=clock)
        for _ in range(50):
            writer.write(camera.read().image)
            clock.advance(0.1)
    writer.release()
    return path


@pytest.mark.slow
def test_takes_are_collected_live_and_undone(capsys: pytest.CaptureFixture[str]) -> None:
    text = prints(capsys, "signs", "collect", "--label", "Peace", *VIRTUAL, *QUICK, "--person", "Ann")
    assert text.splitlines()[0].split() == ["sign", "takes", "hands", "persons"]
    data = load_dataset(Path("signs.npz"))
    assert [(take.label, take.person, take.source) for take in data.takes] == [("Peace", "Ann", "virtual")] * 2
    assert prints(capsys, "signs", "collect", "--undo").splitlines()[1].split()[:2] == ["Peace", "1"]
    prints(capsys, "signs", "collect", "--undo")
    assert "there is no take to undo" in fails(capsys, "signs", "collect", "--undo")


@pytest.mark.slow
def test_takes_are_as_recognition_sees_them_with_swapped_sides(capsys: pytest.CaptureFixture[str], peace: Path) -> None:
    def hands(*options: str) -> list[Hand]:
        prints(capsys, "signs", "collect", "--label", "Peace", "--dataset", "some.npz", *options)
        dataset = load_dataset(Path("some.npz"))
        Path("some.npz").unlink()
        return [hand for take in dataset.takes for hand in take.hands]

    swapped = ["--signs.swap-sides", "true"]
    assert {hand.handedness for hand in hands(*VIRTUAL, *QUICK)} == {"Right"}
    assert {hand.handedness for hand in hands(*VIRTUAL, *QUICK, *swapped)} == {"Left"}
    plain, other = hands("--camera", str(peace)), hands("--camera", str(peace), *swapped)
    assert len(plain) == len(other) > 100
    assert all(np.allclose(b.pixels[:, 0], 320 - a.pixels[:, 0], atol=0.1) for a, b in zip(plain, other, strict=True))


@pytest.mark.slow
def test_a_new_sign_is_taught_from_a_video_and_drives(capsys: pytest.CaptureFixture[str], peace: Path) -> None:
    text = prints(capsys, "signs", "collect", "--label", "peace sign", "--camera", str(peace))
    assert text.splitlines()[1].split()[:3] == ["peace", "sign", "5"]
    report = json.loads(prints(capsys, "signs", "train", "--json", "--output", "mine.npz"))
    assert report["signs"][0]["recall"]["rate"] >= 0.95
    model = ["--signs.model", "mine.npz"]
    listed = json.loads(prints(capsys, "signs", "list", "--json", *model, "--control.actions.peace-sign", "forward"))
    assert {entry["sign"]: entry["action"] for entry in listed}["peace sign"] == "forward"
    run = ["run", "--fast", "--json", "--duration", "3", *VIRTUAL]
    still = json.loads(prints(capsys, *run))
    assert still["path_length_m"] < 0.01
    driven = json.loads(prints(capsys, *run, *model, "--control.actions.peace sign", "forward"))
    assert driven["final_pose"]["x"] > 0.3
    assert driven["signs"]["peace sign"] > 60


@pytest.mark.slow
def test_a_dataset_is_evaluated(capsys: pytest.CaptureFixture[str]) -> None:
    save_dataset(Dataset((*takes("Forward", count=2), *takes("NONE", "Call", count=1))), Path("some.npz"))
    plain = json.loads(prints(capsys, "signs", "evaluate", "some.npz", "--json"))
    assert plain["recall"]["Forward"]["rate"] > 0.95
    mine = plain["false_commands"]["kinds"]["me"]
    assert (mine["count"], mine["of"], mine["rate"]) == (0, 90, 0.0)
    assert (
        json.loads(prints(capsys, "signs", "evaluate", "some.npz", "--json", "--flip"))["recall"]["Forward"]["rate"]
        > 0.95
    )
    turned = json.loads(prints(capsys, "signs", "evaluate", "some.npz", "--json", "--rotate", "180"))
    assert turned["recall"]["Backward"]["rate"] > 0.95
    assert "270 hands, 0 not scored" in prints(capsys, "signs", "evaluate", "some.npz")


def test_rows_of_others_are_imported(capsys: pytest.CaptureFixture[str]) -> None:
    written(Path("key.csv"), *[row(1)] * 3, *[row(2, "Stop")] * 2)
    prints(capsys, "signs", "import", "key.csv", "--labels", "1=Point", "2=NONE")
    written(Path("names.txt"), "Nothing", "point")
    prints(capsys, "signs", "import", "key.csv", "--labels", "names.txt", "--person", "Ann")
    data = load_dataset(Path("signs.npz"))
    assert [(take.label, take.person, len(take.hands)) for take in data.takes] == [
        ("Point", "key", 3),
        ("NONE", "key", 2),
        ("Point", "Ann", 3),
    ]


def test_a_label_is_one_sign_in_whatever_unicode_form_it_is_typed(capsys: pytest.CaptureFixture[str]) -> None:
    written(Path("key.csv"), row(1))
    prints(capsys, "signs", "import", "key.csv", "--labels", "1=Cafe\u0301")
    prints(capsys, "signs", "import", "key.csv", "--labels", "1=caf\u00e9")
    assert [take.label for take in load_dataset(Path("signs.npz")).takes] == ["Caf\u00e9"] * 2


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("zero=P", "--labels: 'zero=P' should be the number of a class and its sign, each once, as 3=OK"),
        ("7=P", "key.csv: there is no row of class 7"),
    ],
)
def test_a_label_that_no_row_has_is_refused(capsys: pytest.CaptureFixture[str], label: str, message: str) -> None:
    written(Path("key.csv"), row(1))
    assert message in fails(capsys, "signs", "import", "key.csv", "--labels", label, "1=Q")
    assert not Path("signs.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["collect"], "--label is missing: name the sign, as in --label Hi"),
        (["collect", "--label", ""], "'' is not a valid name for a sign"),
        (["collect", "--label", "Hi", "--takes", "0"], "--takes: 0 should be from 1 to 1000"),
        (["collect", "--label", "Hi", "--take-time", "nan"], "--take-time: nan should be from 0.2 to 60 seconds"),
        (["collect", "--label", "Hi", "--countdown", "-1"], "--countdown: -1 should be from 0 to 60 seconds"),
        (["collect", "--label", "Hi", "--dataset", "gone/x.npz"], "--dataset: there is no folder"),
        (["collect", "--label", "Hi", "--dataset", "bad.npz"], "bad.npz: not a dataset of signs, or damaged"),
        (["collect", "--label", "Hi", "--camera", "gone.mp4"], "there is no camera gone.mp4"),
        (["collect", "--label", "Hi", "--camera", "virtual", "--hold"], "--hold needs a terminal to read keys from"),
        (["import", "gone.csv", "--labels", "1=Hi"], "cannot read the keypoints gone.csv"),
        (["import", "bad.npz", "--labels", "1=Hi", "2"], "--labels: '2' should be the number of a class and its sign"),
        (["import", "bad.npz", "--labels", "--dataset", "r.npz"], "--labels needs a value: the number of a class and"),
        (["import", "bad.npz", "--labels", "gone.txt"], "cannot read the names of the classes gone.txt"),
        (["train"], "cannot read the dataset of signs signs.npz (No such file or directory)"),
        (["train", "bad.npz"], "bad.npz: not a dataset of signs, or damaged"),
        (["train", "bad.npz", "--output", "gone/x.npz"], "--output: there is no folder"),
        (["collect", "--label", "Hi", "--from", "a.mcap"], "--from needs --at and --at needs --from"),
        (
            ["collect", "--label", "Hi", "--from", "a.mcap", "--at", "--dataset", "r.npz"],
            "--at needs a value: the seconds of each moment, as in --at 12.4",
        ),
        (["train", "hi.npz", "--sided", "--output", "r.npz"], "--sided needs a value: the signs, as in --sided Hi"),
        (["collect", "--label", "Hi", "--from", "a.mcap", "--at", "x"], "--at: 'x' should be a time in seconds"),
        (["collect", "--label", "Hi", "--from", "a.mcap", "--at", "1"], "there is no recording a.mcap"),
        (["evaluate", "hi.npz"], "the sign 'Hi' is not known; the signs are Stop, Forward"),
        (["evaluate", "gone.npz"], "cannot read the dataset of signs gone.npz"),
        (["export", "gone.npz", "mine.onnx"], "cannot read the model of taught signs gone.npz"),
        (["export", "bad.npz", "mine.onnx"], "bad.npz: not a model of taught signs, or damaged"),
        (["export", "hi.npz", "mine.onnx"], "hi.npz: a damaged model of taught signs, or another file: there is no "),
        (["export", "hi.npz", "bad.npz"], "bad.npz exists already: give another name, nothing is overwritten"),
        (["export", "hi.npz", "gone/mine.onnx"], "OUTPUT: there is no folder"),
        (["export", "hi.npz"], "OUTPUT"),
        (["train", "hi.npz", "--output", "hi.npz"], "--output: hi.npz exists, and is not such a file"),
        (
            ["collect", "--undo", "--label", "Hi", "--dataset", "hi.npz"],
            "--undo removes the last take, whatever its sign",
        ),
        (["list", "--signs.model", "hi.npz"], "hi.npz: a damaged model of taught signs, or another file: there is no "),
        (["list", "--signs.model", "bad.npz"], "bad.npz: not a model of taught signs, or damaged"),
        (["list", "--signs.model", "gone.npz"], "cannot read the model of taught signs gone.npz"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_cannot_be_done_gets_one_line_and_leaves_files_as_they_are(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    Path("bad.npz").write_bytes(b"no dataset")
    save_dataset(Dataset(tuple(takes("Hi", "Peace", count=1))), Path("hi.npz"))
    before = Path("hi.npz").read_bytes()
    assert message in fails(capsys, "signs", *arguments)
    assert Path("bad.npz").read_bytes() == b"no dataset"
    assert Path("hi.npz").read_bytes() == before
    assert sorted(path.name for path in Path().iterdir()) == ["bad.npz", "hi.npz"]


@pytest.mark.slow
def test_an_action_of_a_sign_that_nobody_knows_is_warned_of(
    caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    prints(capsys, "run", "--fast", "--duration", "0.2", *VIRTUAL, "--control.actions.Hi", "turbo")
    assert "control.actions: the sign Hi is not known; the signs are Stop" in caplog.text


def test_what_cannot_be_written_is_said_before_the_work(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for verb in (["collect", "--label", "Hi", "--dataset"], ["train", "--output"]):
        assert f"{tmp_path} is a folder: give the name of a file" in fails(capsys, "signs", *verb, str(tmp_path))
        assert "cannot write /proc/my.npz: " in fails(capsys, "signs", *verb, "/proc/my.npz")
    assert "cannot write /proc/my.onnx: " in fails(capsys, "signs", "export", "gone.npz", "/proc/my.onnx")


def test_a_model_is_exported(capsys: pytest.CaptureFixture[str]) -> None:
    save_custom_model(model(), Path("mine.npz"))
    with pytest.raises(SystemExit) as ended:
        main(["signs", "export", "mine.npz", "mine.onnx"])
    assert ended.value.code == 0
    assert capsys.readouterr().err == "handsteer: Hi, Ho: as ONNX in mine.onnx\n"
    assert Path("mine.onnx").read_bytes() == as_onnx(model())


def test_without_the_package_onnx_it_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    monkeypatch.delitem(sys.modules, "handsteer.plugins.teach.onnx_file", raising=False)
    said = fails(capsys, "signs", "export", "mine.npz", "mine.onnx")
    pip = f"{sys.executable} -m pip install"
    assert said.startswith(f"the export as ONNX needs the package onnx: run {pip} 'onnx")


def test_photos_without_a_hand_are_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    config = VirtualHandConfig(script="Peace:60")
    camera = VirtualHandCamera(config, width=320, height=240, fps=10, clock=SteppedClock())
    cv2.imwrite(str(tmp_path / "hand.png"), camera.read().image)
    for name in ("grey", "white"):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.full((240, 320, 3), 128 if name == "grey" else 255, np.uint8))
    with pytest.raises(SystemExit):
        main(["signs", "collect", "--label", "Hi", "--camera", str(tmp_path)])
    said = capsys.readouterr().err
    assert f"no hand was found in 2 photos, which were left out: {tmp_path}/grey.png, {tmp_path}/white.png" in said
