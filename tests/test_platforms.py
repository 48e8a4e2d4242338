"""handsteer on other systems: all locked packages can be installed there, and all modules imported."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# That of the set-up: one on PATH where there was one, else in the environment.
PROGRAMS = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
UV = shutil.which("uv", path=PROGRAMS) or "uv"
SYSTEMS = ("x86_64-manylinux_2_28", "aarch64-manylinux_2_31", "macos", "x86_64-pc-windows-msvc")
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
LOCKED = [("requirements.txt", python) for python in PYTHONS] + [
    ("requirements-dev.txt", python) for python in (PYTHONS[0], PYTHONS[-1])
]

ELSEWHERE = """
import importlib, os, pathlib, signal, sys

source = pathlib.Path({source!r})
modules = [
    ".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(source.glob("handsteer/**/*.py"))
    if path.name != "__main__.py"
]

# All other packages are loaded now: they would not know the system that this one claims to be later.
for name in modules.copy():
    try:
        importlib.import_module(name)
    except Exception as problem:  # or an error of ours that says what to install
        missing = problem if isinstance(problem, ModuleNotFoundError) else problem.__context__
        if getattr(missing, "name", None) not in {ros!r}:
            raise
        modules.remove(name)
for name in [name for name in sys.modules if name.partition(".")[0] == "handsteer"]:
    del sys.modules[name]
sys.platform = {platform!r}
for name in {absent!r}:
    sys.modules[name] = None
for name in {functions!r}:
    vars(os).pop(name, None)
for name in {signals!r}:
    vars(signal).pop(name, None)
for name in modules:
    importlib.import_module(name)
print(len(modules))
"""
ROS = ("rclpy", "rospy", "rosgraph", "rospkg", "genpy", "roslib", "tf2_msgs")
POSIX = ("fcntl", "grp", "pwd", "resource", "termios", "tty")
POSIX_OS = (
    "fork",
    "forkpty",
    "getuid",
    "geteuid",
    "nice",
    "mkfifo",
    "sched_getaffinity",
    "sched_setaffinity",
    "statvfs",
)
POSIX_SIGNALS = ("SIGHUP", "SIGKILL", "SIGQUIT", "SIGUSR1", "SIGUSR2", "pthread_sigmask", "setitimer")


@pytest.mark.slow
@pytest.mark.parametrize(("requirements", "python"), LOCKED)
@pytest.mark.parametrize("system", SYSTEMS)
def test_there_are_wheels_of_all_locked_packages(system: str, python: str, requirements: str, tmp_path: Path) -> None:
    command: list[str | Path] = [
        UV,
        "pip",
        "install",
        "--dry-run",
        "--quiet",
        "--no-deps",
        "--require-hashes",
        "--only-binary",
        ":all:",
    ]
    command += ["--python-platform", system, "--python-version", python, "--target", tmp_path]
    env = os.environ | {"MACOSX_DEPLOYMENT_TARGET": "14.0"}
    done = subprocess.run([*command, "-r", ROOT / requirements], capture_output=True, text=True, check=False, env=env)
    if "error sending request" in done.stderr or "Failed to fetch" in done.stderr:
        pytest.skip("the package index cannot be reached")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_each_module_can_be_imported_where_there_is_nothing_of_posix() -> None:
    program = ELSEWHERE.format(
        ros=ROS, platform="win32", absent=POSIX, functions=POSIX_OS, signals=POSIX_SIGNALS, source=str(ROOT / "src")
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 250
