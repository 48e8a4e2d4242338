"""A robot behind a topic, in a graph of its own that is within this process."""

from typing import Any

import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import RobotConfig
from handsteer.messages import (
    CMD_VEL,
    Header,
    LaserScan,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Topic,
    Twist,
    TwistWithCovariance,
    twist,
)
from handsteer.robots.remote import RemoteRobot
from handsteer.transports.base import Publisher
from handsteer.transports.in_process import InProcessTransport


class Link:
    """A session of a graph that has a listener of commands and a scanner."""

    name = "/handsteer"
    parameters: dict[str, Any] = {}  # noqa: RUF012 - never changed

    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.transport = InProcessTransport()
        self.sent: list[float] = []
        topic = Topic("/cmd_vel", Twist, depth=CMD_VEL.depth)
        self.transport.subscribe("base", topic, lambda received: self.sent.append(received.message.linear.x))
        self.scanner: Publisher[LaserScan] = self.transport.advertise("scanner", Topic("/front/scan", LaserScan))

    def scan(self, metres: float, frame_id: str = "laser", angle_rad: float = 0.0) -> None:
        now = self.clock.now()
        header = Header(self.clock.stamp(now), frame_id)
        figures = (angle_rad, angle_rad, 0.1, 0.0, 0.1, 0.1, 8.0)
        message = LaserScan(header, *figures, np.array([metres], np.float32), np.zeros(0, np.float32))
        self.scanner.publish(message, now)


def join(**config: Any) -> tuple[Link, RemoteRobot]:
    link = Link()
    settings = RobotConfig.model_validate({"kind": "dds", "scan_topic": "front/scan", **config})
    return link, RemoteRobot(settings, CMD_VEL, "base_link", link)  # type: ignore[arg-type]


def test_its_scanner_is_listened_to_once_somebody_asks() -> None:
    link, robot = join()
    assert not link.scanner.has_subscribers
    assert robot.scan() is None
    assert link.scanner.has_subscribers


def test_each_scan_is_given_once_and_with_its_age() -> None:
    link, robot = join()
    robot.scan()
    link.scan(1.5)
    link.clock.advance(0.2)
    scan = robot.scan()
    assert scan is not None
    assert scan.ranges.tolist() == [1.5]
    assert scan.age_s == pytest.approx(0.2)
    assert robot.scan() is None


def test_the_newest_scan_of_each_scanner_and_sector_is_given() -> None:
    """The guard: ``_is_of_one_scanner``: what comes between two looks must not hide that there are several."""
    link, robot = join()
    robot.scan()
    for metres in (1.0, 2.0):
        for scanner in (("front", 0.0), ("rear", 0.0), ("front", 1.0)):
            link.scan(metres, *scanner)
        link.scan(metres, "front", 0.01)
    given = [scan for _ in range(4) if (scan := robot.scan()) is not None]
    assert [(scan.frame_id, scan.angle_min) for scan in given] == [("", 0.0), ("front", 1.0), ("front", 0.01)]
    assert {float(scan.ranges[0]) for scan in given} == {2.0}


def test_a_robot_without_a_scanner_has_no_scan() -> None:
    link, robot = join(scan_topic="")
    assert robot.scan() is None
    assert not link.scanner.has_subscribers


def test_it_knows_who_else_commands_it() -> None:
    link, robot = join()
    assert robot.commanders() == ["robot"]
    teleop = link.transport.advertise("teleop", Topic("/cmd_vel", Twist, depth=CMD_VEL.depth))
    assert robot.commanders() == ["robot", "teleop"]
    assert teleop.has_subscribers


def odometry(link: Link) -> Odometry:
    at = Pose(Point(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
    pose, moving = PoseWithCovariance(at, np.zeros(36)), TwistWithCovariance(twist(0.0, 0.0), np.zeros(36))
    return Odometry(Header(link.clock.stamp(link.clock.now()), "odom"), "base_link", pose, moving)


def test_a_robot_whose_odometry_falls_silent_gets_zeros_until_it_is_back_and_a_zero_was_commanded() -> None:
    """The guard: ``is_silent`` in ``step``."""
    link, robot = join(odom_timeout=0.5)
    odom = link.transport.advertise("base", Topic("/odom", Odometry))

    def drive(linear_mps: float, seconds: float, *, is_heard: bool = True) -> float:
        for _ in range(round(seconds / 0.02)):
            if is_heard:
                odom.publish(odometry(link))
            robot.command(linear_mps, 0.0)
            link.clock.advance(0.02)
            robot.step(0.02)
        return link.sent[-1]

    drive(0.0, 0.1)
    assert drive(0.1, 1.0) == pytest.approx(0.1)
    assert drive(0.1, 0.6, is_heard=False) == 0.0
    assert drive(0.1, 1.0) == 0.0
    drive(0.0, 0.1)
    assert drive(0.1, 1.0) == pytest.approx(0.1)


def test_it_gets_several_zeros_at_the_end() -> None:
    """The guard: ``close``."""
    link, robot = join()
    robot.step(0.02)
    robot.close()
    assert link.sent[-5:] == [0.0] * 5
