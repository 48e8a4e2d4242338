"""The tests themselves are found where ROS is not installed: README's ``make test`` runs there."""

import subprocess
import sys
from pathlib import Path

import pytest

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
