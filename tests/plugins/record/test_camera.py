from pathlib import Path

import numpy as np
import pytest

from handsteer.cameras import EndOfStream
from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config
from handsteer.errors import CameraUnreadable
from handsteer.graph import Graph
from handsteer.images import jpeg_picture
from handsteer.messages import HAND_SIGN, IMAGE_COMPRESSED
from handsteer.plugins.record.camera import RecordingCamera
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.replay.rerun import recorded_config, rerun
from tests.plugins.record.test_bags import as_ros1


def test_it_plays_the_recorded_pictures_at_their_rate(recording: Path) -> None:
    clock = SteppedClock()
    camera = RecordingCamera(recording, clock, at_end="end")
    assert camera.period_s == pytest.approx(1 / 30, rel=0.01)
    first = camera.read()
    assert first is not None
    original = next(McapFile(recording).messages({"/image_raw/compressed"})).message
    np.testing.assert_array_equal(first.image, jpeg_picture(original))
    for _ in range(240):
        assert camera.read() is not None
    with pytest.raises(EndOfStream):
        camera.read()


@pytest.mark.slow
def test_a_recording_of_a_camera_of_jpegs_has_the_cameras_own_files(recording: Path, tmp_path: Path) -> None:
    path = tmp_path / "again.mcap"
    camera = CameraConfig(source=str(recording), at_end="end")
    with Graph(Config(camera=camera), clock=SteppedClock()) as graph:
        graph.record(path)
        graph.run_stepped(3.0)
    first, again = (
        [recorded.message.data.tobytes() for recorded in McapFile(each).messages({IMAGE_COMPRESSED.name})]
        for each in (recording, path)
    )
    assert len(again) > 80
    assert again == first[: len(again)]
    assert not [result for result in rerun(McapFile(path), recorded_config(McapFile(path))) if result.differs]


def test_it_begins_again_or_holds(recording: Path) -> None:
    looping = RecordingCamera(recording, SteppedClock(), at_end="loop")
    assert all(looping.read() is not None for _ in range(300))
    holding = RecordingCamera(recording, SteppedClock(), at_end="hold")
    frames = [holding.read() for _ in range(243)]
    assert frames[240] is not None
    assert frames[241:] == [None, None]


@pytest.mark.slow
def test_a_graph_sees_the_recorded_signs_again(recording: Path, tmp_path: Path) -> None:
    config = Config(camera=CameraConfig(source=str(as_ros1(recording, tmp_path / "drive.bag")), at_end="end"))
    with Graph(config, SteppedClock()) as graph:
        graph.run_stepped()
        counts = graph.recognition.counts
    signs = [recorded.message.data for recorded in McapFile(recording).messages({HAND_SIGN.name})]
    for sign in ("Stop", "Forward", "Turn Left"):
        assert counts[sign] == pytest.approx(signs.count(sign), abs=3)


def test_without_pictures_it_is_refused(tmp_path: Path) -> None:
    McapWriter(tmp_path / "empty.mcap").close()
    with pytest.raises(CameraUnreadable, match="contains no pictures"):
        RecordingCamera(tmp_path / "empty.mcap", SteppedClock())
    (tmp_path / "text.mcap").write_text("no recording")
    with pytest.raises(CameraUnreadable, match="not an MCAP file"):
        RecordingCamera(tmp_path / "text.mcap", SteppedClock())
