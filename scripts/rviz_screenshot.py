"""Makes the picture of RViz in docs/ros1.md: both launch files of the course, on a virtual screen.

Usage: python scripts/rviz_screenshot.py [file.png]; needs ROS 1 (make ros1), rviz, xvfb and imagemagick.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import cv2

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "rviz.png"
SIZE = "1280x800"
LARGEST_BYTES = 400_000
DRIVEN_M = 1.0
PATIENCE_S = 90.0
DRAWN = 20  # of 255; the screen is black where no window is, the view's background has 48
PROGRAMS = ("roscore", "roslaunch", "rostopic", "rviz", "Xvfb", "import")
ODOM = "/robot_diff_drive_controller/odom"


def main(path: Path) -> None:
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        sys.exit(f"{', '.join(missing)}: not found; make ros1, then apt install rviz xvfb imagemagick")
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        run = stack.enter_context
        display = run(screen())
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = str(probe.getsockname()[1])
        env = {
            **os.environ,
            "DISPLAY": display,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "ROS_HOME": folder,
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": f"http://localhost:{port}",
            "ROS_PACKAGE_PATH": str(ROOT / "ros"),
        }
        run(process(["roscore", "-p", port], env))
        master = ["rostopic", "list"]
        until("roscore", lambda: not subprocess.run(master, env=env, capture_output=True, check=False).returncode)
        # Neutral now and then: on a busy machine, the control may stop for late signs, and waits for it.
        script = "Stop:1 Forward:20"
        subprocess.run(["rosparam", "set", "/my_camera/virtual_hand/script", script], env=env, check=True)
        drive = ["ros_hand_gesture_recognition", "sign_control.launch", "camera_name:=virtual", "show_image:=false"]
        run(process(["roslaunch", "ros_mobile_robot", "drive_robot.launch", "rviz:=true"], env))
        # Or the robot might be anywhere before it is drawn.
        until("RViz", lambda: "/rviz" in subscribers("/gesture/image_annotated", env))
        run(process(["roslaunch", *drive], env))
        wait_until_driven(env)
        path.parent.mkdir(parents=True, exist_ok=True)
        until("RViz's view", lambda: is_drawn(path, env))
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        sys.exit(f"{path} has {size} bytes, more than {LARGEST_BYTES}")
    print(f"{path}: {size} bytes")


@contextmanager
def screen() -> Iterator[str]:
    """Start a virtual screen; yield its name."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{SIZE}x24", "-nolisten", "tcp"]
    with process(command, dict(os.environ), pass_fds=(write,)):
        os.close(write)
        with os.fdopen(read) as answer:
            yield f":{answer.readline().strip()}"


@contextmanager
def process(command: list[str], env: dict[str, str], pass_fds: tuple[int, ...] = ()) -> Iterator[None]:
    """Run ``command`` during the block."""
    running = subprocess.Popen(
        command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, pass_fds=pass_fds
    )
    try:
        yield
    finally:
        running.send_signal(signal.SIGINT)
        running.wait(60)


def until(what: str, condition: Callable[[], bool]) -> None:
    """Wait until ``condition`` holds."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end_s:
            sys.exit(f"{what} is not ready after {PATIENCE_S:g} s")
        time.sleep(0.2)


def subscribers(topic: str, env: dict[str, str]) -> str:
    """Return the subscribers of ``topic``, as printed by rostopic."""
    said = subprocess.run(["rostopic", "info", topic], env=env, capture_output=True, text=True, check=False).stdout
    return said.partition("Subscribers:")[2]


def is_drawn(path: Path, env: dict[str, str]) -> bool:
    """Take the picture; return whether RViz has drawn its view of the world in it, dark grey where nothing is."""
    subprocess.run(["import", "-window", "root", "+dither", "-colors", "255", str(path)], env=env, check=True)
    picture = cv2.imread(str(path))
    return picture is not None and bool(picture[100:700, 450:1100].mean() > DRAWN)


def wait_until_driven(env: dict[str, str]) -> None:
    """Wait until the robot has driven ahead."""
    command = ["rostopic", "echo", f"{ODOM}/pose/pose/position/x"]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as echo:
        patience = threading.Timer(PATIENCE_S, echo.kill)
        patience.start()
        assert echo.stdout is not None
        driven = any(line != "---\n" and float(line) >= DRIVEN_M for line in echo.stdout)
        patience.cancel()
        echo.kill()
    if not driven:
        sys.exit(f"the robot has not driven {DRIVEN_M:g} m within {PATIENCE_S:g} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
