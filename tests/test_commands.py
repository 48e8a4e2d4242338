"""Each command of README.md and docs that promises a drive does drive, without a window and in stepped time."""

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

from handsteer.cameras.choose import open_camera
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, VirtualHandConfig
from handsteer.graph import Graph
from handsteer.recognition.custom_signs import save_custom_model
from tests.docs import pages
from tests.recognition.models import model

SCRIPT = VirtualHandConfig(script="Stop:1 Forward:3 Go:1")
FPS, VIDEO_S, DRIVE_S, LEAST_M = 30, 5, 8, 0.1

ELSEWHERE = {
    "--camera 0": "tests/cameras: a webcam",
    "--camera rtsp:": "tests/cameras: a stream of the network",
    "--camera tcp:": "tests/cameras/test_webcam.py: the JPEGs of a camera program",
    "--camera browser": "tests/plugins/page/test_webcam.py and test_first_visit_in_browser.py",
    "--robot turtlebot4": "tests/ros2 and tests/dds: a robot of ROS 2",
    "--robot ros2": "tests/ros2: a robot of ROS 2",
    "--robot auto": "tests/dds: a robot of ROS 2",
    "--robot dds": "tests/dds: a robot of ROS 2",
    "--robot ros1": "tests/ros1: a robot of ROS 1",
    "--robot printer": "tests/test_doors.py: a robot of a plug-in",
    "--signs.profile": "tests/plugins/teach/verbs/test_calibrate.py: a profile that a person has made",
    "--dashboard.certificate": "tests/plugins/page/test_access.py: the page by https",
    "--transport": "tests/ros1, tests/ros2, tests/dds, tests/zenoh: nodes of a ROS graph",
    "--foxglove": "tests/plugins/foxglove: other programs show and steer",
}
"""What needs more than this machine, and where it is tested."""


def commands() -> list[str]:
    """Return each command ``handsteer run`` of the pages, in their blocks and in running text, once."""
    parts = [part.text.replace("--world …", "--world slalom") for part in pages.commands()]
    parts = [part for part in parts if part.startswith("handsteer run")]
    assert len(parts) > 20, "the pages have more commands than that"
    return list({each: shlex.join(shlex.split(each, comments=True)) for each in parts}.values())


FRAGMENTS = ("…", "--world", "--foxglove")
"""Ends of commands that a sentence only begins."""

DRIVING = [
    each
    for each in commands()
    if not any(option in each for option in ELSEWHERE) and not each.rstrip("'").endswith(FRAGMENTS)
]


def picture_files(folder: Path) -> None:
    """Write ``drive.mp4`` and ``photos/``: the virtual hand shows signs that drive."""
    clock = SteppedClock()
    camera = open_camera(Config(camera=CameraConfig(source="virtual"), virtual_hand=SCRIPT), clock)
    writer = cv2.VideoWriter(str(folder / "drive.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), FPS, (640, 480))
    (folder / "photos").mkdir()
    for number in range(VIDEO_S * FPS):
        frame = camera.read()
        assert frame is not None
        writer.write(frame.image)
        if number in (FPS // 2, 2 * FPS):
            cv2.imwrite(str(folder / f"photos/{number:03d}.jpg"), frame.image)
        clock.advance(1 / FPS)
    writer.release()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands name: a video, photos, a recording, models of taught signs."""
    folder = tmp_path_factory.mktemp("files")
    picture_files(folder)
    with Graph(Config(virtual_hand=SCRIPT), SteppedClock()) as graph:
        graph.record(folder / "drive.mcap")
        graph.run_stepped(VIDEO_S)
    for name in ("my-signs.npz", "handsteer-signs.npz"):
        save_custom_model(model(), folder / name)
    (folder / "my.yaml").write_text("control: {max_linear: 0.5}\n")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("command", DRIVING)
def test_a_command_of_the_documentation_drives(command: str, files: Path, tmp_path: Path) -> None:
    words = shlex.split(command)[1:]
    work = tmp_path / "work"
    shutil.copytree(files, work)
    if "--record" in words:
        (work / words[words.index("--record") + 1]).unlink(missing_ok=True)
    if "--camera" not in words:
        words += ["--camera", "virtual"]  # a webcam of the machine that tests shows nothing
    options = [each for each in ("--headless", "--fast", "--json") if each not in words]
    if "--duration" in words:
        at = words.index("--duration")
        del words[at : at + 2]
    done = subprocess.run(
        [sys.executable, "-m", "handsteer", *words, *options, "--duration", str(DRIVE_S)],
        cwd=work,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["path_length_m"] > LEAST_M


def test_what_is_tested_elsewhere_is_still_in_the_pages() -> None:
    text = " ".join([*commands(), *map(pages.text_of, pages.PAGES)])
    assert [option for option in ELSEWHERE if option not in text] == []
