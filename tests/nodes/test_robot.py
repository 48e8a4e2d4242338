import re

import pytest

from handsteer.config import RobotConfig
from handsteer.messages import CLOCK, CMD_VEL, DIAGNOSTICS, ODOM, TF, Odometry, twist
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
        self.nodes = [RobotNode(self.transport, self.clock, open_robot(config), config)]
        self.commands = self.transport.advertise("control", CMD_VEL)

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
