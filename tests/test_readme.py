"""The program of README.md is a whole one, and drives as it says."""

import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer import Recognizer
from handsteer.cameras.choose import open_camera
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, VirtualHandConfig
from handsteer.errors import CameraUnreadable

ROOT = Path(__file__).resolve().parents[1]
FPS = 30


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip of a hand that opens, closes and opens, and then points up."""
    path = tmp_path_factory.mktemp("clip") / "hand.mp4"
    script = VirtualHandConfig(script="Stop:1.2 Go:0.6 Stop:0.7 Forward:3")
    config, clock = Config(camera=CameraConfig(source="virtual"), virtual_hand=script), SteppedClock()
    camera = open_camera(config, clock)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), FPS, (640, 480))
    for _ in range(5 * FPS):
        frame = camera.read()
        assert frame is not None
        writer.write(frame.image)
        clock.advance(1 / FPS)
    writer.release()
    return path


@pytest.mark.slow
def test_the_program_drives_once_the_hand_has_engaged(video: Path) -> None:
    found = re.search(r"## In your own program.*?```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert found
    program = found[1].replace("VideoCapture(0)", 'VideoCapture("hand.mp4")')
    assert program != found[1]
    done = subprocess.run([sys.executable, "-c", program], cwd=video.parent, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 5 * FPS
    assert "open, close and open your hand to begin" in lines[0]
    assert "driving: Forward" in lines[-1]
    assert float(re.findall(r"linear_mps=([\d.]+)", lines[-1])[0]) > 0.3


def test_a_photo_is_recognised_by_its_path(video: Path, tmp_path: Path) -> None:
    capture = cv2.VideoCapture(str(video))
    images = [capture.read()[1] for _ in range(5 * FPS)]
    photo = tmp_path / "photo.jpg"
    cv2.imwrite(str(photo), np.asarray(images[-1]))
    recognizer = Recognizer()
    assert recognizer.recognize(str(photo)).sign == "Forward"
    assert recognizer.recognize(photo).sign == "Forward"
    with pytest.raises(CameraUnreadable, match=r"cannot read the photo .*gone\.jpg: No such file"):
        recognizer.recognize("gone.jpg")
