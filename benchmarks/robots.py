"""Number of simulated robots per core: N processes in N namespaces over DDS, each at 50 Hz.

Run ``python benchmarks/robots.py`` with cyclonedds installed. Each robot receives 30 commands per second, and its
odometry is received. ``in time`` is the share of the 50 odometry messages per second that arrived; overloaded robots
fall behind.
"""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the domains that the tests use

from _measuring import cpu_s, resident_mb
from tests.dds.graph import free_domain

from handsteer.messages import CMD_VEL, ODOM, Twist, twist
from handsteer.transports import join
from handsteer.transports.base import Publisher

_ODOMETRY_HZ = 50
_COMMAND_PERIOD_S = 1 / 30
_START_TIMEOUT_S = 180.0


def measure(count: int, seconds: float) -> tuple[float, float, float]:
    """Return CPU seconds per second and MB of one of ``count`` robots, and the share of its odometry that arrived."""
    os.environ["ROS_DOMAIN_ID"] = str(free_domain())
    names = [f"/r{number}" for number in range(1, count + 1)]
    session = join("dds", "benchmark", [])
    commands = [session.transport.advertise("benchmark", replace(CMD_VEL, name=name + CMD_VEL.name)) for name in names]
    came = dict.fromkeys(names, 0)

    def note(name: str, _: object) -> None:
        came[name] += 1

    for name in names:
        topic = replace(ODOM, name=name + ODOM.name)
        session.transport.subscribe("benchmark", topic, partial(note, name))
    program = [sys.executable, "-m", "handsteer", "robot", "--transport", "dds", "--ros-args", "-r"]
    robots = [subprocess.Popen([*program, f"__ns:={name}"]) for name in names]
    try:
        _wait_until(lambda: all(came.values()))
        _drive(commands, 2.0)
        before, first = [cpu_s(robot.pid) for robot in robots], dict(came)
        took_s = _drive(commands, seconds)
        used = sum(cpu_s(robot.pid) for robot in robots) - sum(before)
        share = sum(came[name] - first[name] for name in names) / (count * took_s * _ODOMETRY_HZ)
        return used / took_s / count, resident_mb(robots[0].pid), share
    finally:
        for robot in robots:
            robot.terminate()
        for robot in robots:
            robot.wait()
        session.close()


def _wait_until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + _START_TIMEOUT_S
    while not condition():
        if time.monotonic() > deadline_s:
            sys.exit("not all robots have started")
        time.sleep(0.05)


def _drive(commands: list[Publisher[Twist]], seconds: float) -> float:
    """Drive all robots in circles for ``seconds``; return the elapsed time."""
    began_s = time.monotonic()
    while (passed_s := time.monotonic() - began_s) < seconds:
        for command in commands:
            command.publish(twist(0.1, 0.5))
        time.sleep(_COMMAND_PERIOD_S)
    return passed_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--seconds", type=float, default=10.0)
    arguments = parser.parse_args()
    print(f"Robots at {_ODOMETRY_HZ} Hz over DDS, {os.cpu_count()} cores; load {os.getloadavg()[0]:.1f} before")
    print(f"{'robots':>6} {'% of a core each':>17} {'robots per core':>14} {'MB each':>8} {'in time':>8}")
    for count in arguments.counts:
        each, memory, share = measure(count, arguments.seconds)
        print(f"{count:>6} {100 * each:>17.1f} {1 / each:>14.1f} {memory:>8.0f} {100 * share:>7.0f}%")


if __name__ == "__main__":
    main()
