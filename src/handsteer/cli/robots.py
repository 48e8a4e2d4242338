"""``handsteer robots``: several simulated robots on one machine, each in its own namespace."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from handsteer.cli.running import say, signals_ignored
from handsteer.errors import ConfigError
from handsteer.transports import TRANSPORTS

_MOST = 30
_LOOK_PERIOD_S = 0.2
_END_TIMEOUT_S = 3.0


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
