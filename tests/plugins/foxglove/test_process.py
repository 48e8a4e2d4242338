"""``--foxglove``, as people use it, and that nothing which befalls its process moves the robot or delays it."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from handsteer.config import FoxgloveConfig, load
from handsteer.errors import LiveError
from handsteer.graph import Graph
from handsteer.messages import IMAGE_COMPRESSED
from handsteer.plugins.foxglove.process import LiveProcess
from tests.plugins.foxglove.viewer import Viewer
from tests.processes import Process, eventually

RUN = (sys.executable, "-m", "handsteer", "run", "--camera", "virtual")
SMALL = ("--camera.width", "320", "--camera.height", "240", "--camera.fps", "15")
SCRIPT = ("--virtual-hand.script", "Stop:1 Forward:600")
SLOWLY = {"camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15}}
ADDRESS = re.compile(r"see all topics at (ws://\S+)")


@pytest.fixture
def drive(tmp_path: Path) -> Iterator[Process]:
    command = [*RUN, *SMALL, *SCRIPT, "--headless", "--foxglove", "0"]
    run = Process(command, dict(os.environ), tmp_path / "run.log")
    yield run
    run.kill()


def address_of(run: Process) -> str:
    found: re.Match[str] = eventually(lambda: ADDRESS.search(run.text))
    return found[1]


def said_by(*options: str) -> tuple[int, str]:
    done = subprocess.run([*RUN, *SMALL, *options], capture_output=True, text=True, check=False, timeout=60)
    return done.returncode, done.stderr


@pytest.mark.slow
def test_a_drive_is_seen_and_ctrl_c_ends_it(drive: Process) -> None:
    with Viewer(address_of(drive)) as viewer:
        viewer.subscribe(viewer.channels)
        seen = viewer.until(["/image_raw/compressed", "/tf", "/world/markers", "/robot_description", "/scan"])
        assert {each.message.format for each in seen if each.topic == "/image_raw/compressed"} == {
            "bgr8; jpeg compressed bgr8"
        }
        drive.signal(signal.SIGINT)
        with pytest.raises(ConnectionClosed):
            viewer.until(["no such topic"])
    assert drive.code() == 0
    assert "ran for" in drive.text
    assert "Traceback" not in drive.text
    assert "Fatal" not in drive.text


@pytest.mark.slow
def test_a_refused_page_is_told_in_the_log(drive: Process) -> None:
    with pytest.raises(InvalidHandshake):
        Viewer(address_of(drive), headers=[("Origin", "https://evil.example")])
    eventually(lambda: "handsteer: refused a program that asked for the topics: pages of this site" in drive.text)


@pytest.mark.slow
def test_driving_goes_on_when_its_process_is_killed() -> None:
    with Graph(load(base=SLOWLY)) as graph:
        live = LiveProcess()
        try:
            address = live.serve(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0))
            graph.start()
            pictures = graph.transport.advertise("probe", IMAGE_COMPRESSED)
            with Viewer(address) as viewer:
                viewer.subscribe([IMAGE_COMPRESSED.name])
                viewer.next()
                assert pictures.has_subscribers
                os.kill(live.process.pid, signal.SIGKILL)
                with pytest.raises(ConnectionClosed):
                    viewer.until(["no such topic"])
            eventually(lambda: not pictures.has_subscribers, what="the end of its subscriptions")
            before = sum(graph.recognition.counts.values())
            eventually(lambda: sum(graph.recognition.counts.values()) > before + 5)
        finally:
            live.stop()


@pytest.mark.slow
def test_driving_goes_on_when_its_process_stalls() -> None:
    with Graph(load(base=SLOWLY)) as graph:
        live = LiveProcess()
        try:
            address = live.serve(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0))
            graph.start()
            with Viewer(address) as viewer:
                viewer.subscribe(viewer.channels)
                viewer.next()
                os.kill(live.process.pid, signal.SIGSTOP)
                before = sum(graph.recognition.counts.values())
                eventually(lambda: sum(graph.recognition.counts.values()) > before + 30)
                os.kill(live.process.pid, signal.SIGCONT)
                newest = graph.clock.stamp(graph.clock.now())
                eventually(lambda: viewer.next().time_ns > newest.sec * 1_000_000_000)
        finally:
            live.stop()


@pytest.mark.slow
@pytest.mark.parametrize("page", [("--headless",), ("--port", "0", "--dashboard.no-open-browser")])
def test_a_port_in_use_ends_the_run(page: tuple[str, ...]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        code, text = said_by("--foxglove", str(port), *page)
    assert code == 2
    lines = [line for line in text.splitlines() if line.startswith("handsteer:")]
    assert lines == [f"handsteer: port {port} on 127.0.0.1 is in use: choose another with --foxglove N (0: a free one)"]
    assert "Traceback" not in text
    assert "Fatal" not in text


@pytest.mark.slow
def test_wrong_options_end_the_run() -> None:
    code, text = said_by("--headless", "--foxglove", "0", "--fast")
    assert code == 2
    assert "leave out --fast" in text
    code, text = said_by("--headless", "--foxglove", "70000")
    assert code == 2
    assert "foxglove.port: 70000 should be less than or equal to 65535" in text
    code, text = said_by("--headless", "--foxglove", "0", "--foxglove.host", "203.0.113.7")
    assert code == 2
    assert "--foxglove.host 203.0.113.7 is not an address of this machine" in text


def test_a_process_that_dies_before_it_serves_is_reported() -> None:
    with Graph(load(base=SLOWLY)) as graph:
        live = LiveProcess()
        try:
            live.process.kill()
            with pytest.raises(LiveError, match=r"process for Foxglove has ended \(exit code -9\)"):
                live.serve(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0))
        finally:
            live.stop()


def test_it_ends_with_the_process_that_it_belongs_to() -> None:
    code = (
        "import time; from handsteer.plugins.foxglove.process import LiveProcess; live = LiveProcess(); "
        "print(live.process.pid, flush=True); time.sleep(600)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
    eventually(lambda: not Path(f"/proc/{pid}").exists() or ") Z " in Path(f"/proc/{pid}/stat").read_text())
    assert not [thread for thread in threading.enumerate() if thread.name == "foxglove_end"]
