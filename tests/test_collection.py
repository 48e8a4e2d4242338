"""The tests themselves: they are found where ROS is not installed, and each slow one is run on one of some days."""

import datetime
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import SLOW_PARTS, is_of_day

ROOT = Path(__file__).resolve().parents[1]
COLLECT = """
import sys, pytest
sys.modules.update(dict.fromkeys(("rclpy", "rosgraph", "roslib", "rospy", "rosparam", "std_msgs", "geometry_msgs")))
sys.exit(pytest.main(["--collect-only", "-qq", "-p", "no:cacheprovider", "tests"]))
"""


@pytest.mark.exhaustive
@pytest.mark.slow
def test_all_tests_are_found_without_ros() -> None:
    found = subprocess.run([sys.executable, "-c", COLLECT], cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout[-3000:]


def test_each_slow_test_has_one_day_and_no_day_has_all() -> None:
    days = [str(datetime.date(2026, 11, 29) + datetime.timedelta(days=number)) for number in range(SLOW_PARTS)]
    for number in range(20):
        assert [is_of_day(number, day) for day in days].count(True) == 1
    for day in days:
        assert [is_of_day(number, day) for number in range(SLOW_PARTS)].count(True) == 1
