"""What the ROS 2 set-up builds by itself, and what it says where it cannot."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros2.graph import PYTHON, needs_tf2_msgs

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
SCRIPT = SCRIPTS / "build_tf2_msgs.py"
# ROS 1's package of this name, which may be found too, knows no such method.
USE = "from tf2_msgs.msg import TFMessage as M; print(M(), M.__module__, M.get_fields_and_field_types())"
USED = (
    "tf2_msgs.msg.TFMessage(transforms=[]) tf2_msgs.msg._tf_message "
    "{'transforms': 'sequence<geometry_msgs/TransformStamped>'}\n"
)
LINKED_WITHIN = ("lib", "python3.*", "site-packages")

pytestmark = [
    pytest.mark.ros2,
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON.exists(), reason="no ROS 2 here: make ros2 installs one for the tests"),
]


@pytest.fixture
def ros2(tmp_path: Path) -> Path:
    """An environment that has all of ``make ros2`` by links, but tf2_msgs."""
    folder = tmp_path / "ros2"
    link(PYTHON.parents[1], folder)
    return folder


def link(source: Path, target: Path) -> None:
    target.mkdir()
    for entry in source.iterdir():
        if any(map(entry.match, LINKED_WITHIN)):
            link(entry, target / entry.name)
        elif "tf2_msgs" not in entry.name:
            (target / entry.name).symlink_to(entry)


def run(ros2: Path, *words: str, **env: str) -> subprocess.CompletedProcess[str]:
    command = [str(ros2 / "bin" / "python"), *words]
    return subprocess.run(command, env=os.environ | env, capture_output=True, text=True, timeout=300, check=False)


@needs_tf2_msgs
def test_tf2_msgs_is_built_and_can_be_built_again(ros2: Path) -> None:
    assert run(ros2, "-c", USE).returncode
    for _ in range(2):
        done = run(ros2, str(SCRIPT))
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        used = run(ros2, "-c", USE)
        assert used.stdout == USED, used.stderr


def test_without_a_compiler_one_line_says_what_is_left_out(ros2: Path, tmp_path: Path) -> None:
    done = run(ros2, str(SCRIPT), PATH=str(tmp_path))
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "ROS 2 set-up: /tf is left out: there is no C++ compiler: install g++ and repeat make ros2"
    ]
    assert run(ros2, "-c", USE).returncode


def test_a_uv_that_was_there_before_is_used(tmp_path: Path) -> None:
    """It installs nothing here: that it has run is what its exit code shows."""
    (tmp_path / "scripts").mkdir()
    script = shutil.copy(SCRIPTS / "setup-ros2", tmp_path / "scripts")
    programs, theirs = tmp_path / ".venv" / "bin", tmp_path / "theirs"
    programs.mkdir(parents=True)
    (programs / "python").symlink_to(sys.executable)
    theirs.mkdir()
    uv = theirs / "uv"
    uv.write_text('#!/bin/sh\necho "uv $1 $2 into $VIRTUAL_ENV" >&2\nexit 1\n')
    uv.chmod(0o755)
    path = f"{theirs}{os.pathsep}{os.defpath}"
    done = subprocess.run(
        [script], env=os.environ | {"PATH": path}, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        f"uv pip install into {tmp_path}/.venv/ros2",
        "ROS 2 set-up: cannot install the packages of requirements-ros2.txt: check the network",
    ]
