"""Converts laser scans of robots to messages."""

import numpy as np

from handsteer.messages import Header, LaserScan
from handsteer.robots.protocol import RangeScan

_PERIOD_S = 0.1


def scan_message(header: Header, scan: RangeScan) -> LaserScan:
    """Return ``scan`` as a message; all rays have the same time."""
    return LaserScan(
        header=header,
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + scan.angle_increment * max(0, len(scan.ranges) - 1),
        angle_increment=scan.angle_increment,
        time_increment=0.0,
        scan_time=_PERIOD_S,
        range_min=scan.range_min,
        range_max=scan.range_max,
        ranges=scan.ranges,
        intensities=np.zeros(0, np.float32),
    )
