"""The programs and files that the pages show: each is run, or read by what reads it."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from handsteer import doors
from handsteer.config import load
from handsteer.nodes.status import ControlStatus, RecognitionStatus
from handsteer.plugins.study.plan import load_configs, load_courses, read_plan
from handsteer.plugins.teach.dataset import Dataset, save_dataset
from handsteer.plugins.teach.evaluation.labels import read_photo_labels, read_video_labels
from handsteer.robots.world import load_world
from handsteer.types import SIGNS
from tests.docs.pages import ROOT, Part, blocks, code
from tests.plugins.teach.takes import take

PYTHON_ELSEWHERE = {
    "README.md": "tests/test_readme.py",
    "plugins.md": "tests/test_doors.py",
    "teach.md": "tests/plugins/teach/test_onnx_file.py",
}
"""Pages with programs that need a camera, a distribution or a result of MediaPipe, and the test that runs them."""

PRINTS = {"api.md": "", "raspberry-pi.md": "", "dataset.md": "Peace me 12 (12, 21, 2)\n"}


@pytest.mark.parametrize("program", blocks("python"), ids=str)
def test_a_program_runs(program: Part, tmp_path: Path) -> None:
    elsewhere = PYTHON_ELSEWHERE.get(program.page.name)
    if elsewhere:
        assert program.page.name in (ROOT / elsewhere).read_text()
        compile(program.text, str(program), "exec")
        return
    save_dataset(Dataset((take("Peace", hands=12),)), tmp_path / "signs.npz")
    command = [sys.executable, "-c", program.text]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stderr, done.stdout) == ("", PRINTS[program.page.name])


@pytest.mark.parametrize("file", blocks("yaml"), ids=str)
def test_a_file_is_read_by_what_it_is_for(file: Part, tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    path.write_text(file.text)
    if file.page.name == "study.md":
        (tmp_path / "my-course.yaml").write_text(blocks_of("worlds.md")[0].text)
        plan = read_plan(path)
        assert len(load_configs(plan, path, {})) == 3
        assert list(load_courses(plan, path)) == ["slalom", "my-course.yaml"]
    elif file.page.name == "worlds.md":
        world = load_world(path)
        assert (len(world.obstacles), len(world.gates)) == (4, 2)
    elif "lifecycle_manager" in file.text:
        names = yaml.safe_load(file.text)["lifecycle_manager_hand_signs"]["ros__parameters"]["node_names"]
        assert names == [
            RecognitionStatus.node,
            ControlStatus.node,
        ]
    else:
        assert load(path) != load()


def blocks_of(page: str) -> list[Part]:
    """Return the YAML files of a page."""
    return [file for file in blocks("yaml") if file.page.name == page]


def test_labels_are_read_as_the_pages_write_them(tmp_path: Path) -> None:
    photos, frames = (block.text for block in blocks("csv"))
    (tmp_path / "index.csv").write_text(photos)
    for name in ("anna/001.jpg", "anna/002.jpg", "bob/003.jpg"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    read = [(each.truth, each.kind, each.person_set) for each in read_photo_labels(tmp_path, SIGNS)]
    assert read == [("Stop", "", "anna"), ("NONE", "thumb_up", "anna"), (None, "blurred", "bob")]
    (tmp_path / "drive.labels.csv").write_text(frames)
    assert read_video_labels(tmp_path / "drive.mp4", SIGNS) == {0: "NONE", 1: "NONE", 2: "Forward"}


def test_a_group_of_entry_points_is_a_door() -> None:
    (block,) = blocks("toml")
    groups = set(tomllib.loads(block.text)["project"]["entry-points"])
    groups |= {
        part.text for part in code(block.page) if re.fullmatch(r"handsteer\.(?!errors|testing)[a-z]+", part.text)
    }
    known = {door.group for door in vars(doors).values() if isinstance(door, doors.Door)}
    assert groups == known - {doors.RECORDERS.group, doors.COMPANIONS.group}


def test_an_extra_can_be_installed() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    texts = [part.text for part in (*code(), *blocks("sh"))]
    lists = [names for text in texts for names in re.findall(r"install ['\"]?(?:\.|handsteer)\[([\w,]+)\]", text)]
    assert len(lists) >= 8
    assert {name for names in lists for name in names.split(",")} <= set(project["optional-dependencies"])
