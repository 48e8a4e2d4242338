"""Processes of a graph: one node each, and several simulated robots."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from handsteer.cli.app import PageOptions, Parameters, Transport, Whole, loads
from handsteer.cli.running import say, settings, signals_ignored
from handsteer.errors import ConfigError, did_you_mean

_MOST = 30
_LOOK_PERIOD_S = 0.2
_END_TIMEOUT_S = 3.0

RosArgument = Annotated[
    str,
    Parameter(
        help="ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace, _parameter:=value.\n"
        "ROS 2: --ros-args -r topic:=other -r __node:=name -r __ns:=/namespace -p parameter:=value --params-file file."
    ),
]
NodeFile = Annotated[
    Path | None,
    Parameter(
        name="--config",
        help="YAML file with parameters, each of which is an option too: `handsteer parameters`. ROS parameters "
        "override the\nfile, and options override both.",
    ),
]


@loads("handsteer.cli.one_node", "handsteer.nodes.camera")
def camera(
    *ros_args: RosArgument,
    transport: Transport,
    camera: str | None = None,
    config_file: NodeFile = None,
    parameters: Parameters = None,
) -> int:
    """Publish a camera's frames on image_raw.

    For example:
      handsteer camera --transport auto
      handsteer camera --transport ros1 --camera 0 image_raw:=/front/image_raw

    Parameters
    ----------
    camera
        auto, virtual, a webcam's index or /dev/videoN, an address (rtsp, http), a video file or a folder of photos.
    """
    return _run("camera", transport, ros_args, config_file, parameters, camera={"source": camera})


@loads("handsteer.cli.one_node", "handsteer.nodes.recognition")
def recognition(
    *ros_args: RosArgument, transport: Transport, config_file: NodeFile = None, parameters: Parameters = None
) -> int:
    """Recognise the sign in each frame of image_raw, and publish it on gesture/hand_sign.

    For example:
      handsteer recognition --transport auto
      handsteer recognition --transport ros1 image_raw:=/front/image_raw
    """
    return _run("recognition", transport, ros_args, config_file, parameters)


@loads("handsteer.cli.one_node", "handsteer.nodes.control")
def control(
    *ros_args: RosArgument, transport: Transport, config_file: NodeFile = None, parameters: Parameters = None
) -> int:
    """Convert the signs on gesture/hand_sign to velocities on robot_diff_drive_controller/cmd_vel.

    For example:
      handsteer control --transport auto --ros-args -p max_linear:=0.5
      handsteer control --transport ros1 _max_linear:=0.5
    """
    return _run("control", transport, ros_args, config_file, parameters)


@loads("handsteer.cli.one_node", "handsteer.nodes.robot")
def robot(
    *ros_args: RosArgument,
    transport: Transport,
    world: str | None = None,
    config_file: NodeFile = None,
    parameters: Parameters = None,
) -> int:
    """Simulate a robot that follows robot_diff_drive_controller/cmd_vel.

    For example:
      handsteer robot --transport auto
      handsteer robot --transport ros1 --world obstacles

    Parameters
    ----------
    world
        Name of a shipped world, or a YAML file.
    """
    return _run("robot", transport, ros_args, config_file, parameters, robot={"world": world})


@loads("handsteer.cli.one_node", "handsteer.nodes.steering")
def steering(
    *ros_args: RosArgument,
    transport: Transport,
    page: PageOptions = PageOptions(),  # noqa: B008 - it is frozen
    config_file: NodeFile = None,
    parameters: Parameters = None,
) -> int:
    """Serve the page, which shows the state of the graph and steers the robot on steering/cmd_vel.

    For example:
      handsteer steering --transport auto
      handsteer steering --transport ros1 --port 9000
    """
    return _run("steering", transport, ros_args, config_file, parameters, dashboard=page.parameters())


def _run(
    verb: str,
    transport: str,
    words: tuple[str, ...],
    file: Path | None,
    given: dict[str, Any] | None,
    **shorthand: dict[str, Any],
) -> int:
    from handsteer.cli.one_node import run

    return run(verb, transport, words, lambda service: settings(file, given, shorthand, service=service))


def robots(count: Whole, /, *, transport: str, world: str | None = None) -> int:
    """Simulate several robots, /r1, /r2 and so on, each in its own process and world.

    For example:
      handsteer robots 3 --transport dds
      handsteer control --transport dds --ros-args -p "robots:=[r1, r2, r3]"

    Parameters
    ----------
    count
        Number of robots.
    transport
        ros2, dds or zenoh (ROS 2), auto, or ros1.
    world
        Name of a shipped world, or a YAML file.
    """
    from handsteer.transports import transports

    if not 1 <= count <= _MOST:
        raise ConfigError(f"{count} robots: there should be 1 to {_MOST}")
    known = transports()
    if transport not in known:
        near = did_you_mean(transport, known)
        raise ConfigError(f"there is no transport {transport!r}{near or ':'} use {' or '.join(known)}")
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
