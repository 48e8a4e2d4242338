import re

import pytest

from handsteer.config import RobotConfig
from handsteer.messages import (
    CLOCK,
    DIAGNOSTICS,
    ODOM,
    TF,
    Header,
    Odometry,
    Time,
    TwistStamped,
    cmd_vel,
    twist,
)
from handsteer.nodes.robot import RobotNode
from handsteer.robots import open_robot
from tests.nodes.stepping import Bench


class RobotBench(Bench):
    def __init__(self, **settings: object) -> None:
        super().__init__()
        self.clock_messages = self.record(CLOCK)
        self.odometry = self.record(ODOM)
        self.transforms = self.record(TF)
        config = RobotConfig.model_validate({"world": "empty", **settings})
        topic = cmd_vel(config.cmd_vel_type)
        self.nodes = [RobotNode(self.transport, self.clock, open_robot(config), config, topic)]
        self.commands = self.transport.advertise("control", topic)

    def drive(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.commands.publish(twist(0.3, 0.0))
            self.run(0.1)

    @property
    def newest(self) -> Odometry:
        return self.odometry[-1]


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
