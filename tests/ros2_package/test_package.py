"""The ROS 2 package: what it installs, what its launch files start, and its executables with the words of a launch."""

import ast
import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from handsteer.parameters import from_parameters
from handsteer.plugins.ros2.arguments import parse_arguments
from tests.dds.graph import free_domain
from tests.processes import eventually

PACKAGE = Path(__file__).resolve().parents[2] / "ros" / "handsteer_ros2"
SECTIONS = {
    "my_camera": "camera",
    "hand_sign_recognition": "signs",
    "hand_sign_control": "control",
    "robot": "robot",
}
LAUNCHES = sorted((PACKAGE / "launch").glob("*.launch.py"))


def executables() -> set[str]:
    tree = ast.parse((PACKAGE / "handsteer_ros2" / "nodes.py").read_text())
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")}


def test_the_manifest_names_the_package_and_how_it_is_built() -> None:
    manifest = ElementTree.parse(PACKAGE / "package.xml").getroot()
    assert manifest.findtext("name") == PACKAGE.name
    assert manifest.findtext("export/build_type") == "ament_python"
    assert (PACKAGE / "resource" / PACKAGE.name).exists()


def test_there_is_an_executable_for_each_node() -> None:
    assert executables() == {"camera", "recognition", "control", "robot", "steering"}


@pytest.mark.parametrize("launch", LAUNCHES, ids=lambda path: path.name)
def test_a_launch_file_starts_executables_that_are_there(launch: Path) -> None:
    calls = [node for node in ast.walk(ast.parse(launch.read_text())) if isinstance(node, ast.Call)]
    verbs = {call.args[0].value for call in calls if isinstance(call.func, ast.Name) and call.func.id == "node"}  # type: ignore[attr-defined]
    assert verbs
    assert verbs <= executables()
    assert (PACKAGE / "config" / launch.name.replace(".launch.py", ".yaml")).exists()


@pytest.mark.parametrize("file", sorted((PACKAGE / "config").glob("*.yaml")), ids=lambda path: path.name)
def test_every_parameter_of_the_files_is_one_of_the_nodes(file: Path, caplog: pytest.LogCaptureFixture) -> None:
    said = parse_arguments(["--ros-args", "--params-file", str(file)])
    for pattern in yaml.safe_load(file.read_text()):
        node = pattern.rpartition("/")[2]
        parameters = said.parameters(f"/r1/{node}")
        assert parameters
        from_parameters(parameters, SECTIONS[node], node)
        assert not caplog.messages


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    # Not imported here, where other tests may have loaded the distutils that it replaces.
    if importlib.util.find_spec("setuptools") is None:
        pytest.skip("no setuptools here")
    home = tmp_path_factory.mktemp("package")
    command = [sys.executable, "setup.py", "-q", "egg_info", "--egg-base", str(home), "build", "--build-base"]
    command += [str(home / "build"), "install", "--prefix", str(home / "it"), "--record", str(home / "files")]
    subprocess.run(
        [*command, "--single-version-externally-managed"], cwd=PACKAGE, check=True, capture_output=True, timeout=120
    )
    return home / "it"


def test_what_is_installed_is_where_ros2_looks(installed: Path) -> None:
    assert (installed / "share/ament_index/resource_index/packages/handsteer_ros2").exists()
    assert {path.name for path in (installed / "lib/handsteer_ros2").iterdir()} == executables()
    share = installed / "share/handsteer_ros2"
    assert {path.name for path in (share / "launch").iterdir()} == {path.name for path in LAUNCHES}
    assert (share / "urdf" / "handsteer_robot.urdf.xacro").read_text().startswith("<?xml")
    assert yaml.safe_load((share / "rviz" / "drive_robot.rviz").read_text())["Visualization Manager"]["Displays"]


def run(installed: Path, *words: str, **env: str) -> subprocess.CompletedProcess[str]:
    packages = next((installed / "lib").glob("python3*")) / "site-packages"
    environment = {**os.environ, "PYTHONPATH": f"{packages}{os.pathsep}{os.environ.get('PYTHONPATH', '')}", **env}
    script = installed / "lib/handsteer_ros2/control"
    return subprocess.run(
        [sys.executable, str(script), *words], env=environment, capture_output=True, text=True, timeout=60, check=False
    )


def test_an_executable_is_the_node_with_all_words_of_a_launch(installed: Path, tmp_path: Path) -> None:
    program = tmp_path / "handsteer"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handsteer "$@"\n')
    program.chmod(0o755)
    words = ["--transport", "dds", "--ros-args", "-r", "__node:=hand_sign_control", "-r", "__ns:=/r1"]
    done = run(installed, *words, "-p", "linear_step:=7", HANDSTEER=str(program))
    assert done.returncode == 2
    assert "ROS parameter /r1/hand_sign_control/linear_step: 7 should be less than or equal to 1" in done.stderr


@pytest.mark.slow
def test_without_a_program_that_is_named_it_runs_in_ros2s_own_python(installed: Path) -> None:
    words = ["--transport", "dds", "--ros-args", "-p", "linear_step:=7"]
    done = run(installed, *words, HANDSTEER="", PATH="/nowhere")
    assert done.returncode == 2
    assert "ROS parameter /hand_sign_control/linear_step: 7 should be less than or equal to 1" in done.stderr


LAUNCH = """
import os, subprocess, sys
node = subprocess.Popen(sys.argv[1:], env={**os.environ, "HANDSTEER_LAUNCH": str(os.getpid())})
print(node.pid, flush=True)
node.wait()
"""


def has_ended(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2][0] == "Z"
    except FileNotFoundError:
        return True


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells a process that its parent has ended")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_node_ends_with_the_launch_that_started_it(installed: Path, tmp_path: Path, number: signal.Signals) -> None:
    """As ``ros2 launch`` that gets a signal which it does not handle."""
    program, log = tmp_path / "handsteer", tmp_path / "log"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handsteer "$@"\n')
    program.chmod(0o755)
    packages = next((installed / "lib").glob("python3*")) / "site-packages"
    paths = f"{packages}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    environment = {**os.environ, "PYTHONPATH": paths, "HANDSTEER": str(program), "ROS_DOMAIN_ID": str(free_domain())}
    words = [sys.executable, str(installed / "lib/handsteer_ros2/control"), "--transport", "dds"]
    with log.open("wb") as file:
        launch = subprocess.Popen(
            [sys.executable, "-c", LAUNCH, *words], env=environment, stdout=subprocess.PIPE, stderr=file, text=True
        )
    assert launch.stdout is not None
    node = int(launch.stdout.readline())
    eventually(lambda: "is ready" in log.read_text(), what="the node")
    launch.send_signal(number)
    launch.wait(10)
    eventually(lambda: has_ended(node), 20.0, "the node to end")


def test_where_handsteer_is_not_installed_it_says_so(installed: Path) -> None:
    done = run(installed, HANDSTEER="no_such_program")
    assert done.returncode == 1
    assert "there is no program no_such_program: install handsteer, or set HANDSTEER to its path" in done.stderr
