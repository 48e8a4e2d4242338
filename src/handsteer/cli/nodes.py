"""Processes of a graph: one node each, several simulated robots, and the Zenoh router."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from handsteer import making
from handsteer.cli.app import ConfigFile, Flag, Parameters
from handsteer.cli.one_node import Job, run
from handsteer.cli.running import say, signals_ignored
from handsteer.config import Config
from handsteer.errors import ConfigError, needing
from handsteer.transports import TRANSPORTS

_MOST = 30
_LOOK_PERIOD_S = 0.2
_END_TIMEOUT_S = 3.0


def camera(
    *ros_args: str,
    transport: str,
    camera: str | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Publish a camera's frames on image_raw.

    Example: handsteer camera --transport ros1 --camera /dev/video0 image_raw:=/front/image_raw

    Parameters
    ----------
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        ros2 (rclpy), dds or zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, else dds), or ros1.
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address (rtsp, http), a video file or a folder of photos.
    config_file
        YAML file with parameters; ROS parameters override it, and options override both.
    """
    job = Job("my_camera", "camera", making.make_camera, config_file, parameters, {"camera": {"source": camera}})
    return run(job, transport, ros_args)


def recognition(*ros_args: str, transport: str, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Recognise the sign in each frame of image_raw, and publish it on gesture/hand_sign.

    Example: handsteer recognition --transport ros1 image_raw:=/front/image_raw

    Parameters
    ----------
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        ros2 (rclpy), dds or zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, else dds), or ros1.
    config_file
        YAML file with parameters; ROS parameters override it, and options override both.
    """
    job = Job("hand_sign_recognition", "signs", making.make_recognition, config_file, parameters)
    return run(job, transport, ros_args)


def control(*ros_args: str, transport: str, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Convert the signs on gesture/hand_sign to velocities on robot_diff_drive_controller/cmd_vel.

    Example: handsteer control --transport ros1 robot_diff_drive_controller/cmd_vel:=/cmd_vel _max_linear:=0.5

    Parameters
    ----------
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        ros2 (rclpy), dds or zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, else dds), or ros1.
    config_file
        YAML file with parameters; ROS parameters override it, and options override both.
    """
    job = Job("hand_sign_control", "control", making.make_control, config_file, parameters)
    return run(job, transport, ros_args)


def robot(
    *ros_args: str,
    transport: str,
    world: str | None = None,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Simulate a robot that follows robot_diff_drive_controller/cmd_vel.

    Example: handsteer robot --transport ros1 --world obstacles

    Parameters
    ----------
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        ros2 (rclpy), dds or zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, else dds), or ros1.
    world
        Name of a shipped world, or a YAML file.
    config_file
        YAML file with parameters; ROS parameters override it, and options override both.
    """
    job = Job("robot", "robot", making.make_robot, config_file, parameters, {"robot": {"world": world}})
    return run(job, transport, ros_args)


def steering(
    *ros_args: str,
    transport: str,
    host: str | None = None,
    port: int | None = None,
    token: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Serve the page, which shows the state of the graph and steers the robot on steering/cmd_vel.

    Example: handsteer steering --transport ros1 --port 8080

    Parameters
    ----------
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.
        ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file.
    transport
        ros2 (rclpy), dds or zenoh (ROS 2 without a ROS installation), auto (ros2 if installed, else dds), or ros1.
    host
        Address that the page is served on; 0.0.0.0 makes it reachable from other machines, with a token.
    port
        Port of the page; 0 picks a free one.
    token
        Require the token in the printed address from this machine too; for machines with several users.
    config_file
        YAML file with parameters; ROS parameters override it, and options override both.
    """
    shorthand = {"dashboard": {"host": host, "port": port, "token": "always" if token else None}}
    job = Job("steering", "dashboard", making.make_steering, config_file, parameters, shorthand, _served)
    return run(job, transport, ros_args)


@contextmanager
def _served(node: Any, config: Config) -> Iterator[None]:
    # The page's libraries take a second to load, which the other nodes do not need.
    with needing("the page", "page", "nicegui"):
        from handsteer.dashboard.server import Dashboard  # noqa: PLC0415

    wires = (node.transport, node.clock, node)
    dashboard = Dashboard(*wires, config.dashboard, cmd_vel=making.cmd_vel_topic(config))
    url = dashboard.start()
    try:
        say(f"the page is at {url}")
        if config.dashboard.opens_browser:
            import webbrowser  # noqa: PLC0415

            webbrowser.open(url)
        yield
    finally:
        dashboard.stop()


def zenoh_router(*, listen: str | None = None) -> int:
    """Run the router through which nodes over Zenoh find each other, until you press Ctrl-C.

    ROS 2's own does the same (ros2 run rmw_zenoh_cpp rmw_zenohd); each machine
    needs only one of them.

    Example: handsteer zenoh-router

    Parameters
    ----------
    listen
        Endpoint, by default tcp/localhost:7447, for this machine only; tcp/[::]:7447 accepts other machines.
    """
    router = _open(listen)
    try:
        say(f"the Zenoh router listens at {' and '.join(router.endpoints)}")
        threading.Event().wait()
    except KeyboardInterrupt:
        pass  # the usual end of a router
    finally:
        router.close()
    return 0


def _open(listen: str | None) -> Any:
    with needing("the Zenoh router", "zenoh", "zenoh", "xxhash"):
        from handsteer.transports.zenoh.configuration import Router  # noqa: PLC0415
    return Router(os.environ, listen)


def robots(count: int, /, *, transport: str, world: str | None = None) -> int:
    """Simulate several robots, /r1, /r2 and so on, each in its own process and world.

    Example: handsteer robots 3 --transport dds

    To drive them in turn with one hand: handsteer control --transport dds --ros-args -p "robots:=[r1, r2, r3]"

    Parameters
    ----------
    count
        Number of robots.
    transport
        ros2, dds or zenoh (ROS 2), auto, or ros1.
    world
        Name of a shipped world, or a YAML file.
    """
    if not 1 <= count <= _MOST:
        raise ConfigError(f"{count} robots: there should be 1 to {_MOST}")
    if transport not in TRANSPORTS:
        raise ConfigError(f"there is no transport {transport!r}: use {' or '.join(TRANSPORTS)}")
    names = [f"/r{number}" for number in range(1, count + 1)]
    try:
        with _started({name: _command(name, transport, world) for name in names}) as processes:
            say(f"simulating {', '.join(names)}; Ctrl-C ends")
            name, code = _wait_for_the_first(processes)
    except KeyboardInterrupt:
        return 0  # the usual end
    say(f"the robot {name} has ended with exit code {code}, so the others end too")
    return 2


def _wait_for_the_first(processes: dict[str, subprocess.Popen[bytes]]) -> tuple[str, int]:
    """Return the name of the first process that ends, and its exit code."""
    while True:
        for name, process in processes.items():
            code = process.poll()
            if code is not None:
                return name, code
        time.sleep(_LOOK_PERIOD_S)


def _command(name: str, transport: str, world: str | None) -> list[str]:
    """Return the command line of the robot in the namespace ``name``."""
    words = [f"__ns:={name}"] if transport == "ros1" else ["--ros-args", "-r", f"__ns:={name}"]
    place = [] if world is None else ["--world", world]
    return [sys.executable, "-m", "handsteer", "robot", "--transport", transport, *place, *words]


@contextmanager
def _started(commands: dict[str, list[str]]) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    processes: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, command in commands.items():
            processes[name] = subprocess.Popen(command)
        yield processes
    finally:
        with signals_ignored():
            _end(list(processes.values()))


def _end(processes: list[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.wait(_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
