"""The control with a scanner: by itself, and driving the simulated robot."""

import math
from typing import Any

import numpy as np
import pytest

from handsteer.config import CollisionMonitorConfig, Config, ControlConfig, RobotConfig
from handsteer.control.obstacles import ObstacleLimiter
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    HAND_SIGN,
    ODOM,
    SCAN,
    STEERING_CMD_VEL,
    Header,
    LaserScan,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    String,
    Time,
    TwistWithCovariance,
    twist,
)
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.robot import RobotNode, scan_message
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RangeScan
from handsteer.robots.world import World
from tests.about import about
from tests.nodes.stepping import Bench

RULE = CollisionMonitorConfig(enabled=True)
WALL = {"name": "wall", "shape": "box", "size": [0.2, 8, 0.5], "position": [4, 0]}


def ahead(metres: float) -> RangeScan:
    """Return a scan of something this far ahead of the scanner, and nothing else."""
    ranges = np.full(360, np.inf, np.float32)
    ranges[180] = metres
    return RangeScan(-math.pi, math.tau / 360, 0.05, 8.0, ranges)


class MonitorBench(Bench):
    def __init__(
        self, rule: CollisionMonitorConfig = RULE, control: ControlConfig | None = None, *, arming: bool = False
    ) -> None:
        super().__init__()
        self.control = HandSignControlNode(
            self.transport, self.clock, control or ControlConfig(), collision_monitor=rule, arming=arming
        )
        self.nodes = [self.control]
        self.signs = self.transport.advertise("recognition", HAND_SIGN)
        self.scans = self.transport.advertise("scanner", SCAN)
        self.twists = self.record(CMD_VEL)
        self.reports = self.record(DIAGNOSTICS)

    def show(self, sign: str, times: int = 1, scan: RangeScan | None = None, age_s: float = 0.0) -> None:
        for _ in range(times):
            if scan is not None:
                self.scan(scan, age_s)
            self.signs.publish(String(data=sign), self.clock.now())
            self.run(1 / 30)

    def scan(self, scan: RangeScan, age_s: float = 0.0) -> None:
        stamped_s = self.clock.now() - age_s
        self.scans.publish(scan_message(Header(self.clock.stamp(stamped_s), "base_scan"), scan), stamped_s)

    @property
    def command(self) -> tuple[float, float]:
        return self.twists[-1].linear.x, self.twists[-1].angular.z

    def report(self) -> tuple[str, dict[str, str]]:
        self.run(0.1)
        status = self.reports[-1].status[0]
        return status.message, {pair.key: pair.value for pair in status.values}


def test_it_is_off_by_default_and_wants_no_scans() -> None:
    bench = MonitorBench(CollisionMonitorConfig())
    assert not bench.scans.has_subscribers
    bench.show("Forward", 3)
    assert bench.command == (0.03, 0.0)


def test_without_scans_the_robot_stands_and_says_why() -> None:
    bench = MonitorBench()
    assert bench.scans.has_subscribers
    bench.show("Forward", 10)
    assert {(twist.linear.x, twist.angular.z) for twist in bench.twists} == {(0.0, 0.0)}
    assert bench.report()[0] == "standing: no laser scan has come, so what is in the way is not known"


def test_free_of_obstacles_it_changes_nothing() -> None:
    bench, plain = MonitorBench(), MonitorBench(CollisionMonitorConfig())
    for each in (bench, plain):
        each.show("Forward", 20, ahead(7.0))
        each.show("Turn Left", 20, ahead(7.0))
    assert bench.twists == plain.twists


def test_it_slows_and_says_what_for() -> None:
    bench = MonitorBench()
    bench.show("Forward", 60, ahead(0.7))
    message, values = bench.report()
    assert 0.1 < bench.command[0] < 0.5
    assert message == "driving: Forward, slowed: obstacle 0.44 m ahead"
    assert values["obstacle_m"] == "0.44"
    bench.show("Forward", 5, ahead(0.4))
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0] == "standing: stopped before an obstacle 0.14 m ahead"
    bench.show("Backward", 5, ahead(0.4))
    assert bench.command == (about(-0.05), 0.0)
    assert bench.report()[0] == "driving: Backward"


def test_speed_does_not_add_up_before_an_obstacle() -> None:
    bench = MonitorBench()
    bench.show("Forward", 100, ahead(0.4))
    bench.show("Forward", 1, ahead(7.0))
    assert bench.command == (about(0.01), 0.0)


def test_a_slowed_robot_goes_on_as_slowly_until_it_is_told_to_be_faster() -> None:
    bench = MonitorBench()
    bench.show("Forward", 60, ahead(0.7))
    slow, _ = bench.command
    bench.show("Go", 5, ahead(7.0))
    assert bench.command == (about(slow, abs=0.01), 0.0)


def test_after_an_obstacle_it_speeds_up_within_the_limit_of_acceleration() -> None:
    bench = MonitorBench(control=ControlConfig(max_linear_acceleration=0.3))
    steering = bench.transport.advertise("pad", STEERING_CMD_VEL)

    def steer(linear_mps: float, metres: float, seconds: float) -> None:
        for _ in range(round(seconds * 30)):
            bench.scan(ahead(metres))
            steering.publish(twist(linear_mps, 0.0))
            bench.run(1 / 30)

    steer(0.0, 7.0, 0.3)
    steer(1.0, 0.4, 6.0)
    assert bench.command == (0.0, 0.0)
    steer(1.0, 7.0, 0.5)
    assert 0.0 < bench.command[0] < 0.2


def test_a_scan_that_stops_coming_stops_the_robot() -> None:
    bench = MonitorBench()
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0
    bench.show("Forward", 13)
    assert bench.command[0] > 0.0
    bench.show("Forward", 3)
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0].startswith("standing: no laser scan has come for 0.")


@pytest.mark.parametrize("ahead_s", [0.0, 30.0])
def test_a_scanner_that_repeats_its_last_message_stops_the_robot(ahead_s: float) -> None:
    bench = MonitorBench()
    bench.show("Forward", 10, ahead(7.0), age_s=-ahead_s)
    assert bench.command[0] > 0.0
    stamped_s = bench.clock.now() + ahead_s
    last = scan_message(Header(bench.clock.stamp(stamped_s), "base_scan"), ahead(7.0))
    for _ in range(30):
        bench.scans.publish(last, stamped_s)
        bench.show("Forward")
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0].startswith("standing: no laser scan has come for 1.")


def test_scans_that_come_late_stop_the_robot_and_it_says_so() -> None:
    bench = MonitorBench()
    bench.show("Forward", 10, ahead(7.0), age_s=2.0)
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0] == "standing: laser scans come 2.1 s after their stamp: are the clocks synchronised?"


def test_scans_that_say_nothing_stop_the_robot(caplog: pytest.LogCaptureFixture) -> None:
    bench = MonitorBench()
    nothing = RangeScan(-math.pi, math.tau / 360, 0.05, 8.0, np.full(360, np.nan, np.float32))
    bench.show("Forward", 10, nothing)
    assert bench.command == (0.0, 0.0)
    assert "the laser scans that come have no valid range" in bench.report()[0]
    assert caplog.text.count("laser scans have no valid range") == 1


def behind() -> RangeScan:
    """Return a scan of what is behind only, where nothing is."""
    return RangeScan(math.pi / 2, math.tau / 360, 0.05, 8.0, np.full(180, np.inf, np.float32))


@pytest.mark.parametrize("second", ["another half", "another frame"])
def test_scans_of_two_scanners_on_one_topic_stop_the_robot(second: str, caplog: pytest.LogCaptureFixture) -> None:
    bench = MonitorBench()
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0
    for _ in range(10):
        bench.show("Forward", 1, ahead(0.7))
        if second == "another half":
            bench.scan(behind())
        else:
            header = Header(bench.clock.stamp(bench.clock.now()), "rear_scan")
            bench.scans.publish(scan_message(header, ahead(7.0)), bench.clock.now())
        bench.show("Forward", 1)
    assert bench.command == (0.0, 0.0)
    assert "several scanners" in bench.report()[0]
    assert len([record for record in caplog.records if "several scanners" in record.message]) == 1
    for _ in range(100):
        bench.show("Stop", 1, ahead(7.0))
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0


def test_a_scanner_whose_scans_differ_in_length_is_one() -> None:
    bench = MonitorBench()
    for shorter in range(0, 10):
        ranges = np.full(360 - shorter, 7.0, np.float32)
        bench.show("Forward", 1, RangeScan(-math.pi, math.tau / 360, 0.05, 8.0, ranges))
    assert bench.command[0] > 0.0


def test_it_can_be_turned_on_and_off_while_it_runs() -> None:
    bench = MonitorBench(CollisionMonitorConfig())
    bench.control.reconfigure(Config(collision_monitor=RULE))
    bench.show("Forward", 5)
    assert bench.command == (0.0, 0.0)
    bench.control.reconfigure(Config())
    bench.show("Stop", 1)
    bench.show("Forward", 5)
    assert bench.command[0] > 0.0


def odometry(linear_mps: float, x_m: float = 0.0) -> Odometry:
    at = Pose(Point(x_m, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
    moves = TwistWithCovariance(twist(linear_mps, 0.0), np.zeros(36))
    return Odometry(Header(Time(1, 0), "odom"), "base_link", PoseWithCovariance(at, np.zeros(36)), moves)


@pytest.mark.parametrize(
    ("says", "is_slower"),
    [
        pytest.param([odometry(0.6)], True, id="faster than commanded"),
        pytest.param([odometry(math.nan)], False, id="not a number"),
        pytest.param([odometry(0.0, 1.0), odometry(0.0, 2.0)], False, id="a twist that is left at zero"),
    ],
)
def test_how_fast_the_robot_is_it_hears_from_odometry(says: list[Odometry], *, is_slower: bool) -> None:
    told = []
    for messages in (says, [odometry(math.nan)] * len(says)):
        bench = MonitorBench(control=ControlConfig(linear_step=0.1, angular_step=2.0, max_angular=2.0))
        publisher = bench.transport.advertise("robot", ODOM)
        bench.show("Forward", 5, ahead(7.0))
        for message in messages:
            publisher.publish(message)
            bench.scan(ahead(0.57))
            bench.run(0.01)
        bench.show("Turn Left", 1, ahead(0.57))
        told.append(bench.command[0])
    assert (told[0] < told[1]) == is_slower


def assert_neutral_is_required(bench: MonitorBench, why: str, scan: RangeScan) -> None:
    bench.show("Forward", 30, scan)
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0].endswith(f"to begin ({why})")
    bench.show("Stop", 1, scan)
    bench.show("Forward", 3, scan)
    assert bench.command[0] > 0.0


@pytest.mark.parametrize("change", [{"assist": "off"}, {"margin": 0.0}])
def test_what_held_the_robot_back_sets_it_in_motion_by_no_change(change: dict[str, Any]) -> None:
    rule = CollisionMonitorConfig()
    bench = MonitorBench(rule, ControlConfig(assist="brake"))
    bench.show("Forward", 60, ahead(0.4))
    assert bench.command == (0.0, 0.0)
    control = ControlConfig(assist=change.get("assist", "brake"))
    margin = {name: value for name, value in change.items() if name == "margin"}
    bench.control.reconfigure(Config(control=control, collision_monitor=rule.model_copy(update=margin)))
    assert_neutral_is_required(bench, "its limits have changed", ahead(0.4))


@pytest.mark.parametrize("linear_mps", [1000.0, -1000.0, 26.0, 1e200, -1e308, math.inf])
def test_odometry_that_no_robot_has_counts_as_none(linear_mps: float) -> None:
    """For example in mm/s. It made the braking way so long that the steps along it led over the wall."""
    bench = MonitorBench(control=ControlConfig(linear_step=0.1))
    publisher = bench.transport.advertise("robot", ODOM)
    publisher.publish(odometry(0.0))
    bench.show("Forward", 8, ahead(7.0))
    assert bench.command[0] > 0.5
    for _ in range(30):
        message = odometry(linear_mps)
        message.header.stamp = bench.clock.stamp(2.0 + bench.clock.now())
        publisher.publish(message)
        bench.show("Forward", 1, ahead(0.5))
    assert bench.command == (0.0, 0.0)
    assert bench.report()[0].endswith("(the robot's odometry has stopped)")


def test_a_collision_monitor_that_fails_stops_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = MonitorBench(arming=True)
    bench.show("Stop", 40, ahead(7.0))
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0

    def fail(*_args: object) -> None:
        raise OverflowError("(34, 'Numerical result out of range')")

    with monkeypatch.context() as patch:
        patch.setattr(ObstacleLimiter, "limit", fail)
        bench.show("Forward", 10, ahead(7.0))
        assert bench.command == (0.0, 0.0)
    assert_neutral_is_required(bench, "the collision monitor has failed", ahead(7.0))


def test_several_robots_are_refused() -> None:
    with pytest.raises(ValueError, match="it is for one robot"):
        Config(collision_monitor=RULE, control=ControlConfig(robots=("r1", "r2")))


class LateRobot(SimulatedRobot):
    """Says what it saw one scan ago, as if it were new."""

    _before: RangeScan | None = None

    def scan(self) -> RangeScan:
        before, self._before = self._before, super().scan()
        return before or self._before


class Drive(MonitorBench):
    """The control drives a simulated robot in a world, as told by signs or by hand."""

    def __init__(self, *obstacles: dict[str, Any], late: bool = False, **control: Any) -> None:
        super().__init__(control=ControlConfig.model_validate(control))
        kind = LateRobot if late else SimulatedRobot
        robot = kind(RobotConfig(), World.model_validate({"obstacles": obstacles}))
        self.robot = RobotNode(self.transport, self.clock, robot, RobotConfig())
        self.steering = SteeringNode(self.transport, self.clock)
        self.nodes = [self.steering, self.robot, self.control]
        self.steering.steer(0.0, 0.0)
        self.run(0.1)

    def steer(self, linear_mps: float, angular_radps: float, seconds: float) -> None:
        self.steering.steer(linear_mps, angular_radps)
        self.run(seconds)

    @property
    def gap_m(self) -> float:
        """How far the robot's front is from the wall."""
        return 3.9 - self.robot.state.truth.x - 0.26


@pytest.mark.parametrize("late", [False, True], ids=["fresh", "a scan late"])
@pytest.mark.parametrize("linear_mps", [0.1, 0.3, 0.6, 1.0, 1.5, 2.0])
def test_a_drive_towards_a_wall_ends_before_it_and_can_back_out(linear_mps: float, *, late: bool) -> None:
    drive = Drive(WALL, late=late, max_linear=2.0)
    drive.run(0.2)
    drive.steer(linear_mps, 0.0, 3.0 / linear_mps + 12.0)
    assert drive.robot.state.collisions == 0
    assert 0.1 < drive.gap_m < 0.3
    assert abs(drive.robot.state.linear_mps) < 0.01
    drive.steer(-0.5, 0.0, 3.0)
    assert drive.gap_m > 1.2


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_before_a_wall_it_can_turn_away_and_drive_on(turn: float) -> None:
    drive = Drive(WALL)
    drive.steer(1.0, 0.0, 10.0)
    drive.steer(0.5, turn, 1.6)
    drive.steer(0.5, 0.0, 3.0)
    assert drive.robot.state.collisions == 0
    assert abs(drive.robot.state.truth.y) > 0.8


@pytest.mark.parametrize("seed", range(4))
def test_whoever_steers_wildly_touches_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    posts = [
        {"name": f"post {n}", "shape": "cylinder", "radius": 0.1, "height": 0.5, "position": [x, y]}
        for n, (x, y) in enumerate([(1.5, 0.5), (1.5, -0.9), (-1.2, 0.4), (0.2, 1.6), (-0.6, -1.5)])
    ]
    drive = Drive(WALL, *posts)
    drive.run(0.2)
    for linear_mps, angular_radps, seconds in rng.uniform([-1, -2, 0.2], [1, 2, 2.0], (40, 3)):
        drive.steer(linear_mps, angular_radps, seconds)
    assert drive.robot.state.collisions == 0
    assert drive.robot.path_length_m > 2.0


def test_the_message_is_a_whole_laser_scan() -> None:
    drive = Drive(WALL)
    scans = drive.record(SCAN)
    drive.run(1.0)
    scan = scans[-1]
    assert isinstance(scan, LaserScan)
    assert scan.header.frame_id == "base_scan"
    assert 9 <= len(scans) <= 11
    assert scan.angle_min + 359 * scan.angle_increment == pytest.approx(scan.angle_max)
    assert scan.ranges[180] == pytest.approx(3.9, abs=0.01)


def test_after_missing_scans_neutral_is_shown_first() -> None:
    """The guard: ``why_blind`` in ``_look_after_the_robot``."""
    bench = MonitorBench()
    bench.show("Forward", 10, ahead(7.0))
    bench.show("Forward", 30)
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0, "without arming, the hand goes on"
    bench = MonitorBench(arming=True)
    bench.show("NONE", 60, ahead(7.0))
    bench.show("Forward", 10, ahead(7.0))
    assert bench.command[0] > 0.0
    bench.show("Forward", 30)
    bench.show("Forward", 30, ahead(7.0))
    assert bench.command == (0.0, 0.0)
    assert "laser scans did not come" in bench.report()[0]
    bench.show("Stop", 1, ahead(7.0))
    bench.show("Forward", 1, ahead(7.0))
    assert bench.command[0] > 0.0
