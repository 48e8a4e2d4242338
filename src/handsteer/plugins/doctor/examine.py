"""Examines this machine."""

import ctypes.util
import importlib.util
import os
import platform
import socket

from handsteer.cameras.webcam import Webcam, webcams
from handsteer.clock import RealClock
from handsteer.config import CameraConfig
from handsteer.errors import CameraError, ConfigError, ModelError
from handsteer.plugins.doctor.ros2 import Finding, examine_ros2
from handsteer.recognition.landmark_models import MODELS, find_model, models_dir

__all__ = ["Finding", "examine"]


def examine(port: int) -> list[Finding]:
    """Check everything that a run may need; ``port`` is the page's."""
    return [_python(), _models(), *_cameras(), _port(port), *_ros(), *examine_ros2(os.environ), _gl()]


def _python() -> Finding:
    system = f"{platform.system()} {platform.machine()}"
    return Finding("python", "ok", f"{platform.python_version()} on {system}, {os.cpu_count()} processors")


def _models() -> Finding:
    try:
        for name in MODELS:
            find_model(name)
    except ModelError as error:
        return Finding("models", "missing", str(error))
    return Finding("models", "ok", f"the landmark models are in {models_dir()}")


def _cameras() -> list[Finding]:
    sources = webcams()
    if not sources:
        return [Finding("camera", "optional", "no webcam: the virtual hand is used instead (--camera virtual)")]
    return [_camera(source) for source in sources]


def _camera(source: str) -> Finding:
    wanted = CameraConfig()
    try:
        camera = Webcam(source, RealClock(), width=wanted.width, height=wanted.height, fps=wanted.fps)
    except CameraError as error:
        return Finding("camera", "optional", str(error))
    try:
        frame = camera.read()
    except CameraError as error:
        return Finding("camera", "optional", str(error))
    finally:
        camera.close()
    size = f"{frame.image.shape[1]}x{frame.image.shape[0]}" if frame else "no"
    return Finding("camera", "ok", f"{camera.name} delivers {size} frames")


def _port(port: int) -> Finding:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OverflowError:
            raise ConfigError(f"port {port} should be from 0 to 65535") from None
        except OSError as error:
            return Finding(
                "port",
                "missing",
                f"port {port}: {error.strerror}; end the program that uses it, or choose another port with --port",
            )
    return Finding("port", "ok", f"port {port} is free for the page")


def _ros() -> list[Finding]:
    return [
        _importable("ros 1", "rospy", "no rospy (Debian, Ubuntu: make ros1)"),
        _importable("ros 2", "rclpy", "no rclpy for this Python: is a ROS 2 sourced?"),
    ]


def _importable(name: str, module: str, otherwise: str) -> Finding:
    if importlib.util.find_spec(module):
        return Finding(name, "ok", f"{module} can be imported; not needed to run")
    return Finding(name, "optional", f"{otherwise}; not needed to run")


def _gl() -> Finding:
    library = ctypes.util.find_library("GL") or ctypes.util.find_library("EGL")
    if library:
        return Finding("gl", "ok", f"{library}; not needed to run: the page draws in the browser")
    return Finding("gl", "optional", "no OpenGL library; not needed to run: the page draws in the browser")
