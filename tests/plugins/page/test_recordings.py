"""What the page offers of recordings, without a browser."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from handsteer.clock import SteppedClock
from handsteer.config import Config, RecordingConfig, VirtualHandConfig
from handsteer.errors import RecordingError
from handsteer.graph import Graph
from handsteer.nodes.run_recording import RecordingState
from handsteer.plugins.page import recordings as module
from handsteer.plugins.page.recordings import Recordings, duration_text, size_text
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.testing.transport_contract import eventually
from tests.plugins.page.served import remote

NAME = "drive.mcap"


class Bench:
    def __init__(self, folder: Path) -> None:
        self.current: RecordingState | None = None
        self.path = folder / NAME
        self.path.write_bytes(b"frames")
        self.recordings = Recordings(folder, lambda: self.current)

    def status_of(self, name: str) -> int:
        return self.recordings.download(name).status_code


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(tmp_path)
    yield bench
    bench.recordings.close()


def report_by(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let reports be made by a Python script; its arguments are the recording, ``--output`` and the report."""
    monkeypatch.setattr(module, "_REPORT", [sys.executable, "-c", script])


def test_only_complete_recordings_of_the_folder_are_given(bench: Bench) -> None:
    assert bench.status_of(NAME) == 200
    assert bench.status_of("missing.mcap") == 404
    assert bench.status_of(f"../{bench.path.parent.name}/{NAME}") == 404
    bench.current = RecordingState(bench.path, 1.0)
    assert bench.status_of(NAME) == 404, "it is being written"
    assert not bench.recordings.has(bench.current)
    bench.current = RecordingState(bench.path, 1.0, 2.0)
    assert bench.status_of(NAME) == 200
    assert bench.recordings.has(bench.current)
    assert not bench.recordings.has(RecordingState(Path("/elsewhere") / NAME, 1.0, 2.0))


def test_a_report_is_made_once_and_then_shown(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    report_by(monkeypatch, "import sys; open(sys.argv[3], 'a').write('<h1>drive</h1>')")
    assert bench.recordings.show_report(NAME).status_code == 404
    bench.recordings.make_report(NAME)
    bench.recordings.make_report(NAME)
    assert eventually(lambda: bench.recordings.report(NAME).stage == "ready")
    answer = bench.recordings.show_report(NAME)
    assert answer.status_code == 200
    assert answer.headers["content-security-policy"].startswith("sandbox")
    assert bench.path.with_suffix(".html").read_text() == "<h1>drive</h1>"


def test_why_a_report_cannot_be_made_is_told_and_it_may_be_tried_again(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    report_by(monkeypatch, "import sys; sys.exit('handsteer: drive.mcap contains nothing to report')")
    bench.recordings.make_report(NAME)
    assert eventually(lambda: bench.recordings.report(NAME).problem)
    state = bench.recordings.report(NAME)
    assert (state.stage, state.problem) == ("none", "drive.mcap contains nothing to report")
    report_by(monkeypatch, "import sys; open(sys.argv[3], 'w').write('')")
    bench.recordings.make_report(NAME)
    assert eventually(lambda: bench.recordings.report(NAME).stage == "ready")


def test_there_is_no_report_on_what_is_no_recording(bench: Bench) -> None:
    bench.recordings.make_report("../drive.mcap")
    assert bench.recordings.report("../drive.mcap").stage == "none"


def test_durations_and_sizes_are_short() -> None:
    recording = RecordingState(Path(NAME), 10.0)
    assert [duration_text(recording, 10.0 + s) for s in (0.0, 5.9, 65.0, 3600.0)] == ["0:00", "0:05", "1:05", "60:00"]
    assert duration_text(RecordingState(Path(NAME), 10.0, 12.0), 99.0) == "0:02"
    assert [size_text(n) for n in (0, 3_140_000, 2_500_000_000)] == ["0.0 MB", "3.1 MB", "2.50 GB"]


def graph_of(folder: Path) -> Graph:
    hand = VirtualHandConfig(script="Stop:1 Forward:1")
    return Graph(Config(virtual_hand=hand, recording=RecordingConfig(folder=folder)), SteppedClock(), steering=False)


def test_the_page_starts_and_ends_a_recording_of_the_graph(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    with graph_of(folder) as graph, remote(graph) as page:
        assert page.state.recording is None
        page.record().result(10)
        (path,) = folder.iterdir()
        assert eventually(lambda: page.state.recording is not None and page.state.recording.path == path)
        with pytest.raises(RecordingError, match="end that first"):
            page.record().result(10)
        graph.run_stepped(1.0)
        page.end_recording().result(10)
        assert eventually(lambda: page.state.recording is not None and page.state.recording.ended_s is not None)
        page.end_recording().result(10)
    file = McapFile(path)
    topics = {recorded.topic for recorded in file.messages()}
    assert {"/gesture/hand_sign", "/audit"} <= topics
    assert file.problem is None


def test_a_folder_that_cannot_be_created_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with graph_of(tmp_path / "file" / "recordings") as graph, remote(graph) as page:
        with pytest.raises(RecordingError, match="cannot create the folder"):
            page.record().result(10)
        assert page.state.recording is None
