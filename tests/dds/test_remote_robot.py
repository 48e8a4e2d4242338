"""``handsteer run --robot dds``: a robot in another process, which is a plain DDS program."""

import json
import math
import signal
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.contracts.node_contract import VIRTUAL
from tests.dds.graph import DdsGraph
from tests.processes import Peer, Process, eventually

pytest.importorskip("cyclonedds")
pytestmark = pytest.mark.slow

ROBOT = Path(__file__).with_name("robot.py")
CAMERA = ("--headless", "--json", *VIRTUAL)
FORWARD = "Stop:2 Forward:25"  # neutral again for a machine so busy that the robot was stopped
STOP_S = 0.5


class Robots:
    """A domain with a robot in it, and runs that drive it."""

    def __init__(self, graph: DdsGraph, home: Path) -> None:
        self.graph = graph
        self._home = home
        self.robot = self.start_robot()

    def start_robot(self) -> Peer:
        log = self._home / f"robot_{time.monotonic_ns()}.log"
        robot = Peer([sys.executable, str(ROBOT), str(self.graph.domain)], self.graph.env, log)
        self.graph.adopt(robot)
        return robot

    def add(self, cmd_vel: str = "/cmd_vel", odom: str = "/odom", **kind: Any) -> None:
        self.robot.ask("add", name="it", cmd_vel=cmd_vel, odom=odom, **kind)

    def run(self, *arguments: str, script: str = FORWARD) -> Process:
        # A busy machine may miss frames of the gesture.
        words = (*CAMERA, "--control.engage-by", "hold", "--virtual-hand.script", script)
        self._process = self.graph.handsteer("run", *words, *arguments)
        return self._process

    @property
    def speed(self) -> float:
        return float(self.robot.ask("state", name="it")[3])

    @property
    def told(self) -> list[tuple[float, float, float]]:
        """When it was told what: seconds of the monotonic clock, m/s, rad/s."""
        return [(at_s, linear, angular) for at_s, linear, angular, *_ in self.robot.ask("commands", name="it")]

    def expect_speed(self, speed: float) -> None:
        def reached() -> bool:
            return abs(self.speed - speed) < 1e-6

        eventually(lambda: reached() or (speed and not self._process.running), what=f"{speed} m/s")
        assert reached(), self._process.text


@pytest.fixture
def robots(fresh: DdsGraph, tmp_path: Path) -> Robots:
    return Robots(fresh, tmp_path)


def summary_of(process: Process) -> dict[str, Any]:
    assert process.code() == 0, process.text
    return dict(json.loads(next(line for line in process.text.splitlines() if line.startswith("{"))))


def test_it_is_driven_within_its_limits_and_says_where_it_is(robots: Robots) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--robot.max-linear", "0.2", "--control.linear-step", "0.1")
    robots.expect_speed(0.2)
    time.sleep(1.0)
    process.signal(signal.SIGTERM)
    summary = summary_of(process)
    x, _, _, linear, _ = robots.robot.ask("state", name="it")
    assert linear == 0.0
    assert summary["final_pose"]["x"] == pytest.approx(x, abs=0.05)
    assert summary["path_length_m"] == pytest.approx(x, abs=0.05)
    assert (summary["contacts"], summary["trouble"]) == (None, "")
    told = robots.told
    assert max(linear for _, linear, _ in told) == pytest.approx(0.2)
    # 0.5 m/s² of the generic robot, told at 50 Hz at most.
    assert max(after[1] - before[1] for before, after in pairwise(told)) <= 0.5 * 0.1 + 1e-9
    moving = [at_s for at_s, linear, _ in told if linear > 0]
    assert max(b - a for a, b in pairwise(moving)) < STOP_S
    assert [linear for _, linear, _ in told[-3:]] == [0.0, 0.0, 0.0]


def test_a_known_robot_has_its_type_and_limits(robots: Robots) -> None:
    robots.add("/r1/base/cmd_vel", "/r1/odom", stamped=True)
    words = ("--ros-args", "-r", "__ns:=/r1", "-r", "cmd_vel:=base/cmd_vel")
    process = robots.run("--robot", "turtlebot4", *words)
    robots.expect_speed(0.306)
    *_, stamp_s, frame = robots.robot.ask("commands", name="it")[-1]
    assert abs(stamp_s - time.time()) < 2.0
    assert frame == "base_link"
    assert "/r1/handsteer" in robots.graph.nodes()
    process.signal(signal.SIGINT)
    assert summary_of(process)["path_length_m"] > 0


def test_a_robot_that_is_left_for_one_that_takes_a_stamp_stands_and_the_other_waits_for_neutral(robots: Robots) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--control.max-linear", "0.1", "--robot.odom-topic", "")
    robots.expect_speed(0.1)
    robots.robot.ask("add", name="stamped", cmd_vel="/cmd_vel", odom="/other/odom", stamped=True)
    eventually(lambda: "commands go out as geometry_msgs/msg/TwistStamped from now on" in process.text)
    assert robots.told[-1][1] == 0.0
    eventually(lambda: len(robots.robot.ask("commands", name="stamped")) > 30, what="further commands")
    assert {speed for _, speed, *_ in robots.robot.ask("commands", name="stamped")} == {0.0}


def test_a_turtle_says_where_it_is_in_its_own_words(robots: Robots) -> None:
    robots.add("/turtle1/cmd_vel", "/turtle1/pose", turtle=True)
    process = robots.run("--robot", "turtlesim", "--control.max-linear", "0.3")
    robots.expect_speed(0.3)
    process.signal(signal.SIGTERM)
    summary = summary_of(process)
    assert summary["final_pose"]["x"] == pytest.approx(robots.robot.ask("state", name="it")[0], abs=0.05)


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_it_stands_when_who_drives_it_is_gone(robots: Robots, end: signal.Signals) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--control.max-linear", "0.1")
    robots.expect_speed(0.1)
    process.signal(end)
    ended_s = time.monotonic()
    robots.expect_speed(0.0)
    # The robot's own watchdog is the one that barks here, after half a second without a command.
    assert robots.told[-1][0] - ended_s < 0.1


def test_it_is_told_to_stand_when_the_hand_is_gone(robots: Robots) -> None:
    robots.add()
    robots.run("--robot", "dds", "--control.max-linear", "0.1", script="Stop:2 Forward:3 NONE:9")
    robots.expect_speed(0.1)
    robots.expect_speed(0.0)
    since = len(robots.told)
    eventually(lambda: len(robots.told) > since + 10, what="zeros for as long as there is no hand")
    assert {linear for _, linear, _ in robots.told[since:]} == {0.0}


def test_after_its_odometry_stopped_it_moves_only_with_a_fresh_sign(robots: Robots) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--control.max-linear", "0.1")
    robots.expect_speed(0.1)
    robots.robot.ask("odometry", name="it", mode="off")
    robots.expect_speed(0.0)
    robots.robot.ask("odometry", name="it", mode="on")
    since = len(robots.told)
    eventually(lambda: len(robots.told) > since + 30, what="further commands")
    assert {linear for _, linear, _ in robots.told[since:]} == {0.0}
    assert process.running


def test_a_robot_that_comes_back_from_the_dead_waits_for_a_fresh_sign(robots: Robots) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--control.max-linear", "0.1")
    robots.expect_speed(0.1)
    robots.robot.kill()
    time.sleep(1.0)  # no robot is back sooner
    robots.robot = robots.start_robot()
    robots.add()
    eventually(lambda: len(robots.told) > 30, what="commands for the robot that came back")
    assert {linear for _, linear, _ in robots.told} == {0.0}
    assert process.running


@pytest.mark.parametrize(("mode", "trouble"), [("nan", "that is not a number"), ("far", "")])
def test_odometry_that_makes_no_sense_breaks_nothing(robots: Robots, mode: str, trouble: str) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--control.max-linear", "0.1")
    robots.expect_speed(0.1)
    robots.robot.ask("odometry", name="it", mode=mode)
    time.sleep(1.0)
    process.signal(signal.SIGTERM)
    summary = summary_of(process)
    assert (trouble in summary["trouble"]) if trouble else not summary["trouble"]
    assert summary["callback_errors"] == 0
    assert summary["path_length_m"] < 10.0
    assert math.isfinite(summary["final_pose"]["x"])


def test_nobody_listens_or_to_another_type(robots: Robots) -> None:
    robots.add("/cmd_vel", "/odom", stamped=True)
    process = robots.run("--robot", "dds", "--robot.cmd-vel-type", "twist", "--duration", "4")
    summary = summary_of(process)
    line = "no node subscribes to /cmd_vel with geometry_msgs/msg/Twist; is it on, are topic and type right"
    assert f"handsteer: the robot is not there: {line}" in process.text
    assert line in summary["trouble"]
    assert summary["final_pose"]["x"] == 0.0
    assert "ours has the type geometry_msgs/msg/Twist, theirs geometry_msgs/msg/TwistStamped" in process.text


def test_without_odometry_it_is_driven_all_the_same(robots: Robots) -> None:
    robots.add()
    process = robots.run("--robot", "dds", "--robot.odom-topic", "", "--control.max-linear", "0.1")
    robots.expect_speed(0.1)
    process.signal(signal.SIGTERM)
    assert summary_of(process)["final_pose"] is None
