"""The page in a process of its own: what it does, and that nothing which befalls it moves the robot or holds it up."""

import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from handsteer.cameras.browser import HEADER_BYTES
from handsteer.config import load
from handsteer.errors import ConfigError, DashboardError, FrameError, TransportError, WorldError
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, STOP, Bool, Twist
from handsteer.plugins.page.editing import add, remove
from handsteer.plugins.page.page_process import PageProcess
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.robots.world import load_world
from handsteer.testing.transport_contract import eventually
from handsteer.transports.base import Received
from handsteer.types import Pose2D
from tests.plugins.page.served import remote
from tests.processes import Process
from tests.transports.test_piped import joined

SMALL = {"source": "virtual", "width": 320, "height": 240, "fps": 15}


@contextmanager
def served(script: str = "NONE:600", **sections: dict[str, object]) -> Iterator[tuple[Graph, PageProcess, str]]:
    config = load(base={"camera": SMALL, "virtual_hand": {"script": script}, "dashboard": {"port": 0}, **sections})
    with Graph(config, steering=False) as graph:
        page = PageProcess()
        try:
            yield graph, page, page.serve(graph)
        finally:
            page.stop()


def fetch(url: str) -> str:
    with urllib.request.urlopen(url, timeout=30) as answer:
        text: str = answer.read().decode()
        return text


class Driven:
    """The commands of a graph."""

    def __init__(self, graph: Graph) -> None:
        self.speeds: list[float] = []
        self.news = threading.Condition()
        graph.transport.subscribe("test", CMD_VEL, self._take)

    def _take(self, received: Received[Twist]) -> None:
        with self.news:
            self.speeds.append(received.message.linear.x)
            self.news.notify_all()

    def wait_for(self, condition: Callable[[list[float]], object], timeout_s: float = 30.0) -> None:
        with self.news:
            begun = len(self.speeds)
            assert self.news.wait_for(lambda: condition(self.speeds[begun:]), timeout_s), self.speeds


@pytest.mark.slow
def test_all_pages_are_served_from_another_process() -> None:
    with served() as (_, page, url):
        for path in ("/", "/teach", "/settings", "/study"):
            assert "handsteer" in fetch(url + path)
        assert page.process.pid != os.getpid()


@pytest.mark.slow
def test_a_page_that_stands_still_holds_up_neither_commands_nor_stop() -> None:
    with served("Forward:600") as (graph, page, _):
        driven = Driven(graph)
        graph.start()
        driven.wait_for(lambda speeds: speeds and speeds[-1] > 0.1)
        page.process.send_signal(signal.SIGSTOP)
        try:
            driven.wait_for(lambda speeds: len(speeds) > 30 and min(speeds) > 0)
            graph.transport.advertise("test", STOP).publish(Bool(data=True))
            driven.wait_for(lambda speeds: 0.0 in speeds)
        finally:
            page.process.send_signal(signal.SIGCONT)


@pytest.mark.slow
def test_a_page_that_dies_is_told() -> None:
    with served() as (graph, page, _):
        graph.start()
        page.process.kill()
        graph.wait(30.0, until=lambda: page.is_gone)
        assert page.is_gone
        assert "ended (exit code -9), so the robot was commanded to stop" in str(page.why_gone())


@pytest.mark.slow
def test_a_run_ends_with_its_page_and_leaves_the_robot_standing(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "handsteer", "run", "--camera", "virtual", "--port", "0"]
    run = Process([*command, "--dashboard.no-open-browser"], dict(os.environ), tmp_path / "log")
    try:
        assert eventually(lambda: "the page is at" in run.text)
        (child,) = Path(f"/proc/{run.popen.pid}/task/{run.popen.pid}/children").read_text().split()
        os.kill(int(child), signal.SIGKILL)
        assert run.code() == 2
        assert "the page's process has ended (exit code -9), so the robot was commanded to stop" in run.text
        assert "Traceback" not in run.text
    finally:
        run.kill()


def test_a_page_ends_with_the_process_that_it_belongs_to() -> None:
    code = (
        "import sys, time; from handsteer.plugins.page.page_process import PageProcess; page = PageProcess(); "
        "print(page.process.pid, flush=True); time.sleep(600)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
    assert eventually(lambda: not _runs(pid))


def _runs(pid: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False


@pytest.mark.slow
def test_a_port_in_use_is_said_by_the_process_that_asked_for_the_page() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with (
            pytest.raises(DashboardError, match=f"port {port} on 127.0.0.1 is in use"),
            served(dashboard={"port": port}),
        ):
            pass


def test_a_page_that_was_never_served_ends_at_once() -> None:
    page = PageProcess()
    page.stop()
    assert page.process.poll() is not None


@pytest.fixture
def near() -> Iterator[Graph]:
    """A graph that runs, without any page."""
    config = load(base={"camera": SMALL, "virtual_hand": {"script": "NONE:600"}, "robot": {"world": "empty"}})
    with Graph(config, steering=False) as graph:
        graph.start()
        yield graph


@pytest.fixture
def far(near: Graph) -> Iterator[RemoteGraph]:
    """The same graph as the page's process sees it; both are in this one."""
    with remote(near) as far:
        yield far


def test_a_setting_that_takes_long_delays_no_stop(
    near: Graph, far: RemoteGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where a model's file is on a server that does not answer; the graph's own thread of the pipe carries both."""
    begun, answered, stops = threading.Event(), threading.Event(), list[Received[Bool]]()

    def wait(*_: object) -> None:
        begun.set()
        answered.wait(60)

    monkeypatch.setattr(Graph, "reconfigure", wait)
    near.transport.subscribe("probe", STOP, stops.append)
    setting = threading.Thread(target=far.reconfigure, args=(far.config,))
    try:
        setting.start()
        assert begun.wait(30)
        far.transport.advertise("page", STOP).publish(Bool(data=True))
        eventually(lambda: bool(stops))
    finally:
        answered.set()
        setting.join()


def test_the_world_is_changed_from_afar(near: Graph, far: RemoteGraph) -> None:
    far.change_world(partial(add, shape="box", robot=Pose2D(0.0, 0.0, 0.0))).result(30)
    assert far.state.world is not None
    (thing,) = far.state.world.obstacles
    assert near.robot.surroundings.world == far.state.world
    far.change_world(partial(remove, name=thing.name)).result(30)
    with pytest.raises(WorldError, match="nothing called 'box 1'"):
        far.change_world(partial(remove, name=thing.name)).result(30)
    far.enter_world(load_world("obstacles")).result(30)
    assert near.robot.surroundings.world == load_world("obstacles") == far.state.world
    far.reset().result(30)


def test_a_request_that_fails_unexpectedly_is_answered_in_words(far: RemoteGraph) -> None:
    with pytest.raises(TransportError, match="failed to do it"):
        far.change_world(partial(add, shape="box", robot=None)).result(30)  # type: ignore[arg-type]
    far.change_world(partial(add, shape="box", robot=Pose2D(0.0, 0.0, 0.0))).result(30)


def test_settings_reach_the_nodes_of_both_processes(near: Graph, far: RemoteGraph) -> None:
    slower = near.config.control.model_copy(update={"max_linear": 0.1})
    far.reconfigure(near.config.model_copy(update={"control": slower}))
    assert near.config.control.max_linear == far.config.control.max_linear == 0.1
    broken = near.config.signs.model_copy(update={"model": Path("gone.npz")})
    with pytest.raises(ConfigError, match=r"gone\.npz"):
        far.reconfigure(near.config.model_copy(update={"signs": broken}))
    assert near.config.signs.model is None
    assert far.config.signs.model is None


def test_a_browsers_camera_is_offered_from_afar(near: Graph, far: RemoteGraph) -> None:
    assert far.state.camera_source == "own"
    far.choose_camera("browser")
    assert eventually(lambda: far.state.camera_source == near.cameras.source == "browser")
    with pytest.raises(FrameError, match="not a JPEG"):
        far.offer_frame(bytes(HEADER_BYTES + 100))
    assert not near.cameras.browser.is_given
    _, jpeg = cv2.imencode(".jpg", np.zeros((24, 32, 3), np.uint8))
    far.offer_frame(bytes(HEADER_BYTES) + jpeg.tobytes())
    assert eventually(lambda: far.state.has_browser)
    far.forget_browser()
    assert eventually(lambda: not far.state.has_browser)


def test_steering_from_afar_drives_and_its_end_stops(near: Graph, far: RemoteGraph) -> None:
    driven = Driven(near)
    far.steering.steer(0.0, 0.0)

    def drives() -> bool:
        far.steering.steer(0.2, 0.0)
        return max(driven.speeds, default=0.0) > 0.1

    eventually(drives)
    far.steering.stop()
    driven.wait_for(lambda speeds: speeds and speeds[-1] == 0.0)


def test_a_graph_that_is_gone_is_told() -> None:
    here, there = joined()
    far = RemoteGraph(there)
    there.start()
    here.start()
    here.close()
    with pytest.raises(TransportError, match="has ended"):
        far.join()
