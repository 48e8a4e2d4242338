"""Another camera in a running graph: the robot stops, and moves again only after that camera has seen neutral."""

from concurrent.futures import Future
from pathlib import Path

import cv2
import pytest

from handsteer.cameras import VIRTUAL_HAND, choose
from handsteer.cameras.choice import OWN
from handsteer.clock import SteppedClock
from handsteer.config import Config, VirtualHandConfig
from handsteer.errors import CameraNotFound
from handsteer.graph import Graph
from handsteer.messages import CAMERA_CHANGED
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.replay.compare import Comparison, compare
from handsteer.plugins.record.replay.rerun import recorded_config, rerun
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.testing import Trace

RATE, SIZE = 15, (320, 240)
HAND = VirtualHandConfig(script="Forward:2 Stop:1 Forward:600")


@pytest.fixture(scope="module")
def forward(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return clip_of("Forward", tmp_path_factory.mktemp("clips"))


def clip_of(sign: str, folder: Path, *, mirrored: bool = False) -> Path:
    """Write a clip of a hand that shows ``sign``, and nothing else."""
    path, clock = folder / f"{sign}.avi", SteppedClock()
    config = VirtualHandConfig(script=f"{sign}:600")
    hand = VirtualHandCamera(config, width=SIZE[0], height=SIZE[1], fps=RATE, clock=clock)
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE, SIZE)
    clock.advance(2.0)  # the hand has come up
    for _ in range(RATE):
        clock.advance(1 / RATE)
        image = hand.read().image
        video.write(image[:, ::-1].copy() if mirrored else image)
    video.release()
    return path


class Drive:
    """A graph on stepped time whose named camera is a clip of Forward."""

    def __init__(self, clip: Path, record: Path | None = None, **sections: dict[str, object]) -> None:
        camera = {"source": str(clip), "width": SIZE[0], "height": SIZE[1], "fps": RATE}
        config = Config.model_validate(
            {"camera": camera, "virtual_hand": HAND, "robot": {"world": "empty"}, **sections}
        )
        self.graph = Graph(config, SteppedClock())
        self.trace = Trace(self.graph)
        self.graph.cameras.find()
        if record is not None:
            self.graph.record(str(record))

    def run(self, duration_s: float) -> list[float]:
        """Run for some seconds; return the commanded speeds."""
        before = len(self.trace.commands)
        self.graph.run_stepped(duration_s)
        return [speed for speed, _ in self.trace.commands[before:]]

    def choose(self, source: str) -> Future[None]:
        return self.graph.choose_camera(source)

    def drive_off(self) -> None:
        assert self.run(1.5)[-1] > 0.1


def test_the_robot_stops_at_once_and_waits_for_neutral_seen_by_the_other_camera(forward: Path) -> None:
    drive = Drive(forward)
    with drive.graph:
        drive.drive_off()
        done = drive.choose("virtual")
        frames = drive.graph.camera.frames
        assert set(drive.run(0.02)) == {0.0}
        assert drive.graph.camera.frames == frames, "before the other camera has delivered anything"
        assert set(drive.run(1.9)) == {0.0}, "the hand shows Forward, but was not seen at neutral"
        done.result(0)
        assert drive.graph.camera.frames > 40
        assert drive.run(2.5)[-1] > 0.1, "after it has shown Stop"
        drive.choose(OWN)
        assert set(drive.run(3.0)) == {0.0}, "the clip never shows neutral"
        assert drive.graph.cameras.name == str(forward)


def test_a_camera_that_fails_to_open_says_why_and_the_one_before_needs_neutral_too(
    forward: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(choose, "webcams", lambda: ["/dev/video97"])  # it was listed, and then unplugged
    drive = Drive(forward)
    with drive.graph:
        drive.drive_off()
        done = drive.choose("/dev/video97")
        assert set(drive.run(2.0)) == {0.0}
        with pytest.raises(CameraNotFound, match="there is no webcam /dev/video97"):
            done.result(0)
        assert (drive.graph.cameras.source, drive.graph.cameras.name) == (OWN, str(forward))
        assert drive.graph.camera.callback_errors == 0
        drive.choose("virtual").add_done_callback(lambda _: None)
        drive.run(0.5)
        assert drive.graph.cameras.name == VIRTUAL_HAND


@pytest.mark.slow
def test_a_recording_in_which_the_camera_changes_is_replayed_bit_for_bit(forward: Path, tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    drive = Drive(forward, path)
    with drive.graph:
        drive.drive_off()
        drive.choose("virtual")
        drive.run(4.0)
    file, comparison = McapFile(path), Comparison()
    assert list(compare(rerun(file, recorded_config(file)), comparison, file.began_s)) == []
    assert comparison.commands > 60
    assert [each.message.data for each in file.messages({CAMERA_CHANGED.name})] == [str(forward), VIRTUAL_HAND]


def test_a_camera_that_looks_the_way_the_driver_looks_turns_as_the_hand_shows(tmp_path: Path) -> None:
    drive = Drive(clip_of("Turn Left", tmp_path, mirrored=True))
    with drive.graph:
        drive.run(1.5)
        assert drive.trace.commands[-1][1] < -0.1, "left and right are mixed up"
        signs = drive.graph.config.signs.model_copy(update={"swap_sides": True})
        drive.graph.reconfigure(drive.graph.config.model_copy(update={"signs": signs}))
        assert set(drive.run(1.0)) == {0.0}
        assert drive.trace.commands[-1] == (0.0, 0.0), "neutral comes first"
    swapped = Drive(clip_of("Turn Left", tmp_path, mirrored=True), signs={"swap_sides": True})
    with swapped.graph:
        swapped.run(1.5)
        assert swapped.trace.commands[-1][1] > 0.1
