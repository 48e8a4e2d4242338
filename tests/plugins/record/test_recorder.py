import json
import resource
import signal
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from handsteer.clock import RealClock, SteppedClock
from handsteer.config import CollisionMonitorConfig, Config, VirtualHandConfig
from handsteer.errors import RecordingError
from handsteer.graph import Graph
from handsteer.messages import HAND_SIGN, SCAN, Header, LaserScan, Time
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.recorder import GraphRecorder
from handsteer.transports.in_process import InProcessTransport

EVERY_FRAME = ("/image_raw/compressed", "/camera_info", "/gesture/hand_sign", "/gesture/joy")
OTHERS = (
    "/robot_diff_drive_controller/cmd_vel",
    "/robot_diff_drive_controller/odom",
    "/tf",
    "/joint_states",
    "/world/markers",
    "/audit",
    "/diagnostics",
    "/robot_description",
)


def test_every_topic_is_recorded_and_every_frame_in_it(recording: Path) -> None:
    counts = Counter(recorded.topic for recorded in McapFile(recording).messages())
    assert {counts[topic] for topic in EVERY_FRAME} == {241}
    assert all(counts[topic] for topic in OTHERS)


def test_the_readers_of_others_read_every_message_of_every_topic(recording: Path) -> None:
    ours = Counter((recorded.topic, recorded.type) for recorded in McapFile(recording).messages())
    with recording.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        theirs: Counter[tuple[str, str]] = Counter()
        signs = []
        for schema, channel, _, message in reader.iter_decoded_messages():
            assert schema is not None
            theirs[channel.topic, schema.name] += 1
            if channel.topic == HAND_SIGN.name:
                signs.append(message.data)
    assert theirs == ours
    with AnyReader([recording]) as bag:
        read: Counter[tuple[str, str | None]] = Counter()
        for connection, _, raw in bag.messages():
            bag.deserialize(raw, connection.msgtype)
            read[connection.topic, connection.msgtype] += 1
    assert read == ours
    assert {"Stop", "Forward", "Go", "Turn Left"} <= set(signs)


def test_it_says_what_made_it(recording: Path) -> None:
    about = McapFile(recording).about
    assert Config.model_validate_json(about["config"]).virtual_hand.script.startswith("Stop:1")
    assert len(about["model hand_landmark_fast.tflite"]) == 64
    assert json.loads(about["config"])["robot"]["kind"] == "sim"


def test_nothing_is_overwritten(recording: Path) -> None:
    before = recording.read_bytes()
    with Graph(Config(), SteppedClock()) as graph, pytest.raises(RecordingError, match="exists already"):
        graph.record(recording)
    assert recording.read_bytes() == before


@pytest.mark.parametrize("enabled", [False, True])
def test_laser_scans_of_a_graph_are_recorded_where_they_are_used(tmp_path: Path, enabled: bool) -> None:
    transport, path = InProcessTransport(), tmp_path / "graph.mcap"
    config = Config(collision_monitor=CollisionMonitorConfig(enabled=enabled))
    recorder = GraphRecorder(path, transport, RealClock(), config)
    ones = np.ones(2, np.float32)
    scan = LaserScan(Header(Time(0, 0), "laser"), 0.0, 1.0, 1.0, 0.0, 0.1, 0.1, 9.0, ones, ones)
    transport.advertise("robot", SCAN).publish(scan)
    recorder.close()
    assert [recorded.topic for recorded in McapFile(path).messages()] == ["/scan"] * enabled


def test_one_recording_at_a_time(tmp_path: Path) -> None:
    with Graph(Config(), SteppedClock()) as graph:
        graph.record(tmp_path / "a.mcap")
        with pytest.raises(RecordingError, match=r"a\.mcap is being recorded"):
            graph.record(tmp_path / "b.mcap")
        graph.end_recording()
        graph.record(tmp_path / "b.mcap")
    assert McapFile(tmp_path / "b.mcap").problem is None


@pytest.mark.slow
def test_a_full_disk_ends_the_recording_and_driving_goes_on(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    # The largest size of a file stands for a full disk: the write fails in the middle.
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    path = tmp_path / "drive.mcap"
    with Graph(Config(virtual_hand=VirtualHandConfig(script="Stop:1 Forward:3")), SteppedClock()) as graph:
        graph.record(path)
        while path.stat().st_size < 700_000:  # chunks are written by real time
            graph.run_stepped(0.5)
        before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 100_000, limits[1]))
        try:
            graph.run_stepped(4.0)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            signal.signal(signal.SIGXFSZ, before)
        assert graph.recognition.counts["Forward"] > 60
        assert graph.robot.path_length_m > 0.3
    (line,) = [text for text in caplog.messages if "recording" in text]
    assert "File too large; driving goes on" in line
    file = McapFile(path)
    assert sum(recorded.topic == HAND_SIGN.name for recorded in file.messages()) > 30
    assert "cut off" in str(file.problem)


def test_what_was_cut_is_read_without_the_rest(recording: Path, tmp_path: Path) -> None:
    whole = [recorded.raw for recorded in McapFile(recording).messages()]
    content = recording.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    file = McapFile(cut)
    part = [recorded.raw for recorded in file.messages()]
    assert 0.3 * len(whole) < len(part) < 0.7 * len(whole)
    assert whole[: len(part)] == part
    assert file.problem == f"it was cut off or damaged after {_last_whole(file)} of {len(content) // 2} bytes"


def _last_whole(file: McapFile) -> str:
    return str(file.problem).split(" after ")[1].split(" ")[0]


@pytest.mark.parametrize("name", ["missing.mcap", "folder", "text.mcap"])
def test_what_is_no_recording_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "text.mcap").write_text("this is a text\n" * 10)
    with pytest.raises(RecordingError, match=name):
        McapFile(tmp_path / name)


def test_a_folder_that_cannot_be_written_to(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot record to"):
        McapWriter(tmp_path / "missing" / "drive.mcap")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_disk_that_is_full_at_the_start_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "drive.mcap"
    opened = Path.open

    def on_a_full_disk(self: Path, mode: str) -> object:
        opened(self, mode).close()
        return opened(Path("/dev/full"), "wb")

    monkeypatch.setattr(Path, "open", on_a_full_disk)
    with pytest.raises(RecordingError, match=r"cannot record to .*drive\.mcap: No space left on device"):
        McapWriter(path)
    assert not path.exists()
