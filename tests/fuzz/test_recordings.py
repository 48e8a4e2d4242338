"""Every reader of recordings, over mutants of good files and of those that are made to do harm."""

import itertools
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin

from handsteer.config import Config
from handsteer.errors import RecordingError
from handsteer.messages import CAMERA_INFO, ODOM, WORLD_MARKERS
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.replay.by_time import rerun_by_time
from handsteer.plugins.record.replay.drive_reader import read_drive
from handsteer.plugins.record.replay.report_charts import drive_map, latencies, timeline
from handsteer.plugins.record.replay.report_words import totals
from handsteer.plugins.record.replay.rerun import has_journals, recorded_config, rerun
from tests.fuzz.mutants import hold, mutants
from tests.plugins.record.test_bags import as_ros1, as_ros2

KEPT = ("/replay/hand_sign_control", "/gesture/hand_sign", "/robot_diff_drive_controller/cmd_vel", "/diagnostics")
BOMB_BYTES = 2_000_000_000


def small(
    recording: Path,
    path: Path,
    compression: CompressionType = CompressionType.NONE,
    topics: tuple[str, ...] = KEPT,
) -> Path:
    """Write the first messages of a recording, without pictures."""
    file = McapFile(recording)
    with path.open("wb") as stream:
        # Checksums would hide what is behind them.
        writer = Writer(stream, compression=compression, chunk_size=4000, enable_crcs=False)
        writer.start(profile="ros2", library="test")
        writer.add_metadata("handsteer", file.about)
        channels: dict[str, int] = {}
        for recorded in itertools.islice(file.messages(set(topics)), 120):
            if recorded.topic not in channels:
                schema = writer.register_schema(recorded.type, "ros2msg", b"string data")
                channels[recorded.topic] = writer.register_channel(recorded.topic, "cdr", schema)
            time_ns = recorded.time_ns
            writer.add_message(channels[recorded.topic], time_ns, recorded.raw, time_ns, recorded.number)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def chunk(compression: bytes, content: bytes, size: int) -> bytes:
    """Return an MCAP file with one chunk that says to have ``size`` bytes."""
    head = struct.pack("<QQQII", 0, 1, size, 0, len(compression)) + compression
    body = head + struct.pack("<Q", len(content)) + content
    return MCAP0_MAGIC + struct.pack("<BQ", 6, len(body)) + body


def bombs() -> list[bytes]:
    """Return small files that stand for gigabytes."""
    zeros = zlib.decompressobj().decompress(zlib.compress(b"\0" * 50_000_000))
    lz4_bomb, zstd_bomb = lz4.frame.compress(zeros), zstandard.compress(zeros)
    return [
        chunk(b"lz4", lz4_bomb * 40, BOMB_BYTES),
        chunk(b"zstd", zstd_bomb, BOMB_BYTES),
        chunk(b"zstd", zstandard.compress(zeros), 2**63),
        chunk(b"lz4", lz4_bomb, 10),
        chunk(b"", b"\1" * 1000, 1000),
        MCAP0_MAGIC + struct.pack("<BQ", 5, 2**63),
        MCAP0_MAGIC + struct.pack("<BQ", 3, 20) + b"\xff" * 20,
        MCAP0_MAGIC,
        b"",
    ]


def read_all(path: Path) -> None:
    recording = open_recording(path)
    for recorded in recording.messages():
        try:
            _ = recorded.message
        except RecordingError:
            continue


def replay_all(path: Path) -> None:
    recording = open_recording(path)
    config = recorded_config(recording) if recording.about else Config()
    run = rerun if has_journals(recording) else rerun_by_time
    for _ in run(recording, config, "signs"):
        pass


def report_all(path: Path) -> None:
    facts = read_drive(open_recording(path))
    told = [facts.totals(), totals(facts), timeline(facts), drive_map(facts), latencies(facts)]
    json.dumps(told, allow_nan=False)


def of_file(path: Path, read: Callable[[Path], None]) -> Callable[[bytes], None]:
    """Return a function that writes its bytes to ``path`` and calls ``read``."""

    def call(data: bytes) -> None:
        path.write_bytes(data)
        read(path)

    return call


@pytest.mark.parametrize("compression", list(CompressionType))
def test_mcap_files(compression: CompressionType, recording: Path, tmp_path: Path) -> None:
    corpus = [small(recording, tmp_path / "good.mcap", compression).read_bytes(), *bombs()]
    read_all(tmp_path / "good.mcap")
    assert hold(of_file(tmp_path / "bad.mcap", read_all), mutants(corpus))


def test_replays(recording: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("CRITICAL")  # a control that gets damaged messages logs that
    good = small(recording, tmp_path / "good.mcap")
    replay_all(good)
    assert hold(of_file(tmp_path / "bad.mcap", replay_all), mutants([good.read_bytes()]))


def test_reports(recording: Path, tmp_path: Path) -> None:
    good = small(recording, tmp_path / "good.mcap", topics=(*KEPT, ODOM.name, WORLD_MARKERS.name, CAMERA_INFO.name))
    report_all(good)
    assert hold(of_file(tmp_path / "bad.mcap", report_all), mutants([good.read_bytes()]))


def test_bags_of_ros1(recording: Path, tmp_path: Path) -> None:
    good = as_ros1(small(recording, tmp_path / "good.mcap"), tmp_path / "good.bag")
    assert hold(of_file(tmp_path / "bad.bag", read_all), mutants([good.read_bytes(), b"", b"#ROSBAG V2.0\n"]))


def test_bags_of_ros2(recording: Path, tmp_path: Path) -> None:
    folder = as_ros2(small(recording, tmp_path / "good.mcap"), tmp_path / "good", StoragePlugin.SQLITE3)
    good = next(folder.glob("*.db3"))
    assert hold(of_file(tmp_path / "bad.db3", read_all), mutants([good.read_bytes(), b"SQLite format 3\0"]))
