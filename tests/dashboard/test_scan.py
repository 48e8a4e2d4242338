import math

import numpy as np

from handsteer.dashboard.scan import MOST_POINTS, scan_points
from handsteer.messages import Header, LaserScan, Time
from handsteer.types import Pose2D


def scan(*ranges: float, increment: float = math.pi / 2) -> LaserScan:
    header = Header(Time(0, 0), "base_scan")
    figures = (0.0, math.tau, increment, 0.0, 0.1, 0.1, 8.0)
    return LaserScan(header, *figures, np.array(ranges, np.float32), np.zeros(0, np.float32))


def test_points_are_in_the_world_where_the_robot_was() -> None:
    assert scan_points(scan(1.0, 2.0), Pose2D(1.0, 2.0, math.pi / 2)) == ((1.0, 3.0), (-1.0, 2.0))


def test_what_is_no_reading_is_no_point() -> None:
    assert scan_points(scan(math.inf, math.nan, -math.inf, 9.0, 0.01, 1.0), Pose2D(0, 0, 0)) == ((0.0, 1.0),)
    assert scan_points(scan(1.0, increment=math.nan), Pose2D(0, 0, 0)) == ()
    assert scan_points(scan(), Pose2D(0, 0, 0)) == ()


def test_a_long_scan_is_drawn_in_part() -> None:
    points = scan_points(scan(*[2.0] * 10_000, increment=math.tau / 10_000), Pose2D(0, 0, 0))
    assert 0.9 * MOST_POINTS < len(points) <= MOST_POINTS
