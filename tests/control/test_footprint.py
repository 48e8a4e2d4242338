import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import CollisionMonitorConfig
from handsteer.control.footprint import MOST_POINTS, points_of
from handsteer.messages import Header, LaserScan, Time

RULE = CollisionMonitorConfig(enabled=True)


def scan_of(*ranges: float, **fields: float) -> LaserScan:
    """Return a scan whose first ray is straight ahead, with a quarter of a turn from one to the next."""
    figures = {
        "angle_min": 0.0,
        "angle_max": math.tau,
        "angle_increment": math.pi / 2,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 8.0,
        **fields,
    }
    header = Header(Time(0, 0), "base_scan")
    return LaserScan(header=header, ranges=np.array(ranges, np.float32), intensities=np.zeros(0, np.float32), **figures)


def points(scan: LaserScan, rule: CollisionMonitorConfig = RULE) -> list[list[float]] | None:
    found = points_of(scan, rule)
    return None if found is None else found.round(3).tolist()


def test_rays_are_points_ahead_to_the_left_behind_and_to_the_right() -> None:
    assert points(scan_of(1, 2, 3, 4)) == [[1, 0], [0, 2], [-3, 0], [0, -4]]


def test_the_scanner_may_be_elsewhere_and_turned() -> None:
    turned = RULE.model_copy(update={"scan_x": 0.1, "scan_y": -0.2, "scan_yaw": math.pi / 2})
    assert points(scan_of(1.0), turned) == [[0.1, 0.8]]


def test_what_is_out_of_range_is_as_rep_117_has_it() -> None:
    assert points(scan_of(math.inf, 9.0, math.nan, 0.05)) == []


def test_too_near_to_be_measured_is_a_touch_at_the_edge_of_the_robot() -> None:
    assert points(scan_of(-math.inf, 1.0)) == [[0, 1], [0.26, 0]]
    assert points(scan_of(math.inf, -math.inf)) == [[0, 0.245]]


def test_what_is_within_the_robot_is_a_part_of_it() -> None:
    assert points(scan_of(0.15, 0.23, 0.24, 1.0)) == [[0, 0.23], [-0.24, 0], [0, -1]]


@pytest.mark.parametrize(
    "scan",
    [
        scan_of(),
        scan_of(math.nan, math.nan),
        scan_of(0.0, 0.0),
        scan_of(1.0, angle_increment=0.0),
        scan_of(1.0, angle_increment=math.nan),
        scan_of(1.0, angle_min=math.inf),
        scan_of(1.0, range_max=math.nan),
        scan_of(1.0, range_max=-1.0),
        scan_of(0.45, 0.45, range_min=10.0, range_max=0.1),
        scan_of(0.45, 0.45, angle_min=1e30),
        scan_of(0.45, 0.45, angle_increment=1e30),
    ],
)
def test_a_scan_that_says_nothing_is_none(scan: LaserScan) -> None:
    assert points(scan) is None


def test_a_huge_scan_is_thinned_and_keeps_what_is_near() -> None:
    ranges = np.full(1_000_000, 5.0)
    ranges[123_456] = 1.0
    found = points_of(scan_of(*ranges, angle_increment=math.tau / len(ranges)), RULE)
    assert found is not None
    assert len(found) <= MOST_POINTS
    assert np.hypot(*found.T).min() == pytest.approx(1.0)


@given(
    st.lists(st.floats(width=32), max_size=50),
    st.floats(width=32),
    st.floats(width=32),
    st.floats(width=32),
)
def test_whatever_comes_is_points_or_nothing(ranges: list[float], first: float, each: float, longest: float) -> None:
    found = points_of(scan_of(*ranges, angle_min=first, angle_increment=each, range_max=longest), RULE)
    assert found is None or (np.isfinite(found).all() and found.shape[1] == 2)
