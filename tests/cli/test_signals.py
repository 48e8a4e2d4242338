"""Signals at any moment of the start: no traceback, and the exit code of an ordinary end."""

import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.processes import Process, eventually, free_port
from tests.ros1.graph import Ros1Graph
from tests.ros1.launches import ROS, ros_environment

pytestmark = [pytest.mark.exhaustive, pytest.mark.slow]

MOMENTS = 12
LATEST_S = 1.5
HANDSTEER = (sys.executable, "-m", "handsteer")


def block() -> None:
    """As our launch scripts do: signals wait until the program takes them, so the interpreter's start is not a gap."""
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))


def ends(command: Sequence[str], env: dict[str, str], home: Path, *, code: int = 0, moments: int = MOMENTS) -> None:
    """Start ``command`` again and again, each time ended by a signal at a later moment, and look at how."""
    for number in range(moments):
        wish = (signal.SIGINT, signal.SIGTERM)[number % 2]
        process = Process(list(command), env, home / f"{number}.log", preexec_fn=block)
        moment_s = number * LATEST_S / moments
        try:
            threading.Event().wait(moment_s)
            process.signal(wish)
            ended = process.code()
            # CPython, run by -m, ends itself by SIGINT at its very end after either signal within exec of a text, as
            # dataclasses use it, though all was left in order.
            assert ended in (code, -wish, -signal.SIGINT), (moment_s, wish, process.text)
            assert "Traceback" not in process.text, (moment_s, wish)
        finally:
            process.kill()


@pytest.mark.parametrize("transport", ["dds", "zenoh"])
def test_a_signal_that_comes_again_and_again(tmp_path: Path, transport: str) -> None:
    """As from a terminal and a launcher that both end a node, and at any moment of its end."""
    command = [*HANDSTEER, "control", "--transport", transport]
    for number in range(4):
        process = Process(command, dict(os.environ), tmp_path / f"{number}.log")
        try:
            eventually(lambda: "is ready" in process.text, what="the node to run")  # noqa: B023
            while process.running:
                process.signal(signal.SIGINT)
                threading.Event().wait(0.01 + 0.005 * number)
            assert process.code() == 0, process.text
            assert "Traceback" not in process.text
            assert "Exception ignored" not in process.text
        finally:
            process.kill()


def test_a_run(tmp_path: Path) -> None:
    command = [
        *HANDSTEER,
        "run",
        "--headless",
        "--camera",
        "virtual",
        "--camera.width",
        "320",
        "--camera.height",
        "240",
    ]
    ends(command, dict(os.environ), tmp_path)


def test_what_has_an_end_of_its_own_was_interrupted(tmp_path: Path) -> None:
    env = {**os.environ, "PYTHONPROFILEIMPORTTIME": "1"}  # which takes long enough to be interrupted
    ends([*HANDSTEER, "signs", "evaluate", "--help"], env, tmp_path, code=130, moments=1)


def test_a_node_over_dds(tmp_path: Path) -> None:
    pytest.importorskip("cyclonedds")
    env = {**os.environ, "ROS_DOMAIN_ID": str(10 + free_port() % 30), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    ends([*HANDSTEER, "control", "--transport", "dds"], env, tmp_path)


@pytest.mark.ros1
def test_a_node_over_ros1(ros1: Ros1Graph, tmp_path: Path) -> None:
    ends([*HANDSTEER, "recognition", "--transport", "ros1"], ros1.env, tmp_path)


@pytest.mark.ros1
@pytest.mark.skipif(not Path(sys.executable).with_name("handsteer").exists(), reason="handsteer is not installed")
def test_an_executable_of_the_courses_packages(ros1: Ros1Graph, tmp_path: Path) -> None:
    env = {**ros_environment(), **{name: ros1.env[name] for name in ("ROS_MASTER_URI", "ROS_HOME")}}
    ends([str(ROS / "ros_hand_gesture_recognition/scripts/sign_to_controller.py")], env, tmp_path)
