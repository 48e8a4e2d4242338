"""The signs are calibrated from the command line, as its users do."""

import json
from pathlib import Path

import pytest

from handsteer.cli import main
from handsteer.plugins.teach.dataset import Dataset, Take, load_dataset, save_dataset
from handsteer.recognition.landmark_models import models_dir
from handsteer.recognition.profile import load_profile, profiles_dir
from handsteer.types import FORWARD, GO, SIGNS, STOP
from tests.cli.test_cli import fails, prints
from tests.recognition.odd_person import odd_hands


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HANDSTEER_MODELS", str(models_dir()))  # which are beside the profiles otherwise
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def dataset_of(count: int, seed: int, path: Path) -> str:
    takes = [
        Take(sign, "odd", "today", "made up", tuple(hands), tuple(float(at) for at in range(count)))
        for sign, hands in odd_hands(count, seed).items()
    ]
    save_dataset(Dataset(tuple(takes)), path)
    return str(path)


def test_a_profile_that_is_there_keeps_the_signs_that_are_not_shown_again(capsys: pytest.CaptureFixture[str]) -> None:
    whole = dataset_of(5, 0, Path("whole.npz"))
    prints(capsys, "signs", "calibrate", "--from", whole, "--out", "mine.npz")
    before = load_profile(Path("mine.npz"))
    part = Dataset(tuple(take for take in load_dataset(Path(whole)).takes if take.label == STOP))
    save_dataset(part, Path("part.npz"))
    prints(capsys, "signs", "calibrate", "--from", "part.npz", "--out", "mine.npz")
    after = load_profile(Path("mine.npz"))
    assert set(after.views) == set(before.views) == set(SIGNS)
    assert after.reach[GO] == before.reach[GO]


@pytest.mark.slow
def test_a_profile_is_made_from_a_dataset_and_used_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    shown = dataset_of(5, 0, Path("shown.npz"))
    judged = dataset_of(20, 1, Path("judged.npz"))
    with pytest.raises(SystemExit):
        main(["signs", "calibrate", "--name", "odd one", "--from", shown])
    text, said = capsys.readouterr()
    assert "drive with --signs.profile 'odd one'\n" in said
    assert "with the profile" in text.splitlines()[0]
    assert text.splitlines()[1].split()[:2] == [STOP, "5"]
    assert load_profile(profiles_dir() / "odd one.npz").name == "odd one"
    right = {}
    for profile in ([], ["--signs.profile", "odd one"]):
        report = json.loads(prints(capsys, "signs", "evaluate", judged, "--json", *profile))
        right[bool(profile)] = sum(report["recall"][sign]["count"] for sign in SIGNS)
    assert 120 - right[True] <= (120 - right[False]) / 2
    found = json.loads(prints(capsys, "signs", "calibrate", "--from", shown, "--out", "mine.npz", "--json"))
    assert (found["profile"], [each["sign"] for each in found["signs"]]) == ("mine.npz", list(SIGNS))
    assert load_profile(Path("mine.npz")).name == "me"


@pytest.mark.slow
def test_the_camera_asks_for_each_sign_and_says_which_was_not_shown(capsys: pytest.CaptureFixture[str]) -> None:
    camera = ["--camera", "virtual", "--camera.width", "320", "--camera.height", "240"]
    camera += ["--virtual-hand.script", "Forward:600"]
    quick = ["--hands", "right", "--seconds", "2", "--countdown", "0.1"]
    assert prints(capsys, "signs", "calibrate", "--out", "mine.npz", *camera, *quick)
    profile = load_profile(Path("mine.npz"))
    assert set(profile.views) == {FORWARD}
    assert profile.made["signs"][STOP]["why_not"].startswith("it is read as Forward: hold your palm to the camera")


@pytest.mark.slow
def test_of_a_file_that_ends_what_was_shown_is_used(capsys: pytest.CaptureFixture[str]) -> None:
    prints(capsys, "run", "--headless", "--camera", "virtual", "--duration", "8", "--record", "drive.mcap", "--fast")
    file = ["--camera", "drive.mcap", "--camera.at-end", "end"]
    quick = ["--hands", "right", "--seconds", "2", "--countdown", "0.1"]
    with pytest.raises(SystemExit):
        main(["signs", "calibrate", "--out", "mine.npz", *file, *quick])
    assert "the camera's file has ended; the signs that were shown so far are used\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--name", "../me"], "'../me' is not a valid name for a profile"),
        (["--hands", "foot"], "--hands: 'foot' should be left, right, or left,right"),
        (["--seconds", "nan"], "--seconds: nan should be from 0.2 to 30"),
        (["--countdown", "31"], "--countdown: 31 should be from 0 to 30 seconds"),
        (["--out", "nowhere/me.npz"], "--out: there is no folder"),
        (["--out", "empty.npz"], "--out: empty.npz exists, and is not such a file: give another name, or move it away"),
        (["--from", "empty.npz", "--camera", "virtual"], "give either --from or --camera"),
        (["--from", "empty.npz"], "empty.npz: none of its hands shows one of Stop, Forward"),
        (
            ["--from", "nowhere"],
            "there is no folder nowhere: give a folder of labelled photos or a dataset",
        ),
        (["--from", __file__], "test_calibrate.py is a file: give a folder of labelled photos or a dataset (.npz)"),
    ],
)
def test_wrong_options(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    save_dataset(Dataset(), Path("empty.npz"))
    assert message in fails(capsys, "signs", "calibrate", *arguments)


def test_a_folder_of_profiles_that_cannot_be_made_ends_before_signs_are_asked_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", "/proc")
    said = fails(capsys, "signs", "calibrate", "--camera", "virtual")
    assert said.startswith("cannot make the folder of profiles /proc/handsteer/profiles: ")


def test_a_profile_that_is_missing_ends_the_start(capsys: pytest.CaptureFixture[str]) -> None:
    assert "cannot read the profile of the signs" in fails(capsys, "signs", "list", "--signs.profile", "anna")
