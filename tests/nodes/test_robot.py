import re
import threading
from typing import Any, ClassVar

import pytest

from handsteer.config import Config, RobotConfig
from handsteer.errors import PluginError, WorldError
from handsteer.making import open_robot
from handsteer.messages import (
    CLOCK,
    CMD_VEL,
    DIAGNOSTICS,
    ODOM,
    TF,
    WORLD_MARKERS,
    Header,
    Odometry,
    Time,
    TwistStamped,
    cmd_vel,
    twist,
)
from handsteer.nodes.diagnostics import read_status
from handsteer.nodes.robot import RobotNode
from handsteer.nodes.status import RobotStatus
from handsteer.plugins.page.editing import add, edit, remove
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.world import World, load_world
from handsteer.types import CourseState, Pose2D
from tests.nodes.stepping import Bench

START = Pose2D(0.0, 0.0, 0.0)


class RobotBench(Bench):
    def __init__(self, **settings: object) -> None:
        super().__init__()
        self.clock_messages = self.record(CLOCK)
        self.odometry = self.record(ODOM)
        self.transforms = self.record(TF)
        config = RobotConfig.model_validate({"world": "empty", **settings})
        topic = cmd_vel(config.cmd_vel_type)
        self.robot = RobotNode(self.transport, self.clock, open_robot(Config(robot=config), self.clock), config, topic)
        self.nodes = [self.robot]
        self.commands = self.transport.advertise("control", topic)

    def drive(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.commands.publish(twist(0.3, 0.0))
            self.run(0.1)

    @property
    def newest(self) -> Odometry:
        return self.odometry[-1]


def test_a_robot_that_does_not_close_keeps_nothing_running(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench()
    robot, closed = open_robot(Config(robot=RobotConfig(world="empty")), bench.clock), threading.Event()
    node = RobotNode(bench.transport, bench.clock, robot, RobotConfig(world="empty"))
    monkeypatch.setattr("handsteer.nodes.robot._LONGEST_END_S", 0.01)
    monkeypatch.setattr(robot, "close", closed.wait)
    node.stop()
    assert "the robot was not closed within 0.01 s: it may not have stopped" in caplog.text
    closed.set()


@pytest.mark.parametrize(("code", "said"), [("return None", "gave None, not a"), ("raise SystemExit(0)", "raised Sys")])
def test_a_robot_without_a_first_state_is_refused(code: str, said: str) -> None:
    bench = Bench()
    robot = open_robot(Config(robot=RobotConfig(world="empty")), bench.clock)
    scope: dict[str, Any] = {}
    exec(f"def step(dt_s):\n    {code}", scope)
    robot.step = scope["step"]  # type: ignore[method-assign]
    with pytest.raises(PluginError, match=f"^the first step of the robot SimulatedRobot {said}"):
        RobotNode(bench.transport, bench.clock, robot, RobotConfig(world="empty"))


def test_a_robot_that_fails_at_its_last_zero_is_closed_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    robot, closed = open_robot(Config(robot=RobotConfig(world="empty")), bench.clock), []
    node = RobotNode(bench.transport, bench.clock, robot, RobotConfig(world="empty"))

    def fail(*_: float) -> None:
        raise OSError("the port does not answer")

    monkeypatch.setattr(robot, "command", fail)
    monkeypatch.setattr(robot, "close", lambda: closed.append(robot))
    node.stop()
    assert closed == [robot]


def test_it_tells_the_time_only_when_asked() -> None:
    silent, asked = RobotBench(), RobotBench(publish_clock=True)
    for bench in (silent, asked):
        bench.run(0.5)
    assert silent.clock_messages == []
    assert asked.clock_messages[-1].clock == asked.newest.header.stamp


def test_coordinate_frames_are_named_as_configured() -> None:
    bench = RobotBench(odom_frame_id="r1/odom", base_frame_id="r1/base_link")
    bench.run(0.1)
    assert (bench.newest.header.frame_id, bench.newest.child_frame_id) == ("r1/odom", "r1/base_link")
    transform = bench.transforms[-1].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ("r1/odom", "r1/base_link")


def test_its_service_counts_the_odometry_from_where_the_robot_stands() -> None:
    bench = RobotBench()
    bench.drive(2.0)
    robot = bench.robot
    before = robot.state.truth
    assert robot.services()["reset_odometry"]() == "the odometry counts from here"
    bench.run(0.1)
    assert bench.newest.pose.pose.position.x < 0.1 < before.x <= robot.state.truth.x


def test_after_it_was_held_up_it_brakes_and_obeys_nothing_that_waited() -> None:
    bench = RobotBench()
    bench.drive(1.0)
    assert bench.newest.twist.twist.linear.x == pytest.approx(0.3, abs=0.02)
    bench.commands.publish(twist(0.3, 0.0))
    bench.clock.advance(5.0)
    bench.run(0.32)
    assert bench.newest.twist.twist.linear.x == pytest.approx(0.0, abs=0.02)
    bench.drive(1.0)
    assert bench.newest.twist.twist.linear.x == pytest.approx(0.3, abs=0.02)


def test_what_it_does_by_itself_is_no_command_to_a_robot_that_waits_for_a_zero() -> None:
    class Waiting(SimulatedRobot):
        commanded: ClassVar[list[float]] = []
        stood = 0

        def command(self, linear_mps: float, angular_radps: float) -> None:
            self.commanded.append(linear_mps)

        def stand(self) -> None:
            self.stood += 1

    bench = Bench()
    robot = Waiting(RobotConfig(), World())
    bench.nodes = [RobotNode(bench.transport, bench.clock, robot, RobotConfig())]
    bench.transport.advertise("control", CMD_VEL).publish(twist(0.3, 0.0))
    bench.run(0.1)
    bench.clock.advance(5.0)
    bench.run(0.1)
    assert (robot.commanded, robot.stood) == ([0.3], 1)


def test_it_says_that_it_stands_for_want_of_commands() -> None:
    bench = RobotBench()
    reports = bench.record(DIAGNOSTICS)
    bench.drive(1.0)
    assert (reports[-1].status[0].level, reports[-1].status[0].message) == (0, "moves freely")
    bench.run(1.0)
    said = reports[-1].status[0]
    assert said.level == 1
    assert re.fullmatch(r"standing: no command for 1\.[01] s, and the last one was to drive", said.message)
    bench.commands.publish(twist(0.0, 0.0))
    bench.run(1.0)
    assert reports[-1].status[0].message == "moves freely", "whoever says zero last leaves nothing to be explained"


@pytest.mark.parametrize(("age_s", "speed"), [(0.0, 0.3), (0.35, 0.3), (0.45, 0.0), (None, 0.3)])
def test_a_stamped_command_that_is_old_is_not_obeyed(age_s: float | None, speed: float) -> None:
    bench = RobotBench(cmd_vel_type="twist_stamped")
    bench.clock.advance(10.0)
    bench.run(0.3)
    for _ in range(20):
        now = bench.clock.now()
        stamp = Time(sec=0, nanosec=0) if age_s is None else bench.clock.stamp(now - age_s)
        bench.commands.publish(TwistStamped(header=Header(stamp=stamp, frame_id="base_link"), twist=twist(0.3, 0.0)))
        bench.run(0.1)
    assert bench.newest.twist.twist.linear.x == pytest.approx(speed, abs=0.02)


def test_a_zero_is_obeyed_however_old_it_is() -> None:
    bench = RobotBench(cmd_vel_type="twist_stamped", cmd_vel_timeout=5.0)
    bench.clock.advance(10.0)
    bench.run(0.3)
    for speed, age_s in ((0.3, 0.0), (0.0, 6.0)):
        stamp = bench.clock.stamp(bench.clock.now() - age_s)
        bench.commands.publish(TwistStamped(header=Header(stamp=stamp, frame_id="base_link"), twist=twist(speed, 0.0)))
        bench.run(1.0)
        assert bench.newest.twist.twist.linear.x == pytest.approx(speed, abs=0.02)


def test_the_world_changes_while_the_robot_drives_and_it_stands_then() -> None:
    bench = RobotBench()
    robot = bench.robot
    markers = bench.record(WORLD_MARKERS)
    bench.drive(1.0)
    where = robot.state.truth
    done = robot.surroundings.change(lambda world: add(world, "box", where))
    assert not done.done()
    bench.run(0.06)
    assert done.result(0) is None
    assert robot.surroundings.world is not None
    assert [thing.name for thing in robot.surroundings.world.obstacles] == ["box 1"]
    assert abs(robot.state.linear_mps) < 0.02
    assert robot.state.truth.x == pytest.approx(where.x, abs=0.02)
    assert len(markers[-1].markers) == 1
    robot.surroundings.change(lambda world: remove(world, "box 1"))
    bench.run(0.1)
    assert [marker.action for marker in markers[-1].markers] == [2]


def test_a_change_that_is_refused_changes_nothing() -> None:
    bench = RobotBench()
    robot = bench.robot
    refused = [
        robot.surroundings.change(lambda world: edit(add(world, "box", START), "box 1", {"position": [0, 0]})),
        robot.surroundings.change(lambda world: remove(world, "ghost")),
    ]
    bench.run(0.1)
    for future, words in zip(refused, ("overlaps the robot", "nothing called 'ghost'"), strict=True):
        with pytest.raises(WorldError, match=words):
            future.result(0)
    assert robot.surroundings.world == load_world("empty")
    assert robot.callback_errors == 0


def test_changes_that_nobody_makes_do_not_pile_up() -> None:
    bench = RobotBench()
    robot = bench.robot
    last = [robot.surroundings.change(lambda world: world) for _ in range(20)][-1]
    with pytest.raises(WorldError, match="too many changes wait"):
        last.result(0)


def test_back_at_the_start_everything_counts_anew() -> None:
    bench = RobotBench(world="slalom")
    robot, surroundings = bench.robot, bench.robot.surroundings
    bench.drive(6.0)
    assert surroundings.course is not None
    assert (surroundings.course.phase, surroundings.course.passed) == ("running", 1)
    surroundings.reset()
    bench.run(0.1)
    assert (robot.state.truth.x, robot.state.truth.y, robot.path_length_m) == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert surroundings.course is not None
    assert (surroundings.course.phase, surroundings.course.time_s, robot.state.collisions) == (
        "ready",
        0.0,
        0,
    )
    assert bench.newest.twist.twist.linear.x == pytest.approx(0.0, abs=1e-3)


def test_another_world_brings_its_course() -> None:
    bench = RobotBench()
    robot = bench.robot
    reports = bench.record(DIAGNOSTICS)
    bench.drive(1.0)
    before = robot.surroundings.course
    assert before is None
    robot.surroundings.enter(load_world("slalom"))
    bench.run(0.3)
    assert robot.surroundings.world == load_world("slalom")
    assert robot.surroundings.course == CourseState(8)
    status = read_status(reports[-1].status[0])
    assert isinstance(status, RobotStatus)
    assert status.course == CourseState(8)
    assert robot.state.truth.x == pytest.approx(0.0, abs=1e-3)
