"""Each command of the pages that needs no robot, no person and no ROS works, on files of the names that it gives.

tests/test_commands.py runs those that drive.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, RobotConfig, VirtualHandConfig
from handsteer.graph import Graph
from handsteer.plugins.teach.dataset import Dataset, save_dataset
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.custom_signs import save_custom_model
from handsteer.recognition.landmark_models import models_dir
from tests.docs.pages import DOCS, ROOT, Part, blocks, code, commands, table, words
from tests.plugins.teach.takes import take
from tests.plugins.teach.test_exchange import row, written
from tests.plugins.teach.verbs.test_calibrate import dataset_of
from tests.recognition.models import model

ELSEWHERE = {
    "run": "tests/test_commands.py",
    "bench": "tests/plugins/bench/test_verb.py: takes minutes",
    "study examples/study.yaml --participant": "tests/plugins/page/test_study_in_browser.py: needs a person",
    "signs collect --label": "tests/plugins/teach/verbs/test_teach.py: needs a person",
    "signs calibrate": "tests/plugins/teach/verbs/test_calibrate.py: needs a person",
    "signs train": "tests/plugins/teach/verbs/test_teach.py: takes a minute",
    "doctor": "tests/cli/test_cli.py: depends on the machine",
    "replay drive.bag": "tests/plugins/record/replay/test_by_time.py: a bag of ROS 1",
    "zenoh-router": "tests/rmw_zenoh",
    **dict.fromkeys(
        ("camera", "recognition", "control", "robot", "robots", "steering", "record"), "tests/dds, ros1, ros2"
    ),
}
"""What is tested by others, by how it begins, and where."""

FROM_A_DRIVE = "signs collect --label NONE --from"
"""Begins as one of these, but needs no person."""


RECORDED_S = 33.0
"""As long as the moments that the pages name need."""


def words_of(part: Part) -> str:
    """Return the words of a command that follow its name, up to where its output goes."""
    return re.split(" > | >$", part.text.removeprefix("handsteer "))[0]


def is_here(command: str) -> bool:
    """Return whether this test gives ``command``."""
    if re.search("…|<|NAME", command):
        return False
    begins = (each.split() for each in ELSEWHERE)
    return command.startswith(FROM_A_DRIVE) or not any(command.split()[: len(each)] == each for each in begins)


MENTIONS = {part.text for part in code() if re.fullmatch(r"handsteer [a-z]+( [a-z]+)?", part.text)}
"""A verb in a sentence, of which the rest is left out; ``handsteer doctor`` needs no more, and so has ``--help``."""

HERE = sorted(filter(is_here, {words_of(part) for part in commands() if part.text not in MENTIONS}))


def photo(sign: str, seed: int) -> cv2.typing.MatLike:
    """Return a picture of the virtual hand that shows ``sign``."""
    config = VirtualHandConfig(script=f"{sign}:60", seed=seed)
    camera = VirtualHandCamera(config, width=640, height=480, fps=30, clock=SteppedClock())
    for _ in range(9):
        picture = camera.read().image
    return picture


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands name."""
    folder = tmp_path_factory.mktemp("files")
    for number, (place, sign) in enumerate(
        [("photos/stop", "Stop"), ("photos/forward", "Forward"), ("more/go", "Go"), ("photos/negatives/ok", "OK")]
    ):
        (folder / place).mkdir(parents=True)
        cv2.imwrite(str(folder / place / "1.jpg"), photo(sign, number))
    cv2.imwrite(str(folder / "photo.jpg"), photo("Forward", 1))
    for name in ("drive.mp4", "talk.mp4"):
        writer = cv2.VideoWriter(str(folder / name), cv2.VideoWriter.fourcc(*"mp4v"), 30, (640, 480))
        for number in range(9):
            writer.write(photo("Forward", number))
        writer.release()
    config = Config(
        camera=CameraConfig(fps=8),
        robot=RobotConfig(world="slalom"),
        virtual_hand=VirtualHandConfig(script="Stop:1 Forward:3"),
    )
    with Graph(config, SteppedClock()) as graph:
        graph.record(folder / "drive.mcap")
        graph.run_stepped(RECORDED_S)
    save_custom_model(model(), folder / "my-signs.npz")
    save_dataset(Dataset((take("Stop", hands=9), take("Forward", hands=9))), folder / "others.npz")
    save_dataset(Dataset((take("Peace", hands=9),)), folder / "signs.npz")
    written(folder / "keypoint.csv", row(2), row(3))
    (folder / "my.yaml").write_text("control: {max_linear: 0.5}\n")
    (folder / "examples").mkdir()
    shutil.copy(ROOT / "examples/study.yaml", folder / "examples")
    return folder


@pytest.fixture
def work(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the files, in which a command is given."""
    monkeypatch.setenv("HANDSTEER_MODELS", str(models_dir()))  # which are next to the profiles otherwise
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return Path(shutil.copytree(files, tmp_path / "work"))


def run(command: str, work: Path, *, only_output: bool = False) -> str:
    """Give a command of handsteer; return what it prints."""
    words = [sys.executable, "-m", "handsteer", *shlex.split(command, comments=True)]
    done = subprocess.run(words, cwd=work, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout if only_output else done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", HERE)
def test_a_command_works(command: str, work: Path) -> None:
    if "--signs.profile anna" in command:
        run(f"signs calibrate --name anna --from {dataset_of(5, 0, work / 'shown.npz')}", work)
    assert run(command, work)
    for name in re.findall(r"(?:--(?:png|reliability|sweep-png)|export \S+) (\S+)", command):
        assert (work / name).stat().st_size > 0


@pytest.mark.slow
def test_output_is_as_recordings_shows_it(work: Path) -> None:
    """The line of a replay with its figures, and each total of a report."""
    shown = [block.text for block in blocks("") if block.page.name == "recordings.md"]
    (replayed,) = (text for text in shown if text.startswith("replayed"))
    assert without_figures(replayed) in without_figures(run("replay drive.mcap", work))
    (totals,) = (text for text in shown if text.startswith("Recorded"))
    printed = run("report drive.mcap", work)
    labels = [line.partition(":")[0] for line in totals.splitlines()[1:]]
    assert [each for each in labels if each not in STEPPED] == re.findall(r"^([a-z ]+): ", printed, re.MULTILINE)


COMPLETIONS = [words(row[1])[0] for row in table(DOCS / "shell.md", "shell | command | takes effect")]


@pytest.mark.slow
@pytest.mark.parametrize("command", COMPLETIONS)
def test_a_completion_is_written_in_an_empty_home(command: str, tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "handsteer"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m handsteer "$@"\n')
    program.chmod(0o755)
    env = {**os.environ, "HOME": str(tmp_path), "PATH": f"{program.parent}:{os.environ['PATH']}"}
    subprocess.run(["sh", "-c", command], env=env, check=True)
    file = tmp_path / command.rpartition("~/")[2]
    assert "handsteer" in file.read_text()


@pytest.mark.slow
def test_the_json_of_an_evaluation_has_the_names_of_the_page(work: Path) -> None:
    (work / "drive.labels.csv").write_text("frame,sign\n0,Forward\n")
    sources = "photos/ more/ drive.mp4 --sweep --rotate 0,180"
    found = json.loads(run(f"signs evaluate {sources} --json", work, only_output=True))
    rows = table(DOCS / "signs-evaluate.md", "name | meaning")
    documented = [name.rstrip("…") for row in rows for name in words(" ".join(row)) if re.fullmatch(r"\w+…?", name)]
    assert [name for name in found if not name.startswith(tuple(documented))] == []
    everywhere = " ".join(names(found))
    assert [name for name in documented if name not in everywhere] == []


def names(value: Any) -> Iterator[str]:
    """Return the names of all fields, also of objects within."""
    if isinstance(value, dict):
        for name, within in value.items():
            yield name
            yield from names(within)
    elif isinstance(value, list):
        for within in value:
            yield from names(within)


STEPPED = ("latency",)
"""Left out of the report on a run in stepped time, in which nothing takes time."""


def without_figures(text: str) -> str:
    """Return ``text`` with # for each number."""
    return re.sub(r"\d[\d.]*", "#", text)


def test_nothing_is_said_to_be_tested_elsewhere_that_is_not_in_the_pages() -> None:
    texts = [part.text.removeprefix("handsteer ") for part in commands()]
    assert [begin for begin in ELSEWHERE if not any(text.startswith(begin) for text in texts)] == []
